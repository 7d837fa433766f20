#include <catch2/catch.hpp>

#include <limits>

#include "imprint.pb.h"
#include "lib/wire/wire.h"
#include "tests/unit/lib/wire/sample_imprint.h"

using imprint::decode_imprint;
using imprint::encode_imprint;
using imprint::Imprint;

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Imprint sample(unsigned seed = 1) {
  std::mt19937 random(seed);
  return imprint::test::sample_imprint(random);
}

Imprint there_and_back(const Imprint& sent) {
  const auto received = decode_imprint(encode_imprint(sent));
  INFO((received ? "" : received.error().message));
  REQUIRE(received);
  return *received;
}

std::string refusal(const imprint::v1::Imprint& message) {
  const std::string bytes = message.SerializeAsString();
  const auto received = decode_imprint({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  REQUIRE_FALSE(received);
  CHECK(received.error().kind == imprint::ErrorKind::invalid_input);
  return received.error().message;
}

imprint::v1::Imprint sample_message() {
  const auto bytes = encode_imprint(sample());
  imprint::v1::Imprint message;
  REQUIRE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
  return message;
}

}  // namespace

TEST_CASE("imprint message: every field comes back") {
  const Imprint sent = sample();
  const Imprint got = there_and_back(sent);
  CHECK(got.camera_id == sent.camera_id);
  CHECK(got.session == sent.session);
  CHECK(got.observation == sent.observation);
  CHECK(got.rotation_deg == sent.rotation_deg);
  CHECK(got.boot_id == sent.boot_id);
  CHECK(got.sequence == sent.sequence);
  CHECK(got.sensor_time_ns == sent.sensor_time_ns);
  CHECK(got.focal_length_px == sent.focal_length_px);
  CHECK(got.pose.R_cam_world == sent.pose.R_cam_world);
  CHECK(got.pose.center_world_mm == sent.pose.center_world_mm);
  // Carried as float: relative 6e-8.
  CHECK((got.pose.covariance - sent.pose.covariance).norm() <= 1e-7 * sent.pose.covariance.norm());
  CHECK(got.pose.covariance == got.pose.covariance.transpose());
  CHECK(got.grid.origin.x_px == sent.grid.origin.x_px);
  CHECK(got.grid.origin.y_px == sent.grid.origin.y_px);
  CHECK(got.grid.direction_x == sent.grid.direction_x);
  CHECK(got.grid.direction_y == sent.grid.direction_y);
  CHECK(got.grid.start_px == sent.grid.start_px);
  CHECK(got.grid.step_px == sent.grid.step_px);
  CHECK(got.start.station_px == sent.start.station_px);
  CHECK(got.start.offset_px == sent.start.offset_px);
  CHECK(got.start.sigma_px == Approx(sent.start.sigma_px).epsilon(1e-7));
  CHECK(got.start.visible);
  CHECK(got.end.station_px == sent.end.station_px);
  CHECK_FALSE(got.end.visible);
  CHECK(got.quality.targets_seen == sent.quality.targets_seen);
  CHECK(got.quality.targets_used == sent.quality.targets_used);
  CHECK(got.quality.reprojection_rms_px == Approx(sent.quality.reprojection_rms_px).epsilon(1e-7));
  CHECK(got.quality.edge_points == sent.quality.edge_points);
  CHECK(got.quality.edge_coverage == Approx(sent.quality.edge_coverage).epsilon(1e-7));
  CHECK(got.quality.contrast == Approx(sent.quality.contrast).epsilon(1e-7));
  CHECK(got.quality.saturated_fraction == Approx(sent.quality.saturated_fraction).epsilon(1e-7));
  CHECK(got.quality.frame_saturated_fraction == Approx(sent.quality.frame_saturated_fraction).epsilon(1e-7));
  CHECK(got.quality.body_level == Approx(sent.quality.body_level).epsilon(1e-7));
  CHECK(got.quality.blur_px == Approx(sent.quality.blur_px).epsilon(1e-7));
  CHECK(got.quality.haze_px == Approx(sent.quality.haze_px).epsilon(1e-7));
  CHECK(got.method == sent.method);
  CHECK(got.warnings == sent.warnings);
  CHECK(got.failure.empty());
}

TEST_CASE("imprint message: where the pose comes from goes with it, with curves and without") {
  for (Imprint sent : {sample(), Imprint{}}) {
    sent.camera_id = "cam1";
    if (sent.upper.offset_px.empty()) sent.failure = "no forging";
    sent.pose_state = imprint::PoseState::moved;
    sent.pose_doubtful = true;
    sent.pose_doubtful_since_ns = 1'700'000'000'123'456'789;
    const Imprint got = there_and_back(sent);
    CHECK(got.pose_state == imprint::PoseState::moved);
    CHECK(got.pose_doubtful);
    CHECK(got.pose_doubtful_since_ns == sent.pose_doubtful_since_ns);
  }
}

TEST_CASE("imprint message: a frame without curves carries its reason") {
  Imprint sent;
  sent.camera_id = "cam1";
  sent.failure = "2 targets found, 4 needed";
  const Imprint got = there_and_back(sent);
  CHECK(got.failure == sent.failure);
  CHECK(got.upper.offset_px.empty());
  CHECK(got.axis.weight.empty());
}

TEST_CASE("imprint message: what no receiver could use goes as a failure that says what was wrong") {
  Imprint sent = sample();
  SECTION("pose not finite") {
    sent.pose.center_world_mm.x() = kNan;
    CHECK(there_and_back(sent).failure == "pose: expected a finite centre");
  }
  SECTION("no rotation") {
    sent.pose.R_cam_world *= 1.01;
    CHECK(there_and_back(sent).failure == "pose: expected R_cam_world to be a rotation");
  }
  SECTION("curves of different lengths") {
    sent.lower.offset_px.pop_back();
    CHECK(there_and_back(sent).failure == "curves: expected 500 offsets and weights in each, found 499 and 500");
  }
  SECTION("too many stations") {
    for (auto* curve : {&sent.upper, &sent.lower, &sent.axis}) {
      curve->offset_px.resize(501);
      curve->weight.resize(501);
    }
    CHECK(there_and_back(sent).failure == "curves: expected at most 500 stations, found 501");
  }
  SECTION("direction no unit vector") {
    sent.grid.direction_y = 0.5;
    CHECK(there_and_back(sent).failure.find("grid: expected a unit direction") == 0);
  }
  SECTION("rotation not finite") {
    sent.rotation_deg = kNan;
    CHECK(there_and_back(sent).failure.find("rotation_deg: expected finite values") != std::string::npos);
  }
}

TEST_CASE("imprint message: a point that is no number loses its weight and lies on the curve") {
  Imprint sent = sample();
  sent.upper.offset_px[100] = kNan;
  sent.upper.weight[100] = 0.8;
  sent.upper.offset_px[0] = std::numeric_limits<double>::infinity();
  sent.upper.weight[200] = kNan;
  const Imprint got = there_and_back(sent);
  CHECK(got.upper.weight[100] == 0.0);
  const double middle = (got.upper.offset_px[99] + got.upper.offset_px[101]) / 2.0;
  CHECK(got.upper.offset_px[100] == Approx(middle).margin(0.002));  // half a step
  CHECK(got.upper.weight[0] == 0.0);
  CHECK(got.upper.offset_px[0] == got.upper.offset_px[1]);
  CHECK(got.upper.weight[200] == 0.0);
}

TEST_CASE("imprint message: a small weight stays above 0, and 0 stays 0") {
  Imprint sent = sample();
  sent.axis.weight[7] = 1e-6;
  sent.axis.weight[8] = 0.0;
  const Imprint got = there_and_back(sent);
  CHECK(got.axis.weight[7] > 0.0);
  CHECK(got.axis.weight[8] == 0.0);
}

TEST_CASE("imprint message: numbers of the quality that are none become 0") {
  Imprint sent = sample();
  sent.quality.contrast = kNan;
  sent.quality.reprojection_rms_px = std::numeric_limits<double>::infinity();
  const Imprint got = there_and_back(sent);
  CHECK(got.quality.contrast == 0.0);
  CHECK(got.quality.reprojection_rms_px == 0.0);
}

TEST_CASE("imprint message: long, many-lined and broken texts are cut to valid lines") {
  Imprint sent = sample();
  sent.warnings.assign(50, std::string(5000, 'w'));
  sent.warnings[0] = "two\nlines \xff";
  sent.warnings[1] = std::string(119, 'a') + "\xc3\xa9 after the border";  // e acute across the limit
  const Imprint got = there_and_back(sent);
  REQUIRE(got.warnings.size() == 4);
  CHECK(got.warnings[0] == "two lines ?");
  CHECK(got.warnings[1] == std::string(117, 'a') + "...");
  CHECK(got.warnings[2] == std::string(117, 'w') + "...");
  CHECK(got.warnings[3] == "and 47 more, see the node's log");
}

TEST_CASE("imprint message: fields of a later version are ignored") {
  auto message = sample_message();
  message.set_schema_version(7);
  message.GetReflection()->MutableUnknownFields(&message)->AddLengthDelimited(900, std::string(300, 'n'));
  auto* curve = message.mutable_axis();
  curve->GetReflection()->MutableUnknownFields(curve)->AddVarint(77, 5);
  const std::string bytes = message.SerializeAsString();
  const auto got = decode_imprint({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  REQUIRE(got);
  CHECK(got->axis.offset_px == there_and_back(sample()).axis.offset_px);
}

TEST_CASE("imprint message: a message of the first fields only, from an older writer, decodes") {
  imprint::v1::Imprint message;
  message.set_schema_version(1);
  message.set_camera_id("cam1");
  *message.mutable_pose() = sample_message().pose();
  message.set_failure("no forging");
  const std::string bytes = message.SerializeAsString();
  const auto got = decode_imprint({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()});
  REQUIRE(got);
  CHECK(got->failure == "no forging");
}

TEST_CASE("imprint message: the refusal says what was wrong") {
  auto message = sample_message();
  SECTION("stations") {
    message.mutable_upper()->set_stations(501);
    CHECK(refusal(message) == "imprint of camera 'cam2': upper curve: expected at most 500 stations, found 501");
  }
  SECTION("packing") {
    message.mutable_lower()->set_packing(2);
    CHECK(refusal(message).find("lower curve: expected packing 1, found 2") != std::string::npos);
  }
  SECTION("curves of different lengths") {
    message.clear_axis();
    CHECK(refusal(message).find("curves: expected 500 offsets") != std::string::npos);
  }
  SECTION("offsets too short") {
    message.mutable_axis()->mutable_offsets()->resize(100);
    CHECK(refusal(message).find("axis curve: offsets: ") != std::string::npos);
  }
  SECTION("no bytes for the weights") {
    message.mutable_axis()->clear_weights();
    CHECK(refusal(message).find("axis curve: weights: expected 500 values, found 0 bytes") != std::string::npos);
  }
  SECTION("offset step") {
    message.mutable_axis()->set_offset_step_px(kNan);
    CHECK(refusal(message).find("expected a positive offset step") != std::string::npos);
  }
  SECTION("weights above their levels") {
    message.mutable_axis()->set_weight_levels(1);
    CHECK(refusal(message).find("axis curve: weight ") != std::string::npos);
  }
  SECTION("no rotation") {
    message.mutable_pose()->set_r_cam_world(4, 2.0);
    CHECK(refusal(message).find("expected R_cam_world to be a rotation") != std::string::npos);
  }
  SECTION("pose missing") {
    message.clear_pose();
    CHECK(refusal(message).find("pose: expected 9 + 3 + 21 values, found 0 + 0 + 0") != std::string::npos);
  }
  SECTION("camera") {
    message.set_camera_id("cam/2");
    CHECK(refusal(message).find("camera id: expected") != std::string::npos);
  }
  SECTION("neither curves nor a reason") {
    message.clear_upper();
    message.clear_lower();
    message.clear_axis();
    CHECK(refusal(message).find("expected three curves or a reason") != std::string::npos);
  }
  SECTION("no schema version") {
    message.clear_schema_version();
    CHECK(refusal(message) == "imprint: expected schema_version 1 or more, found none");
  }
}

TEST_CASE("imprint message: no bytes and too many bytes are refused") {
  CHECK_FALSE(decode_imprint({}));
  const std::vector<std::uint8_t> many(1 << 20, 0x0a);
  const auto got = decode_imprint(many);
  REQUIRE_FALSE(got);
  CHECK(got.error().message == "imprint: expected at most 65536 bytes, found 1048576");
}
