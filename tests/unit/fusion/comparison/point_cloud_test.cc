#include "fusion/comparison/point_cloud.h"

#include <bit>
#include <cstring>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

std::string fault(const std::string& name, const std::string& text) {
  const TemporaryFolder folder;
  const auto cloud = read_point_cloud(folder.write(name, text));
  return cloud ? std::string() : cloud.error().message;
}

std::string bytes(float value, bool swap) {
  std::string text(4, '\0');
  std::memcpy(text.data(), &value, 4);
  return swap ? std::string(text.rbegin(), text.rend()) : text;
}

const std::string kVertex = "property float x\nproperty float y\nproperty float z\n";

}  // namespace

TEST_CASE("point cloud: PLY in ASCII and in both byte orders is the same cloud, whatever else its vertices carry") {
  const TemporaryFolder folder;
  const auto ascii = read_point_cloud(folder.write(
      "a.ply", "ply\r\nformat ascii 1.0\r\ncomment scan\r\nelement vertex 2\r\nproperty uchar red\r\n" + kVertex +
                   "element face 0\nproperty list uchar int vertex_indices\nend_header\n7 1 2 3\n8 -4.5 5e1 6\n"));
  REQUIRE(ascii);
  for (const bool big : {false, true}) {
    const bool swap = big == (std::endian::native == std::endian::little);
    std::string text = std::string("ply\nformat binary_") + (big ? "big" : "little") +
                       "_endian 1.0\nelement vertex 2\nproperty uchar red\n" + kVertex + "end_header\n";
    for (const float value : {1.0F, 2.0F, 3.0F}) text += (text.ends_with("header\n") ? "r" : "") + bytes(value, swap);
    text += "s";
    for (const float value : {-4.5F, 50.0F, 6.0F}) text += bytes(value, swap);
    const auto binary = read_point_cloud(folder.write(big ? "big.ply" : "little.ply", text));
    REQUIRE(binary);
    CHECK(*binary == *ascii);
  }
  REQUIRE(ascii->size() == 2);
  CHECK((*ascii)[1] == Eigen::Vector3d(-4.5, 50.0, 6.0));
}

TEST_CASE("point cloud: XYZ with a header, comments, commas and more columns; metres by scale; no infinite points") {
  const TemporaryFolder folder;
  const auto cloud =
      read_point_cloud(folder.write("a.xyz", "X Y Z I\n# scan\n1 2 3 200\n0.5,0.25,1\n\nnan 1 2\n"), 1000.0);
  REQUIRE(cloud);
  REQUIRE(cloud->size() == 2);
  CHECK((*cloud)[0] == Eigen::Vector3d(1000.0, 2000.0, 3000.0));
  CHECK((*cloud)[1] == Eigen::Vector3d(500.0, 250.0, 1000.0));
}

TEST_CASE("point cloud: what is cut short, has no vertices or is no cloud is refused with its place") {
  const std::string head = "ply\nformat binary_little_endian 1.0\nelement vertex 2\n" + kVertex + "end_header\n";
  CHECK(fault("a.ply", head + std::string(20, '\0')).find("vertex 2 of 2 is missing") != std::string::npos);
  CHECK(fault("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\n" + kVertex + "end_header\n1 x 3\n")
            .find("vertex 1 of 1") != std::string::npos);
  CHECK(fault("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n").find("x, y and z") !=
        std::string::npos);
  CHECK(fault("a.ply", "ply\nformat ascii 1.0\nelement vertex 99999999999999\n" + kVertex + "end_header\n")
            .find(":3: not a line") != std::string::npos);
  CHECK(fault("a.ply", "solid\n").find("\"ply\"") != std::string::npos);
  CHECK(fault("a.ply", "ply\nformat ascii 1.0\n").find("end_header") != std::string::npos);
  CHECK(fault("a.xyz", "1 2 3\n4 5\n").find("a.xyz:2: expected three numbers") != std::string::npos);
  CHECK(fault("a.e57", "").find("expected a point cloud named") != std::string::npos);
}

}  // namespace imprint
