#include "lib/targets/code_distance.h"

#include <catch2/catch.hpp>

using namespace imprint;

TEST_CASE("code distance: turning a code does not change its ring") {
  for (int k = 0; k <= 15; ++k) {
    const std::uint32_t turned = rotated(0b000010110011101, 15, k);
    CHECK(smallest_rotation(turned, 15) == smallest_rotation(0b000010110011101, 15));
    CHECK(cyclic_distance(turned, 0b000010110011101, 15) == 0);
  }
  CHECK(rotated(0b100000000000000, 15, 1) == 1);
}

TEST_CASE("code distance: it counts the bits that differ at the best rotation") {
  CHECK(cyclic_distance(0b00000001, 0b00010000, 8) == 0);
  CHECK(cyclic_distance(0b00000001, 0b00010100, 8) == 1);
  CHECK(cyclic_distance(0b00000000, 0b11111111, 8) == 8);
}

TEST_CASE("code distance: transitions are counted round the closed ring") {
  CHECK(bit_transitions(0b00000000, 8) == 0);
  CHECK(bit_transitions(0b11110000, 8) == 2);
  CHECK(bit_transitions(0b01010101, 8) == 8);
}

TEST_CASE("code distance: a mirrored ring is another ring unless it is symmetric") {
  CHECK(cyclic_distance(0b00001011, 0b11010000, 8) > 0);
}
