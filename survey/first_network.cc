#include "survey/first_network.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <Eigen/Geometry>

#include "node/resect/start_pose.h"
#include "survey/bundle.h"
#include "survey/intersect_rays.h"
#include "survey/relative_orientation.h"

namespace imprint {
namespace {

constexpr int kLensNeeds = 4;  // photographs before the lens is let free
constexpr int kWholeLensNeeds = 10;
constexpr int kTries = 3;

struct Pair {
  std::size_t first = 0, second = 0;
  int common = 0;
  double merit = 0.0;
};

// Grows one network from one starting pair.
class Growth {
 public:
  Growth(const CameraModel& camera, std::size_t photos, const std::vector<Sight>& sights,
         const FirstNetworkConfig& config)
      : config_(config), sights_(sights), by_photo_(photos), tries_(photos, 0) {
    network_.camera = camera;
    network_.poses.resize(photos);
    for (std::size_t i = 0; i < sights.size(); ++i) by_photo_[sights[i].photo].push_back(i);
  }

  [[nodiscard]] std::vector<Pair> pairs() const {
    std::vector<Pair> result;
    for (std::size_t i = 0; i < by_photo_.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        const auto rays = ray_pairs(j, i);
        if (static_cast<int>(rays.size()) < config_.min_common) continue;
        const double parallax = parallax_rad(rays);
        constexpr double kWide = 0.35;  // rad; beyond it a pair gains nothing
        result.push_back(
            {j, i, static_cast<int>(rays.size()), static_cast<double>(rays.size()) * std::min(parallax, kWide)});
      }
    }
    std::stable_sort(result.begin(), result.end(), [](const Pair& a, const Pair& b) { return a.merit > b.merit; });
    return result;
  }

  // The pair's relative poses, those that fit best first.
  [[nodiscard]] std::vector<Network> start(const Pair& pair) const {
    const auto poses = relative_poses(ray_pairs(pair.first, pair.second), rough());
    std::vector<std::pair<double, Network>> starts;
    for (const CameraPose& pose : poses) {
      Growth trial = *this;
      trial.network_.poses[pair.first] = CameraPose{};
      trial.network_.poses[pair.second] = pose;
      trial.intersect();
      if (static_cast<int>(trial.network_.points.size()) < std::max(5, pair.common / 2)) continue;
      if (!trial.adjust(FreeInterior::none)) continue;
      starts.emplace_back(trial.cost(), std::move(trial.network_));
    }
    std::stable_sort(starts.begin(), starts.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<Network> result;
    std::vector<double> costs;
    for (auto& [cost, network] : starts) {
      const bool known = std::any_of(result.begin(), result.end(), [&](const Network& other) {
        return (other.poses[pair.second]->R_cam_world - network.poses[pair.second]->R_cam_world).norm() < 0.02;
      });
      if (!known && result.size() < 3) result.push_back(std::move(network));
    }
    return result;
  }

  // As far as it goes.
  void grow(Network from) {
    network_ = std::move(from);
    while (add_photos()) {
      intersect();
      if (!adjust(freedom())) return;
      drop_misfits();
      intersect();
    }
    for (int round = 0; round < 2; ++round) {
      if (!adjust(freedom())) return;
      lens_known_ = network_.posed() >= kWholeLensNeeds || round > 0;
      drop_misfits();
      intersect();
      while (add_photos()) {
        intersect();
        if (!adjust(freedom())) return;
      }
    }
  }

  [[nodiscard]] int held() const {
    return static_cast<int>(
        std::count_if(sights_.begin(), sights_.end(), [&](const Sight& sight) { return network_.holds(sight); }));
  }

  [[nodiscard]] int fitting() const {
    return static_cast<int>(std::count_if(sights_.begin(), sights_.end(), [&](const Sight& sight) {
      return network_.holds(sight) && sight.residual_px.norm() < config_.fine_px;
    }));
  }

  Network network_;

 private:
  [[nodiscard]] double tolerance_px() const {
    return lens_known_ ? config_.fine_px : config_.rough_share * network_.camera.normalizer_px();
  }
  [[nodiscard]] double rough() const { return tolerance_px() / network_.camera.focal_length_px; }

  [[nodiscard]] FreeInterior freedom() const {
    const int posed = network_.posed();
    return posed >= kWholeLensNeeds ? FreeInterior::all
           : posed >= kLensNeeds    ? FreeInterior::focal_and_radial
                                    : FreeInterior::none;
  }

  [[nodiscard]] Eigen::Vector2d direction(const Sight& sight) const {
    const IdealPoint p = undistort(network_.camera, sight.at);
    return Eigen::Vector2d(p.x_px, p.y_px) / network_.camera.focal_length_px;
  }

  [[nodiscard]] std::vector<RayPair> ray_pairs(std::size_t first, std::size_t second) const {
    std::vector<RayPair> result;
    auto a = by_photo_[first].begin(), b = by_photo_[second].begin();  // both by ascending id
    while (a != by_photo_[first].end() && b != by_photo_[second].end()) {
      if (sights_[*a].id == sights_[*b].id)
        result.push_back({direction(sights_[*a++]), direction(sights_[*b++])});
      else if (sights_[*a].id < sights_[*b].id)
        ++a;
      else
        ++b;
    }
    return result;
  }

  // All targets that two or more posed photographs see from far enough apart.
  void intersect() {
    std::map<int, std::vector<RayWorld>> rays;
    for (const Sight& sight : sights_) {
      const auto& pose = network_.poses[sight.photo];
      if (!pose || network_.points.count(sight.id) > 0) continue;
      rays[sight.id].push_back(
          {pose->center_world_mm, (pose->R_cam_world.transpose() * direction(sight).homogeneous()).normalized()});
    }
    for (const auto& [id, of_target] : rays) {
      const auto point = intersect_rays(of_target, rough(), config_.min_angle_deg * std::numbers::pi / 180.0);
      if (point) network_.points[id] = point->p_world_mm;
    }
  }

  // Resects the photographs that see most of what is known; false when none could be added.
  bool add_photos() {
    std::vector<std::pair<std::size_t, std::vector<Correspondence>>> candidates;
    for (std::size_t photo = 0; photo < by_photo_.size(); ++photo) {
      if (network_.poses[photo] || tries_[photo] >= kTries) continue;
      std::vector<Correspondence> known;
      for (const std::size_t i : by_photo_[photo])
        if (const auto point = network_.points.find(sights_[i].id); point != network_.points.end())
          known.push_back({direction(sights_[i]), point->second});
      candidates.emplace_back(photo, std::move(known));
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const auto& a, const auto& b) { return a.second.size() > b.second.size(); });
    // Few at a time: what they add is adjusted before the next build upon it.
    const int most = std::max(2, network_.posed() / 2);
    int added = 0;
    for (const auto& [photo, known] : candidates) {
      if (added == most || known.size() < 4) break;
      const int wanted = std::max(4, static_cast<int>(std::ceil(0.6 * static_cast<double>(known.size()))));
      if (const auto pose = start_pose(known, rough(), wanted)) {
        network_.poses[photo] = *pose;
        ++tries_[photo];
        ++added;
      }
    }
    return added > 0;
  }

  bool adjust(FreeInterior interior) {
    const double cauchy_px = lens_known_ ? 0.5 : 0.2 * tolerance_px();
    return adjust_network(network_, sights_, {}, {interior, cauchy_px, 50}).has_value();
  }

  // Targets on which no two sights agree, and photographs most of whose sights disagree, are tried again later.
  void drop_misfits() {
    std::map<int, int> of_target;
    std::vector<int> fit(by_photo_.size(), 0), seen(by_photo_.size(), 0);
    for (const Sight& sight : sights_) {
      if (!network_.holds(sight)) continue;
      const bool fits = sight.residual_px.norm() < tolerance_px();
      of_target[sight.id] += fits ? 1 : 0;
      fit[sight.photo] += fits ? 1 : 0;
      ++seen[sight.photo];
    }
    for (const auto& [id, count] : of_target)
      if (count < 2) network_.points.erase(id);
    for (std::size_t i = 0; i < by_photo_.size(); ++i)
      if (network_.poses[i] && network_.posed() > 2 && (fit[i] < 4 || 2 * fit[i] < seen[i])) network_.poses[i].reset();
  }

  [[nodiscard]] double cost() const {
    double sum = 0.0;
    int count = 0;
    for (const Sight& sight : sights_) {
      if (!network_.holds(sight)) continue;
      sum += std::log1p(sight.residual_px.squaredNorm());
      ++count;
    }
    return count > 0 ? sum / count : 1e30;
  }

  const FirstNetworkConfig& config_;
  std::vector<Sight> sights_;
  std::vector<std::vector<std::size_t>> by_photo_;
  std::vector<int> tries_;  // how often a photograph was put in; some fall out again
  bool lens_known_ = false;
};

// Focal lengths to try, of the longer side: from a wide lens to a long one where nothing is known.
std::vector<double> focal_factors(bool known) {
  if (known) return {1.0};
  return {1.0, 0.78, 1.3, 0.62, 1.7, 2.3};
}

}  // namespace

std::vector<Sight> sights_of(const std::vector<SurveyPhoto>& photos, double noise_floor_px) {
  std::vector<Sight> sights;
  for (std::size_t i = 0; i < photos.size(); ++i) {
    std::set<int> ids;
    for (const DetectedTarget& target : photos[i].targets) ids.insert(target.id);
    for (const int id : ids) {
      const auto target = std::find_if(photos[i].targets.begin(), photos[i].targets.end(),
                                       [id](const DetectedTarget& t) { return t.id == id; });
      Sight sight;
      sight.photo = i;
      sight.id = id;
      sight.at = target->center;
      sight.sigma_px = std::hypot(target->sigma_px, noise_floor_px);
      sight.dot_diameter_px = target->dot_diameter_px;
      sights.push_back(sight);
    }
  }
  return sights;
}

Result<Network> first_network(const CameraModel& camera, bool focal_known, std::size_t photos,
                              const std::vector<Sight>& sights, const FirstNetworkConfig& config) {
  Network best;
  int most = 0, convincing = 0, idle = 0;  // idle: attempts in a row that brought nothing
  CameraModel known = camera;
  for (int attempt = 0; attempt < config.pairs_to_try; ++attempt) {
    const int before = most;
    for (const double factor : focal_factors(focal_known)) {
      CameraModel trial = known;
      trial.focal_length_px *= factor;
      const Growth seed(trial, photos, sights, config);
      const auto pairs = seed.pairs();
      if (attempt >= static_cast<int>(pairs.size())) continue;
      for (Network& start : seed.start(pairs[static_cast<std::size_t>(attempt)])) {
        Growth growth(trial, photos, sights, config);
        growth.grow(std::move(start));
        const int fitting = growth.fitting();
        // Most of the photographs in one network whose sights agree: if some stay out, it is not for the start.
        const bool whole =
            2 * growth.network_.posed() >= static_cast<int>(photos) && fitting >= config.settled_share * growth.held();
        if (fitting > most) {
          most = fitting;
          best = std::move(growth.network_);
        }
        if (most >= config.settled_share * static_cast<double>(sights.size()) || (whole && ++convincing == 2))
          return best;
        if (whole) break;
      }
      if (convincing > 0 && !focal_known) {
        known.focal_length_px = best.camera.focal_length_px;
        focal_known = true;
        break;
      }
    }
    idle = most > before + static_cast<int>(sights.size()) / 50 ? 0 : idle + 1;
    if (idle == 2 && 2 * best.posed() >= static_cast<int>(photos)) return best;
  }
  if (best.posed() < 2 || best.points.size() < 5)
    return job_failed(
        "survey: no two photographs show {} common targets from places apart enough to start from; take photographs "
        "that overlap by half and more",
        config.min_common);
  return best;
}

}  // namespace imprint
