#include "lib/targets/target_library.h"

#include <set>

#include <nlohmann/json.hpp>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr int kFewestBits = 4, kMostBits = 30;

std::string code_text(std::uint32_t code, int bits) {
  std::string text;
  for (int bit = bits - 1; bit >= 0; --bit) text += (code >> bit & 1U) != 0 ? '1' : '0';
  return text;
}

Result<TargetCode> parse_code(const nlohmann::json& entry, int bits) {
  TargetCode code;
  code.id = entry.at("id").get<int>();
  const auto text = entry.at("code").get<std::string>();
  if (text.size() != static_cast<std::size_t>(bits) || text.find_first_not_of("01") != std::string::npos) {
    return invalid_input("code of id {}: expected {} digits 0 or 1, found \"{}\"", code.id, bits, text);
  }
  for (const char digit : text) code.code = code.code << 1U | (digit == '1' ? 1U : 0U);
  return code;
}

Result<void> check(const TargetLibrary& library) {
  const auto& g = library.geometry;
  if (!(g.dot_radius > 0 && g.ring_inner_radius > g.dot_radius && g.ring_outer_radius > g.ring_inner_radius)) {
    return invalid_input("geometry: expected 0 < dot_radius < ring_inner_radius < ring_outer_radius, found {}, {}, {}",
                         g.dot_radius, g.ring_inner_radius, g.ring_outer_radius);
  }
  if (library.codes.empty()) return invalid_input("codes: expected at least one, found none");
  std::set<int> ids;
  for (const TargetCode& code : library.codes) {
    if (!ids.insert(code.id).second) return invalid_input("codes: id {} stands there twice", code.id);
  }
  return {};
}

Result<TargetLibrary> from_json(const nlohmann::json& json) {
  TargetLibrary library;
  const auto schema = json.at("schema").get<std::string>();
  if (schema != "imprint.library/1")
    return invalid_input("schema: expected \"imprint.library/1\", found \"{}\"", schema);
  library.bits = json.at("bits").get<int>();
  if (library.bits < kFewestBits || library.bits > kMostBits) {
    return invalid_input("bits: expected {} to {}, found {}", kFewestBits, kMostBits, library.bits);
  }
  library.min_distance = json.at("min_distance").get<int>();
  if (json.contains("geometry")) {
    const auto& geometry = json.at("geometry");
    library.geometry = {geometry.at("dot_radius").get<double>(), geometry.at("ring_inner_radius").get<double>(),
                        geometry.at("ring_outer_radius").get<double>()};
  }
  for (const auto& entry : json.at("codes")) {
    const auto code = parse_code(entry, library.bits);
    if (!code) return pass_on(code.error());
    library.codes.push_back(*code);
  }
  if (auto checked = check(library); !checked) return pass_on(checked.error());
  return library;
}

}  // namespace

Result<TargetLibrary> read_target_library(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  try {
    auto library = from_json(nlohmann::json::parse(*text));
    if (!library) return invalid_input("{}: {}", path.string(), library.error().message);
    return library;
  } catch (const nlohmann::json::exception& error) {
    return invalid_input("{}: not a target library: {}", path.string(), error.what());
  }
}

Result<void> write_target_library(const TargetLibrary& library, const std::filesystem::path& path) {
  nlohmann::ordered_json json;
  json["schema"] = "imprint.library/1";
  json["bits"] = library.bits;
  json["min_distance"] = library.min_distance;
  json["geometry"] = {{"dot_radius", library.geometry.dot_radius},
                      {"ring_inner_radius", library.geometry.ring_inner_radius},
                      {"ring_outer_radius", library.geometry.ring_outer_radius}};
  json["codes"] = nlohmann::ordered_json::array();
  for (const TargetCode& code : library.codes) {
    json["codes"].push_back({{"id", code.id}, {"code", code_text(code.code, library.bits)}});
  }
  return write_file_atomically(path, json.dump(1) + "\n");
}

}  // namespace imprint
