#include "lib/camera/camera_model.h"

#include <random>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "lib/camera/camera_file.h"
#include "tests/unit/paper_camera.h"
#include "tests/unit/temporary_folder.h"

using namespace imprint;
using Catch::Matchers::Contains;

namespace {

CameraModel strong_camera() {  // ten times the distortion of [B] table 3
  CameraModel camera = paper_camera();
  camera.distortion.radial = {-6.3e-2, 5.2e-3, 1.3e-4};
  camera.distortion.tangential = {-8.5e-4, 6.5e-4};
  camera.distortion.affine = {1.2e-3, 1.2e-3};
  return camera;
}

}  // namespace

TEST_CASE("camera: distortion follows the contract's formula, written out") {
  const CameraModel camera = strong_camera();
  const auto& d = camera.distortion;
  const double n = 1760.0, u = 0.4, v = -0.7, r2 = u * u + v * v, q = d.r0 * d.r0;
  const double radial =
      d.radial[0] * (r2 - q) + d.radial[1] * (r2 * r2 - q * q) + d.radial[2] * (r2 * r2 * r2 - q * q * q);
  const double du =
      u * radial + d.tangential[0] * (r2 + 2 * u * u) + 2 * d.tangential[1] * u * v + d.affine[0] * u + d.affine[1] * v;
  const double dv = v * radial + d.tangential[1] * (r2 + 2 * v * v) + 2 * d.tangential[0] * u * v;
  const ObservedPoint p = distort(camera, {n * u, n * v});
  CHECK(p.x_px == Approx(2367.8 + n * (u + du)).epsilon(1e-14));
  CHECK(p.y_px == Approx(1736.88 + n * (v + dv)).epsilon(1e-14));
}

TEST_CASE("camera: undistort inverts distort over the whole image and beyond") {
  const CameraModel camera = strong_camera();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> x(-2600, 2600), y(-2000, 2000);
  for (int i = 0; i < 1000; ++i) {
    const IdealPoint p{x(random), y(random)};
    const IdealPoint back = undistort(camera, distort(camera, p));
    CHECK(std::hypot(back.x_px - p.x_px, back.y_px - p.y_px) < 1e-9);  // Newton to rounding
  }
}

TEST_CASE("camera: the distortion's Jacobian agrees with differences") {
  const CameraModel camera = strong_camera();
  const IdealPoint p{900.0, -1300.0};
  const Eigen::Matrix2d j = distortion_jacobian(camera, p);
  const double h = 1e-3;
  for (int axis = 0; axis < 2; ++axis) {
    IdealPoint a = p, b = p;
    (axis == 0 ? a.x_px : a.y_px) -= h;
    (axis == 0 ? b.x_px : b.y_px) += h;
    const ObservedPoint pa = distort(camera, a), pb = distort(camera, b);
    CHECK(j(0, axis) == Approx((pb.x_px - pa.x_px) / (2 * h)).margin(1e-8));
    CHECK(j(1, axis) == Approx((pb.y_px - pa.y_px) / (2 * h)).margin(1e-8));
  }
}

TEST_CASE("camera file: what was written is read back exactly") {
  TemporaryFolder folder;
  CameraModel camera = strong_camera();
  camera.focal_length_px = 5722.790000000001;
  REQUIRE(write_camera_file(camera, folder / "cam1.toml"));
  const auto back = read_camera_file(folder / "cam1.toml");
  REQUIRE(back);
  CHECK(back->id == "cam1");
  CHECK(back->focal_length_px == camera.focal_length_px);
  CHECK(back->principal_point.x_px == camera.principal_point.x_px);
  CHECK(back->distortion.radial == camera.distortion.radial);
  CHECK(back->distortion.tangential == camera.distortion.tangential);
  CHECK(back->distortion.affine == camera.distortion.affine);
}

TEST_CASE("camera file: impossible values are refused with their key") {
  TemporaryFolder folder;
  const std::string good =
      "[camera]\nid = \"c\"\nwidth_px = 100\nheight_px = 80\npixel_pitch_um = 3.8\n"
      "focal_length_px = 500.0\nprincipal_point_px = [50, 40]\n";
  REQUIRE(read_camera_file(folder.write("good.toml", good)));
  const auto refused = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    text.replace(text.find(from), from.size(), to);
    const auto camera = read_camera_file(folder.write("bad.toml", text));
    REQUIRE(!camera);
    CHECK(camera.error().exit_status() == 2);
    return camera.error().message;
  };
  CHECK_THAT(refused("width_px = 100", "width_px = 0"), Contains("bad.toml:3") && Contains("camera.width_px"));
  CHECK_THAT(refused("width_px = 100", "width_px = 99999999999"), Contains("camera.width_px"));
  CHECK_THAT(refused("focal_length_px = 500.0", "focal_length_px = -1"), Contains("camera.focal_length_px"));
  CHECK_THAT(refused("[50, 40]", "[50]"), Contains("camera.principal_point_px"));
  CHECK_THAT(refused("id = \"c\"", "id = \"a/b\""), Contains("camera.id"));
}
