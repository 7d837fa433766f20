#include "lib/targets/library_generator.h"

#include <catch2/catch.hpp>

#include "lib/targets/code_distance.h"

using namespace imprint;

TEST_CASE("library generator: the full library has as many rings as the necklace formula says") {
  // [A] table 1.
  CHECK(full_library(8).size() == 36);
  CHECK(full_library(11).size() == 188);
  CHECK(full_library(15).size() == 2192);
  CHECK(full_library(16).size() == 4116);
}

TEST_CASE("library generator: 60 codes of 15 bits reach distance 4 and 6 transitions, one more than greedy choice") {
  const auto generated = generate_library(15, 60);
  REQUIRE(generated);
  const auto& codes = generated->library.codes;
  REQUIRE(codes.size() == 60);
  CHECK(generated->library.min_distance >= 4);
  CHECK(smallest_distance(codes, 15) == generated->library.min_distance);  // as stated, by definition (3)
  for (const auto& code : codes) CHECK(bit_transitions(code.code, 15) >= 6);
  for (std::size_t i = 0; i < codes.size(); ++i) CHECK(codes[i].id == static_cast<int>(i) + 1);
}

TEST_CASE("library generator: the same request always gives the same library") {
  const auto a = generate_library(10, 12);
  const auto b = generate_library(10, 12);
  REQUIRE(a);
  REQUIRE(b);
  for (std::size_t i = 0; i < 12; ++i) CHECK(a->library.codes[i].code == b->library.codes[i].code);
}

TEST_CASE("library generator: all the rings there are can be had, one more is an error that names the number") {
  const auto all = generate_library(8, 36);
  REQUIRE(all);
  CHECK(all->library.min_distance == 1);
  const auto more = generate_library(8, 37);
  REQUIRE_FALSE(more);
  CHECK(more.error().exit_status() == 2);
  CHECK(more.error().message.find("36") != std::string::npos);
}

TEST_CASE("library generator: bits and count out of range are errors") {
  CHECK_FALSE(generate_library(7, 5));
  CHECK_FALSE(generate_library(21, 5));
  CHECK_FALSE(generate_library(15, 0));
}
