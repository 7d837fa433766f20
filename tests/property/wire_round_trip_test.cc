#include <catch2/catch.hpp>

#include <algorithm>
#include <string>

#include "lib/wire/bit_packing.h"
#include "lib/wire/wire.h"
#include "tests/unit/lib/wire/sample_imprint.h"

using namespace imprint;

namespace {

constexpr double kFinestStep = 1.0 / 256.0;

struct Worst {
  double offset_px = 0.0;
  double weight = 0.0;
};

void compare(const ImprintCurve& sent, const ImprintCurve& got, Worst& worst) {
  REQUIRE(got.offset_px.size() == sent.offset_px.size());
  REQUIRE(got.weight.size() == sent.weight.size());
  for (std::size_t i = 0; i < sent.offset_px.size(); ++i) {
    REQUIRE(std::isfinite(got.offset_px[i]));
    REQUIRE((got.weight[i] > 0.0) == (sent.weight[i] > 0.0));
    if (sent.weight[i] > 0.0)
      worst.offset_px = std::max(worst.offset_px, std::abs(got.offset_px[i] - sent.offset_px[i]));
    worst.weight = std::max(worst.weight, std::abs(got.weight[i] - sent.weight[i]));
  }
}

struct Trip {
  std::size_t bytes;
  Worst worst;
  Imprint got;
};

Trip round_trip(const Imprint& sent) {
  const auto bytes = encode_imprint(sent);
  auto got = decode_imprint(bytes);
  INFO((got ? "" : got.error().message));
  REQUIRE(got);
  Trip trip{bytes.size(), {}, std::move(*got)};
  compare(sent.upper, trip.got.upper, trip.worst);
  compare(sent.lower, trip.got.lower, trip.worst);
  compare(sent.axis, trip.got.axis, trip.worst);
  return trip;
}

void judge_valid(const Imprint& imprint) {
  REQUIRE(imprint.pose.R_cam_world.allFinite());
  REQUIRE(imprint.upper.offset_px.size() <= kImprintStations);
  REQUIRE(imprint.upper.offset_px.size() == imprint.axis.offset_px.size());
  for (const auto* curve : {&imprint.upper, &imprint.lower, &imprint.axis}) {
    for (const double offset_px : curve->offset_px) REQUIRE(std::isfinite(offset_px));
    for (const double weight : curve->weight) REQUIRE((weight >= 0.0 && weight <= 1.0));
  }
}

}  // namespace

// The limits of the contract: 4,096 bytes, 0.002 px. Noise is per station, after the node's filter: real
// curves have a few hundredths of a pixel, raw ones a few tenths.
TEST_CASE("wire: noisy and stepped curves keep both limits, whatever the seed") {
  struct Row {
    const char* name;
    test::CurveShape shape;
    double weight_tolerance;  // half a step of the weights that must still fit
  };
  const Row rows[] = {
      {"smooth, filtered", {0.02, 25.0, 0, 0.0, false}, 0.5 / 255},
      {"steps, filtered", {0.05, 25.0, 8, 0.05, false}, 0.5 / 255},
      {"raw", {0.3, 25.0, 8, 0.05, false}, 0.5 / 255},
      {"raw, random weights", {0.3, 25.0, 8, 0.05, true}, 0.5 / 63},
      {"rough, random weights", {1.0, 25.0, 20, 0.2, true}, 0.5 / 15},
      {"very rough, random weights", {5.0, 25.0, 60, 0.0, true}, 0.5 / 3},
      {"hardly curves, random weights", {60.0, 0.0, 0, 0.0, true}, 1.0},
  };
  for (const auto& row : rows) {
    std::size_t largest = 0;
    Worst worst;
    for (unsigned seed = 0; seed < 20; ++seed) {
      std::mt19937 random(seed);
      const Trip trip = round_trip(test::sample_imprint(random, row.shape));
      largest = std::max(largest, trip.bytes);
      worst.offset_px = std::max(worst.offset_px, trip.worst.offset_px);
      worst.weight = std::max(worst.weight, trip.worst.weight);
    }
    WARN(row.name << ": at most " << largest << " bytes, offsets to " << worst.offset_px << " px, weights to "
                  << worst.weight);
    CHECK(largest <= kMaxImprintBytes);
    CHECK(worst.offset_px <= 0.002);
    CHECK(worst.weight <= row.weight_tolerance + 1e-12);
  }
}

TEST_CASE("wire: no curve whatever goes over the limit, and a coarser step is told") {
  std::size_t largest = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::mt19937 random(seed);
    Imprint sent = test::sample_imprint(random);
    const double range_px = std::pow(10.0, 2 + seed % 4);  // 100 px (an image row) to 100,000 px (nonsense)
    std::uniform_real_distribution<double> anywhere(-range_px, range_px);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (auto* curve : {&sent.upper, &sent.lower, &sent.axis}) {
      for (auto& offset_px : curve->offset_px) offset_px = anywhere(random);
      for (auto& weight : curve->weight) weight = unit(random);
    }
    sent.warnings.assign(20, std::string(500, 'w'));
    sent.camera_id = std::string(64, 'c');
    sent.session = std::string(64, 's');
    sent.method = std::string(100, 'm');
    const Trip trip = round_trip(sent);
    largest = std::max(largest, trip.bytes);
    const bool coarse = trip.got.warnings.front().find("curves too rough") == 0;
    INFO("range " << range_px << " px, worst " << trip.worst.offset_px << " px");
    CHECK(coarse == (trip.worst.offset_px > kFinestStep / 2));
  }
  WARN("pure noise with the longest texts: at most " << largest << " bytes");
  CHECK(largest <= kMaxImprintBytes);
}

TEST_CASE("wire: any number of stations up to 500 comes back") {
  for (const std::size_t stations : {1U, 2U, 24U, 25U, 26U, 499U, 500U}) {
    std::mt19937 random(static_cast<unsigned>(stations));
    CHECK(round_trip(test::sample_imprint(random, {}, stations)).worst.offset_px <= kFinestStep / 2);
  }
}

TEST_CASE("wire: untrusted points stay near when they do not fit") {
  std::mt19937 random(5);
  Imprint sent = test::sample_imprint(random, {0.2, 25.0, 0, 0.0, true});
  std::uniform_real_distribution<double> anywhere(-90000.0, 90000.0);
  for (auto* curve : {&sent.upper, &sent.lower, &sent.axis})
    for (std::size_t i = 0; i < kImprintStations; i += 2) {
      curve->offset_px[i] = anywhere(random);
      curve->weight[i] = 0.0;
    }
  const Trip trip = round_trip(sent);
  CHECK(trip.bytes <= kMaxImprintBytes);
  CHECK(trip.worst.offset_px <= 0.002);
  for (std::size_t i = 2; i + 1 < kImprintStations; i += 2) {
    const double between = (trip.got.axis.offset_px[i - 1] + trip.got.axis.offset_px[i + 1]) / 2.0;
    REQUIRE(std::abs(trip.got.axis.offset_px[i] - between) <= 2.0 * kFinestStep);  // rounding of three points
  }
}

TEST_CASE("wire: an imprint cut anywhere is refused or still valid") {
  std::mt19937 random(3);
  const auto bytes = encode_imprint(test::sample_imprint(random));
  for (std::size_t length = 0; length < bytes.size(); ++length)
    if (const auto got = decode_imprint(std::span(bytes).first(length))) judge_valid(*got);
}

TEST_CASE("wire: flipped bits never crash and never give an impossible imprint") {
  std::mt19937 random(4);
  const auto bytes = encode_imprint(test::sample_imprint(random));
  int refused = 0;
  for (int i = 0; i < 4000; ++i) {
    auto damaged = bytes;
    const auto flips = 1 + random() % 3;
    for (unsigned flip = 0; flip < flips; ++flip)
      damaged[random() % damaged.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
    const auto got = decode_imprint(damaged);
    if (got)
      judge_valid(*got);
    else
      ++refused;
  }
  CHECK(refused > 0);
  CHECK(refused < 4000);
}

TEST_CASE("wire: bytes that never were an imprint are refused or valid") {
  std::mt19937 random(6);
  for (int i = 0; i < 3000; ++i) {
    std::vector<std::uint8_t> bytes(random() % 200);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    if (const auto got = decode_imprint(bytes)) judge_valid(*got);
  }
}

TEST_CASE("packing: any integers come back, and cut bytes are refused") {
  std::mt19937 random(7);
  for (int i = 0; i < 200; ++i) {
    std::vector<std::int32_t> values(1 + random() % 60);
    const int width = static_cast<int>(random() % 29);
    for (auto& value : values) value = static_cast<std::int32_t>(random() % (1U << width)) - (1 << width) / 2;
    const auto base = static_cast<std::int32_t>(random() % 1000) - 500;
    const std::string bytes = pack_values(values, base);
    const auto got = unpack_values(bytes, values.size(), base);
    REQUIRE(got);
    REQUIRE(*got == values);
    // Plain bits would take width bits a value; the code, at its worst, one more and 7 a block.
    CHECK(8 * bytes.size() <=
          values.size() * (static_cast<std::size_t>(width) + 4) + 7 * (values.size() / 25 + 1) + 60);
    REQUIRE_FALSE(unpack_values(std::string_view(bytes).substr(0, bytes.size() - 1), values.size(), base));
  }
}

TEST_CASE("packing: the example of the schema") {
  // Order 2, k = 0, residuals 0 2 0 0, folded 0 4 0 0: 10 00000 1 00101 1 1 and one bit to fill.
  const std::string bytes = pack_values(std::vector<std::int32_t>{3, 5, 7, 9}, 3);
  CHECK(bytes == "\x81\x2e");
  CHECK(unpack_values(bytes, 4, 3).value() == std::vector<std::int32_t>{3, 5, 7, 9});
}
