#include "fusion/report/markup.h"

#include <catch2/catch.hpp>

namespace imprint {

TEST_CASE("markup: no text can become a tag, an entity or the end of an attribute") {
  REQUIRE(markup_text("<a href=\"x\">R&D's</a>") == "&lt;a href=&quot;x&quot;&gt;R&amp;D&#39;s&lt;/a&gt;");
  REQUIRE(markup_text("Größe ± 1 µm") == "Größe ± 1 µm");
}

TEST_CASE("markup: what XML cannot carry is replaced, what it can is kept") {
  using namespace std::string_literals;
  REQUIRE(markup_text("a\0b\x1B"s) ==
          "a\xEF\xBF\xBD"
          "b\xEF\xBF\xBD");
  REQUIRE(markup_text("\xEF\xBF\xBE|\xEF\xBF\xBF") == "\xEF\xBF\xBD|\xEF\xBF\xBD");
  REQUIRE(markup_text("\t\n") == "\t\n");
}

TEST_CASE("script json: reads as the same document and cannot end its script") {
  const nlohmann::json document = {
      {"</script><!--", "<script>&amp;\u2028"}, {"numbers", {1.5, -2e-300, 0}}, {"none", nullptr}};
  const std::string script = script_json(document);
  for (const char forbidden : {'<', '>', '&'}) REQUIRE(script.find(forbidden) == std::string::npos);
  REQUIRE(nlohmann::json::parse(script) == document);
}

}  // namespace imprint
