#include "node/detect/examined_places.h"

#include <algorithm>
#include <cmath>

#include "node/detect/looks.h"

namespace imprint {
namespace {

std::pair<int, int> cell_of(const Eigen::Vector2d& p) {
  constexpr double cell_px = 32.0;
  return {static_cast<int>(std::floor(p.x() / cell_px)), static_cast<int>(std::floor(p.y() / cell_px))};
}

bool sees_as_well(int known, int asked) {
  return known == asked || (asked >= plain_rank && known <= asked && known >= plain_rank);
}

bool are_alike(const Ellipse& a, const Ellipse& b) {
  constexpr double near = 0.2;      // radii
  constexpr double similar = 0.15;  // share of the diameter
  const double diameter = mean_diameter(b);
  return a.radius_of(b.center) < near && std::abs(mean_diameter(a) - diameter) < similar * diameter;
}

}  // namespace

bool ExaminedPlaces::has_like(const Ellipse& ellipse, int rank) const {
  const auto [x, y] = cell_of(ellipse.center);
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const auto cell = cells_.find({x + dx, y + dy});
      if (cell == cells_.end()) continue;
      const bool known = std::any_of(cell->second.begin(), cell->second.end(), [&](const Place& place) {
        return sees_as_well(place.rank, rank) && are_alike(place.ellipse, ellipse);
      });
      if (known) return true;
    }
  }
  return false;
}

void ExaminedPlaces::add(const Ellipse& ellipse, int rank) {
  cells_[cell_of(ellipse.center)].push_back({ellipse, rank});
}

}  // namespace imprint
