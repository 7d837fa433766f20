#include <catch2/catch.hpp>

#include "lib/wire/keys.h"

using imprint::check_id;
using imprint::Keys;

TEST_CASE("keys: those of the contract") {
  const auto keys = Keys::of("ostrava", "line-1");
  REQUIRE(keys);
  CHECK(keys->imprint("cam1") == "imprint/ostrava/line-1/v1/cam/cam1/imprint");
  CHECK(keys->health("cam1") == "imprint/ostrava/line-1/v1/cam/cam1/health");
  CHECK(keys->alive("cam1") == "imprint/ostrava/line-1/v1/cam/cam1/alive");
  CHECK(keys->service("cam1", "crop") == "imprint/ostrava/line-1/v1/cam/cam1/service/crop");
  CHECK(keys->trigger() == "imprint/ostrava/line-1/v1/trigger");
  CHECK(keys->result("heat-7") == "imprint/ostrava/line-1/v1/result/heat-7");
}

TEST_CASE("keys: their wildcard forms") {
  const auto keys = Keys::of("s", "l");
  REQUIRE(keys);
  CHECK(keys->imprint() == "imprint/s/l/v1/cam/*/imprint");
  CHECK(keys->health() == "imprint/s/l/v1/cam/*/health");
  CHECK(keys->alive() == "imprint/s/l/v1/cam/*/alive");
  CHECK(keys->service() == "imprint/s/l/v1/cam/*/service/*");
  CHECK(keys->service("cam1") == "imprint/s/l/v1/cam/cam1/service/*");
  CHECK(keys->result() == "imprint/s/l/v1/result/*");
  CHECK(keys->everything() == "imprint/s/l/v1/**");
}

TEST_CASE("keys: the camera is read back from a key of the line, and only from one") {
  const auto keys = Keys::of("s", "l");
  REQUIRE(keys);
  CHECK(keys->camera_of(keys->alive("cam7")) == "cam7");
  CHECK(keys->camera_of(keys->service("cam7", "log")) == "cam7");
  CHECK_FALSE(keys->camera_of(keys->trigger()));
  CHECK_FALSE(keys->camera_of("imprint/s/other/v1/cam/cam7/alive"));
  CHECK_FALSE(keys->camera_of("imprint/s/l/v1/cam/*/alive"));
  CHECK_FALSE(keys->camera_of("imprint/s/l/v1/cam/cam7"));
}

TEST_CASE("keys: an id that would not be one chunk is refused with its name") {
  for (const char* id : {"", "a/b", "*", "a*", "a b", "#", "?x", "$", "@adv", "..", ".hidden", "-x", "č"}) {
    INFO(id);
    CHECK_FALSE(check_id("camera", id));
  }
  CHECK_FALSE(check_id("camera", std::string(65, 'a')));
  CHECK(check_id("camera", std::string(64, 'a')));
  CHECK(check_id("camera", "Cam_1.left-A"));
  CHECK(Keys::of("a/b", "l").error().message ==
        "site id: expected 1 to 64 of A-Z a-z 0-9 . _ -, not beginning with '.' or '-', found 'a/b'");
  CHECK_FALSE(Keys::of("s", ""));
}
