#include "lib/targets/library_generator.h"

#include <algorithm>
#include <string>

#include <catch2/catch.hpp>

#include "lib/targets/code_distance.h"

using namespace imprint;

namespace {

std::string digits_of(std::uint32_t code, int bits) {
  std::string digits;
  for (int bit = bits - 1; bit >= 0; --bit) digits += (code >> bit & 1U) != 0 ? '1' : '0';
  return digits;
}

/// [A] equation 3 by the letter, on strings of digits: independent of how the generator counts.
int distance_by_definition(const std::string& a, std::string b) {
  int smallest = static_cast<int>(a.size());
  for (std::size_t turn = 0; turn < a.size(); ++turn) {
    int differing = 0;
    for (std::size_t i = 0; i < a.size(); ++i) differing += a[i] != b[i] ? 1 : 0;
    smallest = std::min(smallest, differing);
    std::rotate(b.begin(), b.begin() + 1, b.end());
  }
  return smallest;
}

int changes_by_definition(const std::string& ring) {
  int changes = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) changes += ring[i] != ring[(i + 1) % ring.size()] ? 1 : 0;
  return changes;
}

/// The library has the codes, distance and transitions that it should, by definition, and says so.
void check_reached(int bits, int count, int distance, int transitions) {
  const auto generated = generate_library(bits, count);
  REQUIRE(generated);
  REQUIRE(static_cast<int>(generated->library.codes.size()) == count);
  std::vector<std::string> rings;
  for (const TargetCode& code : generated->library.codes) rings.push_back(digits_of(code.code, bits));
  int least_distance = bits;
  int least_changes = bits;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    CHECK(generated->library.codes[i].id == static_cast<int>(i) + 1);
    least_changes = std::min(least_changes, changes_by_definition(rings[i]));
    for (std::size_t j = 0; j < i; ++j) {
      least_distance = std::min(least_distance, distance_by_definition(rings[i], rings[j]));
    }
  }
  CHECK(least_distance >= distance);
  CHECK(least_changes >= transitions);
  CHECK(generated->library.min_distance == least_distance);
  CHECK(generated->least_transitions == least_changes);
}

}  // namespace

TEST_CASE("library generator: the full library has as many rings as the necklace formula says") {
  // [A] table 1.
  CHECK(full_library(8).size() == 36);
  CHECK(full_library(11).size() == 188);
  CHECK(full_library(15).size() == 2192);
  CHECK(full_library(16).size() == 4116);
}

TEST_CASE("library generator: 60 codes of 15 bits reach distance 4 and 6 transitions, one more than greedy choice") {
  check_reached(15, 60, 4, 6);
}

TEST_CASE("library generator: 128 codes of 15 bits reach distance 3") { check_reached(15, 128, 3, 6); }

TEST_CASE("library generator: 10 codes of 8 bits reach distance 2 and 4 transitions") { check_reached(8, 10, 2, 4); }

TEST_CASE("library generator: the same request always gives the same library") {
  const auto a = generate_library(9, 12);
  const auto b = generate_library(9, 12);
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
