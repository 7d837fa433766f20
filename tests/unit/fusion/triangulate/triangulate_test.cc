#include "fusion/triangulate/triangulate.h"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "fusion/triangulate/end_planes.h"
#include "fusion/triangulate/triangulate_config.h"
#include "tests/unit/fusion/triangulate/forging_views.h"

namespace imprint::test {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A round bar bent by 8 mm, and what the forge's three cameras and a fourth see of it, exactly.
struct BentBar {
  Rod rod;
  Lying lying;
  std::vector<Imprint> imprints;

  BentBar() {
    rod.axis = [](double x) { return Eigen::Vector2d(8.0 * std::sin(M_PI * x / 1900.0), 0.0); };
    for (const Pinhole& camera : forge_cameras()) imprints.push_back(view_rod(rod, lying, camera));
    imprints.push_back(view_rod(rod, lying, pinhole("cam4", 95.0, 8000.0, 500.0)));
  }
  [[nodiscard]] Eigen::Vector3d end_world(double x) const {
    return lying.R * Eigen::Vector3d(x, rod.axis(x).x(), rod.axis(x).y()) + lying.origin_mm;
  }
};

const BentBar& bar() {
  static const BentBar made;
  return made;
}

std::vector<Imprint> three() { return {bar().imprints[0], bar().imprints[1], bar().imprints[2]}; }

Result<ObservedForging> triangulate_all(const std::vector<Imprint>& imprints, const ForgingSpec& spec = forge_spec()) {
  return triangulate(imprints, spec, TriangulateConfig{});
}

double length_of(const ObservedForging& observed) { return (observed.end_world_mm - observed.start_world_mm).norm(); }

double axis_error(const ObservedForging& observed) {
  double worst = 0.0;
  for (const ObservedSection& section : observed.sections) {
    const double x = (bar().lying.R.transpose() * (section.axis_world_mm - bar().lying.origin_mm)).x();
    const Eigen::Vector3d truth = bar().end_world(std::clamp(x, 0.0, bar().rod.length_mm));
    worst = std::max(worst, (section.axis_world_mm - truth).tail<2>().norm());
  }
  return worst;
}

/// The forge's first camera with its pose moved, as if its targets had been misread.
Imprint misplaced(Imprint imprint, const Eigen::Vector3d& shift_mm, double turn_deg) {
  imprint.pose.center_world_mm += shift_mm;
  imprint.pose.R_cam_world = rotation_from_vector({0.0, turn_deg * M_PI / 180.0, 0.0}) * imprint.pose.R_cam_world;
  return imprint;
}

}  // namespace

TEST_CASE("triangulate: exact views of a bent bar give its ends to 0.1 mm and its axis to 0.3 mm") {
  const auto observed = triangulate_all(three());
  REQUIRE(observed.has_value());
  CHECK(observed->warnings.empty());
  CHECK(observed->sections.size() == 500);
  // The near arc of an end circle bulges by up to 13 mm beyond the end: what is left is the axis' smoothing.
  CHECK(std::abs(length_of(*observed) - 1900.0) < 0.1);
  CHECK((observed->start_world_mm - bar().end_world(0.0)).norm() < 0.3);
  CHECK((observed->end_world_mm - bar().end_world(1900.0)).norm() < 0.3);
  // The middle of the rims alone is off by millimetres here; the window of 41 sections flattens the bow by 0.1 mm.
  CHECK(axis_error(*observed) < 0.3);
  CHECK(observed->radius_mm == Approx(130.0).margin(0.05));
}

TEST_CASE("triangulate: every tangent touches the bar it came from") {
  const auto observed = triangulate_all(three());
  REQUIRE(observed.has_value());
  std::size_t count = 0;
  double worst = 0.0;
  for (const ObservedSection& section : observed->sections) {
    for (const TangentPlane& tangent : section.tangents) {
      const double x =
          (bar().lying.R.transpose() *
           (observed->start_world_mm + tangent.s_mm * (observed->end_world_mm - observed->start_world_mm).normalized() -
            bar().lying.origin_mm))
              .x();
      const Eigen::Vector3d axis = bar().end_world(std::clamp(x, 0.0, 1900.0));
      worst = std::max(worst, std::abs(tangent.offset_mm - tangent.normal_world.dot(axis) - 130.0));
      ++count;
    }
  }
  CHECK(count > 2800);  // six rims of 500 stations, less those on the end arcs
  CHECK(worst < 0.3);   // as the axis: the slope of its smoothed curve is least sure at the ends
}

TEST_CASE("triangulate: a forging that lies the other way round has the same first end along axis_direction") {
  Lying lying = bar().lying;
  lying.R = Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal();
  lying.origin_mm = Eigen::Vector3d(950.0, 30.0, 800.0);
  std::vector<Imprint> imprints;
  for (const Pinhole& camera : forge_cameras()) imprints.push_back(view_rod(bar().rod, lying, camera));
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(observed->start_world_mm.x() < observed->end_world_mm.x());
  ForgingSpec against = forge_spec();
  against.axis_direction_world = -Eigen::Vector3d::UnitX();
  const auto reversed = triangulate_all(imprints, against);
  REQUIRE(reversed.has_value());
  CHECK(reversed->start_world_mm.x() > reversed->end_world_mm.x());
}

TEST_CASE("triangulate: one camera is an error that says so") {
  const auto observed = triangulate_all({bar().imprints[0]});
  REQUIRE_FALSE(observed.has_value());
  CHECK(observed.error().kind == ErrorKind::job_failed);
  CHECK(observed.error().message.find("at least 2") != std::string::npos);
  CHECK_FALSE(triangulate_all({}).has_value());
}

TEST_CASE("triangulate: two cameras are enough") {
  const auto observed = triangulate_all({bar().imprints[0], bar().imprints[1]});
  REQUIRE(observed.has_value());
  CHECK(std::abs(length_of(*observed) - 1900.0) < 0.2);
  CHECK(axis_error(*observed) < 0.5);
}

TEST_CASE("triangulate: two cameras that look in nearly the same direction are refused by name") {
  const std::vector<Imprint> imprints{view_rod(bar().rod, bar().lying, pinhole("left", 50.0, 7400.0)),
                                      view_rod(bar().rod, bar().lying, pinhole("right", 58.0, 7400.0))};
  const auto observed = triangulate_all(imprints);
  REQUIRE_FALSE(observed.has_value());
  CHECK(observed.error().kind == ErrorKind::job_failed);
  CHECK(observed.error().message.find("left, right") != std::string::npos);
}

TEST_CASE("triangulate: a camera with a failure is left out with that reason") {
  std::vector<Imprint> imprints = three();
  imprints[1].failure = "no forging found";
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(observed->cameras[1].excluded);
  CHECK(observed->cameras[1].reason == "no forging found");
  REQUIRE(observed->warnings.size() == 1);
  CHECK(observed->warnings[0].find("cam2") != std::string::npos);
}

TEST_CASE("triangulate: imprints that make no sense are left out with a reason, never a crash") {
  const std::vector<std::function<void(Imprint&)>> faults{
      [](Imprint& i) { i.upper.weight.assign(kImprintStations, 0.0); },
      [](Imprint& i) { i.lower.offset_px.assign(kImprintStations, kNan); },
      [](Imprint& i) { i.upper.weight.assign(kImprintStations, kNan); },
      [](Imprint& i) { i.upper.offset_px.resize(12); },
      [](Imprint& i) { i.axis.weight.clear(); },
      [](Imprint& i) { i.focal_length_px = 0.0; },
      [](Imprint& i) { i.focal_length_px = kNan; },
      [](Imprint& i) { i.pose.R_cam_world.setZero(); },
      [](Imprint& i) { i.pose.center_world_mm.x() = kInfinity; },
      [](Imprint& i) { i.grid.step_px = 0.0; },
      [](Imprint& i) { i.grid.direction_x = i.grid.direction_y = 0.0; },
      [](Imprint& i) { i.camera_id = "cam2"; },
  };
  for (std::size_t f = 0; f < faults.size(); ++f) {
    std::vector<Imprint> imprints = three();
    faults[f](imprints[2]);
    const auto observed = triangulate_all(imprints);
    INFO("fault " << f);
    REQUIRE(observed.has_value());
    CHECK(observed->cameras[2].excluded);
    CHECK_FALSE(observed->cameras[2].reason.empty());
    CHECK(std::abs(length_of(*observed) - 1900.0) < 0.2);
  }
}

TEST_CASE("triangulate: imprints that are valid but wild end in a value or an error") {
  const std::vector<std::function<void(Imprint&)>> faults{
      // The camera on the axis; far away; behind the rod; rims swapped; rims on one line; wild ends; bad covariance.
      [](Imprint& i) { i.pose.center_world_mm = bar().end_world(900.0); },
      [](Imprint& i) { i.pose.center_world_mm *= 1e9; },
      [](Imprint& i) { i.pose.R_cam_world = Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal() * i.pose.R_cam_world; },
      [](Imprint& i) { std::swap(i.upper, i.lower); },
      [](Imprint& i) { i.lower = i.upper; },
      [](Imprint& i) { i.start.station_px = 1e7; },
      [](Imprint& i) { i.end.station_px = kNan; },
      [](Imprint& i) { i.start.sigma_px = -1.0; },
      [](Imprint& i) { i.pose.covariance.setConstant(kNan); },
      [](Imprint& i) { i.pose.covariance = -Matrix6d::Identity(); },
      [](Imprint& i) { i.upper.offset_px[100] = 1e300; },
      [](Imprint& i) { i.axis.weight.assign(kImprintStations, 0.0); },
  };
  for (std::size_t f = 0; f < faults.size(); ++f) {
    for (const std::size_t camera : {std::size_t{0}, std::size_t{2}}) {
      std::vector<Imprint> imprints = three();
      faults[f](imprints[camera]);
      const auto observed = triangulate_all(imprints);
      INFO("fault " << f << " of camera " << camera);
      if (!observed) {
        CHECK_FALSE(observed.error().message.empty());
        continue;
      }
      CHECK(std::isfinite(length_of(*observed)));
      CHECK(observed->radius_mm > 0.0);
    }
  }
}

TEST_CASE("triangulate: of four cameras, the one whose pose is 60 mm off is named and left out") {
  for (std::size_t wrong = 0; wrong < 4; ++wrong) {
    std::vector<Imprint> imprints = bar().imprints;
    imprints[wrong] = misplaced(imprints[wrong], {0.0, 0.0, 60.0}, 0.0);
    if (wrong == 3) imprints[wrong] = misplaced(bar().imprints[wrong], {0.0, 60.0, 0.0}, 0.0);
    const auto observed = triangulate_all(imprints);
    INFO("camera " << wrong);
    REQUIRE(observed.has_value());
    for (std::size_t c = 0; c < 4; ++c) CHECK(observed->cameras[c].excluded == (c == wrong));
    CHECK(std::abs(length_of(*observed) - 1900.0) < 0.2);
  }
}

TEST_CASE("triangulate: of three cameras, one shifted along and across the forging is told by the ends it sees") {
  std::vector<Imprint> imprints = three();
  imprints[1] = misplaced(imprints[1], {80.0, 40.0, 40.0}, 0.0);
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(observed->cameras[1].excluded);
  CHECK(observed->cameras[1].reason.find("cam1, cam3") != std::string::npos);
}

TEST_CASE("triangulate: three cameras that contradict each other with nothing to tell which are kept with a warning") {
  std::vector<Imprint> imprints = three();
  // Across its own view: the other two still agree, but so does each pair.
  const Eigen::Vector3d across = imprints[0].pose.R_cam_world.row(1);
  imprints[0] = misplaced(imprints[0], 40.0 * across, 0.0);
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(observed->disagreement_sigma_mm > 10.0);
  REQUIRE_FALSE(observed->warnings.empty());
  CHECK(observed->warnings[0].find("contradict") != std::string::npos);
}

TEST_CASE("triangulate: an end that some cameras do not see is taken from the others") {
  std::vector<Imprint> imprints = three();
  imprints[0].start.visible = false;
  imprints[1].end.visible = false;
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(observed->warnings.empty());
  CHECK(std::abs(length_of(*observed) - 1900.0) < 0.5);
}

TEST_CASE("triangulate: an end that no camera sees is where the rims stop, with a warning") {
  std::vector<Imprint> imprints = three();
  // Stations run against the axis in cam1 and cam3, along it in cam2 on the other side.
  for (Imprint& imprint : imprints) (imprint.camera_id == "cam2" ? imprint.end : imprint.start).visible = false;
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  REQUIRE(observed->warnings.size() >= 1);
  CHECK(std::abs(length_of(*observed) - 1900.0) < 30.0);  // the end arcs reach up to 13 mm beyond
  CHECK(observed->length_sigma_mm > 1.0);
}

TEST_CASE("triangulate: one end misread by 40 mm in one of three cameras moves the length by less than 1 mm") {
  std::vector<Imprint> imprints = three();
  imprints[1].end.station_px -= 30.0;
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(std::abs(length_of(*observed) - 1900.0) < 1.0);
}

TEST_CASE("triangulate: of two readings of an end the one that other rims run past is not believed, nor doubt left") {
  std::vector<Imprint> imprints = three();
  imprints[0].start.visible = false;
  imprints[2].start.station_px += 200.0;  // 250 mm inside, as where scale covers the end
  const auto observed = triangulate_all(imprints);
  REQUIRE(observed.has_value());
  CHECK(std::abs(length_of(*observed) - 1900.0) < 1.0);
  CHECK(observed->length_sigma_mm < 3.0);
  REQUIRE(observed->warnings.size() == 1);
  CHECK(observed->warnings[0].find("cam3") != std::string::npos);
  CHECK(observed->warnings[0].find("inside where the rims stop") != std::string::npos);
}

TEST_CASE("triangulate: a wrong config is refused by its key") {
  TriangulateConfig config;
  CHECK(config.validate().has_value());
  config.edge_sigma_px = 0.0;
  REQUIRE_FALSE(config.validate().has_value());
  CHECK(config.validate().error().message.find("edge_sigma_px") != std::string::npos);
}

TEST_CASE("end_planes: three readings on one side of a tilted face still give its middle") {
  // A face tilted by 0.3 deg, read at 3, 50 and 130 deg around it as the forge's cameras do.
  const Eigen::Vector2d tilt(0.004, -0.003);
  std::vector<EndPoint> points;
  for (const double angle : {3.0, 50.0, 130.0}) {
    const Eigen::Vector2d beside =
        130.0 * Eigen::Vector2d(std::cos(angle * M_PI / 180.0), std::sin(angle * M_PI / 180.0));
    points.push_back({.last = true, .x_mm = 1900.0 + tilt.dot(beside), .beside_mm = beside, .sigma_mm = 0.05});
    points.push_back({.last = false, .x_mm = 0.0, .beside_mm = beside, .sigma_mm = 0.05});
  }
  const EndPlanes planes = fit_end_planes(points, 1, EndPriors{});
  CHECK(planes.last.x_mm == Approx(1900.0).margin(0.05));
  CHECK(planes.first.x_mm == Approx(0.0).margin(0.01));
}

}  // namespace imprint::test
