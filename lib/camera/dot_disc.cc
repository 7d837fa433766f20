#include "lib/camera/dot_disc.h"

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>

#include <fmt/core.h>
#include <Eigen/Geometry>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr const char* kHeader = "id,diameter_mm,nx,ny,nz";

// A number up to the next comma or the line's end; false when there is none.
template <class Number>
bool take(std::string_view& rest, Number& value) {
  const std::size_t end = rest.find(',');
  const std::string_view cell = rest.substr(0, end);
  const auto [stop, fault] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  return fault == std::errc{} && stop == cell.data() + cell.size();
}

}  // namespace

ObservedPoint eccentricity_px(const CameraModel& camera, const CameraPose& pose, const Eigen::Vector3d& p_world,
                              const DotDisc& disc) {
  constexpr int kCorners = 64;  // of a polygon on the outline; its centroid is the ellipse's, affinely
  const Eigen::Vector3d side = disc.normal.unitOrthogonal(), up = disc.normal.cross(side);
  const auto seen = [&](const Eigen::Vector3d& p) {
    const ObservedPoint at = project(camera, pose.cam_from_world(p));
    return Eigen::Vector2d(at.x_px, at.y_px);
  };
  const Eigen::Vector2d centre = seen(p_world);
  const auto corner = [&](int i) {
    const double a = 2.0 * std::numbers::pi * i / kCorners;
    return Eigen::Vector2d(seen(p_world + disc.radius * (std::cos(a) * side + std::sin(a) * up)) - centre);
  };
  double area = 0.0;
  Eigen::Vector2d moment = Eigen::Vector2d::Zero(), from = corner(0);
  for (int i = 1; i <= kCorners; ++i) {
    const Eigen::Vector2d to = corner(i % kCorners);
    const double cross = from.x() * to.y() - from.y() * to.x();
    area += 0.5 * cross;
    moment += cross * (from + to) / 6.0;
    from = to;
  }
  if (!(std::abs(area) > 1e-9)) return {};
  return {moment.x() / area, moment.y() / area};
}

Result<DotDiscs> read_dot_discs(const std::filesystem::path& path) {
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  std::istringstream stream(*text);
  DotDiscs dots;
  int number = 0;
  for (std::string line; std::getline(stream, line);) {
    ++number;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (number == 1) {
      if (line != kHeader)
        return invalid_input("{}:1: expected the header {}, found \"{}\"", path.string(), kHeader, line);
      continue;
    }
    if (line.empty()) continue;
    std::string_view rest = line;
    int id = 0;
    double diameter_mm = 0.0;
    DotDisc disc;
    const bool read = take(rest, id) && take(rest, diameter_mm) && take(rest, disc.normal.x()) &&
                      take(rest, disc.normal.y()) && take(rest, disc.normal.z()) && rest.empty();
    if (!read || !(diameter_mm > 0.0) || !std::isfinite(diameter_mm) || !(std::abs(disc.normal.norm() - 1.0) < 0.01))
      return invalid_input("{}:{}: expected an id, a diameter above 0 and a normal of length 1, found \"{}\"",
                           path.string(), number, line);
    disc.radius = 0.5 * diameter_mm;
    disc.normal.normalize();
    if (!dots.emplace(id, disc).second)
      return invalid_input("{}:{}: target id {} stands there twice", path.string(), number, id);
  }
  if (dots.empty())
    return invalid_input("{}: expected the header {} and a row a target, found none", path.string(), kHeader);
  return dots;
}

Result<void> write_dot_discs(const DotDiscs& dots, const std::filesystem::path& path) {
  std::string text = fmt::format("{}\n", kHeader);
  for (const auto& [id, disc] : dots)
    text += fmt::format("{},{:.4f},{:.6f},{:.6f},{:.6f}\n", id, 2.0 * disc.radius, disc.normal.x(), disc.normal.y(),
                        disc.normal.z());
  return write_file_atomically(path, text);
}

}  // namespace imprint
