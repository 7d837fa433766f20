#include "survey/survey.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <fmt/ranges.h>
#include <Eigen/Geometry>

#include "lib/geometry/median.h"
#include "node/resect/start_pose.h"
#include "survey/eccentricity.h"
#include "survey/one_camera.h"

namespace imprint {
namespace {

constexpr double kDegPerRad = 180.0 / std::numbers::pi;
constexpr int kPhotoNeeds = 4;          // sights of a photograph that stays
constexpr double kBarFloor_ppm = 50.0;  // of its length: what centres, refraction and a bar's mounting add (ours)

// "a, b, c and 4 more"
template <class Items>
std::string some_of(const Items& items) {
  constexpr std::size_t kNamed = 6;
  std::vector<std::string> names;
  for (const auto& item : items) {
    if (names.size() == kNamed) break;
    names.push_back(fmt::format("{}", item));
  }
  const std::string text = fmt::format("{}", fmt::join(names, ", "));
  return items.size() > kNamed ? fmt::format("{} and {} more", text, items.size() - kNamed) : text;
}

class Surveyor {
 public:
  Surveyor(const SurveyInput& input, const SurveyConfig& config)
      : input_(input), config_(config), sights_(sights_of(input.photos, config.noise_floor_px)) {}

  Result<Survey> run() {
    if (auto started = start(); !started) return pass_on(started.error());
    if (auto one = check_one_camera(); !one) return pass_on(one.error());
    if (auto settled = settle(); !settled) return pass_on(settled.error());
    if (auto focal = check_focal_length(); !focal) return pass_on(focal.error());
    if (config_.correct_eccentricity) {
      correct_eccentricity(network_, sights_);
      if (auto settled = settle(); !settled) return pass_on(settled.error());
      correct_eccentricity(network_, sights_);
      if (auto adjusted = adjust({}); !adjusted) return pass_on(adjusted.error());
    }
    if (auto connected = check_connected(); !connected) return pass_on(connected.error());
    if (auto scaled = scale(); !scaled) return pass_on(scaled.error());
    if (auto placed = place(); !placed) return pass_on(placed.error());
    describe();
    return std::move(survey_);
  }

 private:
  Result<void> start() {
    CameraModel camera = input_.camera;
    const bool focal_known = camera.focal_length_px > 0.0;
    if (!focal_known) camera.focal_length_px = std::max(camera.width_px, camera.height_px);
    auto first = first_network(camera, focal_known, input_.photos.size(), sights_, config_.start);
    if (!first) return pass_on(first.error());
    network_ = std::move(*first);
    return adjust_network(network_, sights_, {}, {FreeInterior::all, 0.5, 200});
  }

  Result<void> adjust(const std::vector<ScaleBar>& bars) {
    return adjust_network(network_, sights_, bars, {FreeInterior::all, 0.0, 200});
  }

  // Least squares over what fits, until it is the same sights.
  Result<void> settle() {
    for (int round = 0; round < 8 && choose(); ++round) {
      if (network_.posed() < 2 || network_.points.size() < 5)
        return job_failed(
            "survey: only {} photographs and {} targets agree with each other; are the photographs of one camera at "
            "one "
            "focus, and did the targets stay in place?",
            network_.posed(), network_.points.size());
      if (auto adjusted = adjust({}); !adjusted) return adjusted;
    }
    return {};
  }

  // Which sights fit; whether that has changed.
  bool choose() {
    std::vector<double> sizes;
    for (const Sight& s : sights_) {
      if (!network_.holds(s) || !s.used) continue;
      for (const double r : {s.residual_px.x(), s.residual_px.y()}) sizes.push_back(std::abs(r) / s.sigma_px);
    }
    if (sizes.empty()) return false;
    const double sigmas = 1.4826 * median(sizes) * config_.reject_sigmas;
    bool changed = !chosen_;
    chosen_ = true;
    for (Sight& s : sights_) {
      const bool used =
          network_.holds(s) && s.residual_px.norm() < std::max(config_.reject_floor_px, sigmas * s.sigma_px);
      changed |= used != s.used;
      s.used = used;
    }
    return drop_undetermined() || changed;
  }

  // Photographs and targets that the sights left do not determine.
  bool drop_undetermined() {
    bool dropped = false;
    for (bool again = true; again;) {
      again = false;
      std::map<int, std::vector<Eigen::Vector3d>> directions;
      std::vector<int> of_photo(network_.poses.size(), 0);
      for (const Sight& s : sights_) {
        if (!s.used || !network_.holds(s)) continue;
        ++of_photo[s.photo];
        directions[s.id].push_back((network_.points.at(s.id) - network_.poses[s.photo]->center_world_mm).normalized());
      }
      for (std::size_t i = 0; i < of_photo.size(); ++i) {
        if (!network_.poses[i] || of_photo[i] >= kPhotoNeeds) continue;
        network_.poses[i].reset();
        again = true;
      }
      again = std::erase_if(
                  network_.points,
                  [&](const auto& point) { return widest_angle(directions[point.first]) < 1.0 / kDegPerRad; }) > 0 ||
              again;
      for (Sight& s : sights_) s.used = s.used && network_.holds(s);
      dropped = dropped || again;
    }
    return dropped;
  }

  static double widest_angle(const std::vector<Eigen::Vector3d>& directions) {
    double widest = 0.0;
    for (std::size_t i = 0; i < directions.size(); ++i)
      for (std::size_t j = 0; j < i; ++j)
        widest =
            std::max(widest, std::atan2(directions[i].cross(directions[j]).norm(), directions[i].dot(directions[j])));
    return widest;
  }

  [[nodiscard]] std::vector<std::string> names_of(const std::vector<std::size_t>& photos) const {
    std::vector<std::string> names;
    for (const std::size_t i : photos) names.push_back(input_.photos[i].name);
    return names;
  }

  // The network with the photographs that did not fit put where they fit best: they may be of another camera.
  [[nodiscard]] Network with_misfits() const {
    Network all = network_;
    const double f = all.camera.focal_length_px;
    for (std::size_t photo = 0; photo < all.poses.size(); ++photo) {
      if (all.poses[photo]) continue;
      std::vector<Correspondence> known;
      for (const Sight& s : sights_) {
        if (s.photo != photo || all.points.count(s.id) == 0) continue;
        const IdealPoint p = undistort(all.camera, s.at);
        known.push_back({{p.x_px / f, p.y_px / f}, all.points.at(s.id)});
      }
      const int wanted = std::max(6, static_cast<int>(known.size()) / 2);
      all.poses[photo] = start_pose(known, config_.start.rough_share * all.camera.normalizer_px() / f, wanted);
    }
    return all;
  }

  Result<void> check_one_camera() const {
    const auto others = other_camera(focal_deviations(with_misfits(), sights_), config_.max_focal_spread);
    if (others.empty()) return {};
    return invalid_input(
        "survey: {} photographs ({}) show another focal length than the other {}: they are of another camera, or the "
        "focus or zoom was changed; survey with the photographs of one camera at one focus",
        others.size(), some_of(names_of(others)), input_.photos.size() - others.size());
  }

  Result<void> check_focal_length() const {
    const double stated = input_.camera.focal_length_px, found = network_.camera.focal_length_px;
    if (!(stated > 0.0) || std::abs(found / stated - 1.0) <= config_.max_focal_difference) return {};
    return invalid_input(
        "survey: found a focal length of {:.1f} px, but {:.1f} px were stated; check --focal-length-mm and "
        "--pixel-pitch-um, or leave both out",
        found, stated);
  }

  // What is left out, and whether a part of the field goes with it.
  Result<void> check_connected() {
    std::vector<std::size_t> photos;
    for (std::size_t i = 0; i < network_.poses.size(); ++i)
      if (!network_.poses[i]) photos.push_back(i);
    std::map<int, std::set<std::size_t>> left_out;  // targets, and the photographs outside that show them
    for (const Sight& s : sights_)
      if (!network_.poses[s.photo] && network_.points.count(s.id) == 0) left_out[s.id].insert(s.photo);
    std::vector<int> island;
    std::set<std::size_t> of_island;
    for (const auto& [id, seen] : left_out) {
      if (seen.size() < 2) continue;
      island.push_back(id);
      of_island.insert(seen.begin(), seen.end());
    }
    if (island.size() >= 2) {
      const std::vector<std::size_t> named(of_island.begin(), of_island.end());
      return job_failed(
          "survey: {} photographs ({}) are not connected with the other {}: fewer than {} targets are common to both; "
          "targets {} are only in them; take photographs that show targets of both parts",
          named.size(), some_of(names_of(named)), network_.posed(), kPhotoNeeds, some_of(island));
    }
    for (const std::size_t i : photos)
      survey_.warnings.push_back(
          fmt::format("{}: left out: {} targets found in it, {} needed that agree with the other photographs",
                      input_.photos[i].name, input_.photos[i].targets.size(), kPhotoNeeds));
    return {};
  }

  // Sigmas as the residuals show them, then the scale by the bars.
  Result<void> scale() {
    const auto free = network_precision(network_, sights_, {});
    if (!free) return pass_on(free.error());
    survey_.sigma_scale = std::sqrt(free->weighted_squares / free->redundancy);
    for (Sight& s : sights_) s.sigma_px *= survey_.sigma_scale;
    const double variance = survey_.sigma_scale * survey_.sigma_scale;

    double weights = 0.0, sum = 0.0;
    std::vector<double> scales, sigmas;  // of the bars seen: the scale by each, and its relative sigma
    for (const ScaleBar& bar : input_.bars) {
      SurveyBar described{bar, 0.0, 0.0, false};
      if (network_.points.count(bar.id_a) > 0 && network_.points.count(bar.id_b) > 0) {
        const double distance = (network_.points[bar.id_a] - network_.points[bar.id_b]).norm();
        const double of_photos = std::sqrt(variance * free->distance_variance(network_, bar.id_a, bar.id_b)) / distance;
        described.seen = true;
        described.measured_sigma_mm = of_photos * bar.length_mm;
        scales.push_back(bar.length_mm / distance);
        sigmas.push_back(
            std::hypot(of_photos, bar.sigma_mm / bar.length_mm, 1e-6 * kBarFloor_ppm / config_.bar_sigmas));
        weights += 1.0 / (sigmas.back() * sigmas.back());
        sum += scales.back() / (sigmas.back() * sigmas.back());
        used_bars_.push_back(bar);
      } else {
        survey_.warnings.push_back(
            fmt::format("the scale bar from {} to {} is not seen with both ends", bar.id_a, bar.id_b));
      }
      survey_.bars.push_back(described);
    }
    if (used_bars_.empty()) {
      std::vector<std::string> names;
      for (const ScaleBar& bar : input_.bars) names.push_back(fmt::format("{} to {}", bar.id_a, bar.id_b));
      return job_failed("survey: no scale bar is seen with both ends ({}); take photographs of them from several sides",
                        some_of(names));
    }
    if (auto agree = check_bars(scales, sigmas); !agree) return agree;
    scale_network(network_, sum / weights);
    return adjust(used_bars_);
  }

  // Each bar against the mean of the others.
  Result<void> check_bars(const std::vector<double>& scales, const std::vector<double>& sigmas) const {
    std::size_t worst = 0;
    double furthest = 0.0, share = 0.0;
    for (std::size_t i = 0; i < scales.size() && scales.size() > 1; ++i) {
      double weights = 0.0, sum = 0.0;
      for (std::size_t k = 0; k < scales.size(); ++k) {
        if (k == i) continue;
        weights += 1.0 / (sigmas[k] * sigmas[k]);
        sum += scales[k] / (sigmas[k] * sigmas[k]);
      }
      const double others = sum / weights;
      const double off = scales[i] / others - 1.0;
      const double certain = std::abs(off) / std::sqrt(sigmas[i] * sigmas[i] + 1.0 / weights);
      if (certain > furthest) furthest = certain, worst = i, share = off;
    }
    if (furthest <= config_.bar_sigmas) return {};
    const ScaleBar& bar = used_bars_[worst];
    if (used_bars_.size() == 2) {
      const ScaleBar& other = used_bars_[1 - worst];
      return job_failed(
          "survey: the two scale bars disagree: by the bar from {} to {} that from {} to {} is {:.3f} mm long, stated "
          "are {:.3f} mm; check the ids and lengths, or add a third bar to tell which is wrong",
          other.id_a, other.id_b, bar.id_a, bar.id_b, bar.length_mm / (1.0 + share), bar.length_mm);
    }
    return job_failed(
        "survey: the scale bar from {} to {} disagrees with the other {}: by them it is {:.3f} mm long, stated are "
        "{:.3f} mm; check its ids and length or leave it out",
        bar.id_a, bar.id_b, used_bars_.size() - 1, bar.length_mm / (1.0 + share), bar.length_mm);
  }

  Result<void> place() {
    std::vector<Eigen::Vector3d> cameras;
    for (const auto& pose : network_.poses)
      if (pose) cameras.push_back(pose->center_world_mm);
    auto datum = choose_datum(network_.points, cameras, input_.datum);
    if (!datum) return pass_on(datum.error());
    move_network(network_, datum->R, datum->origin);
    survey_.datum = std::move(*datum);
    auto precision = network_precision(network_, sights_, used_bars_);
    if (!precision) return pass_on(precision.error());
    precision_ = std::move(*precision);
    return {};
  }

  void describe() {
    survey_.camera = network_.camera;
    survey_.interior_covariance = precision_.interior;
    survey_.poses = network_.poses;
    describe_targets();
    for (SurveyBar& bar : survey_.bars)
      if (bar.seen) bar.measured_mm = (network_.points.at(bar.bar.id_a) - network_.points.at(bar.bar.id_b)).norm();
    double squares = 0.0;
    for (const Sight& s : sights_) {
      if (s.used) {
        squares += s.residual_px.squaredNorm();
        ++survey_.observations;
      } else if (network_.holds(s)) {
        survey_.rejected.push_back({s.photo, s.id, s.residual_px.norm()});
      }
    }
    survey_.reprojection_rms_px = std::sqrt(squares / std::max(1, survey_.observations));
    const auto rejected = static_cast<double>(survey_.rejected.size());
    if (rejected > 0.2 * (rejected + survey_.observations))
      survey_.warnings.push_back(fmt::format(
          "{} of {} sights were left out: check the photographs for blur, and the targets for having been moved",
          survey_.rejected.size(), survey_.rejected.size() + static_cast<std::size_t>(survey_.observations)));
    survey_.dots = find_dot_discs(network_, sights_);
    survey_.sights = std::move(sights_);
  }

  void describe_targets() {
    std::map<int, std::vector<Eigen::Vector3d>> directions;
    std::set<int> seen;
    for (const Sight& s : sights_) {
      seen.insert(s.id);
      if (s.used)
        directions[s.id].push_back((network_.points.at(s.id) - network_.poses[s.photo]->center_world_mm).normalized());
    }
    std::vector<double> sigmas;
    for (const auto& [id, p] : network_.points) {
      SurveyTarget& target = survey_.targets[id];
      target.p_world_mm = p;
      target.covariance = precision_.of_point(id);
      target.rays = static_cast<int>(directions[id].size());
      target.angle_deg = widest_angle(directions[id]) * kDegPerRad;
      sigmas.push_back(target.sigma_mm());
    }
    const double usual = median(sigmas);
    for (auto& [id, target] : survey_.targets) {
      if (target.rays < config_.min_rays) {
        target.needs = fmt::format("{} rays fit, at least {} wanted", target.rays, config_.min_rays);
      } else if (target.angle_deg < config_.min_angle_deg) {
        target.needs = fmt::format("its rays meet at {:.0f} deg at most, at least {:.0f} wanted", target.angle_deg,
                                   config_.min_angle_deg);
      } else if (target.sigma_mm() > config_.max_sigma_ratio * usual) {
        target.needs = fmt::format("its sigma of {:.3f} mm is {:.1f} times the median", target.sigma_mm(),
                                   target.sigma_mm() / usual);
      }
    }
    for (const int id : seen)
      if (network_.points.count(id) == 0) survey_.seen_once.push_back(id);
  }

  const SurveyInput& input_;
  const SurveyConfig& config_;
  std::vector<Sight> sights_;
  Network network_;
  std::vector<ScaleBar> used_bars_;
  NetworkPrecision precision_;
  Survey survey_;
  bool chosen_ = false;
};

}  // namespace

Result<void> SurveyConfig::validate() const {
  if (!(noise_floor_px > 0.0) || !(reject_sigmas > 0.0) || !(reject_floor_px >= 0.0) || !(bar_sigmas > 0.0))
    return invalid_input(
        "survey: noise_floor_px, reject_sigmas and bar_sigmas above 0 expected, reject_floor_px at least 0");
  if (!(max_focal_spread > 0.0) || !(max_focal_difference > 0.0) || !(max_sigma_ratio > 0.0) || min_rays < 2)
    return invalid_input("survey: shares and ratios above 0 and min_rays of at least 2 expected");
  return {};
}

double SurveyTarget::sigma_mm() const { return std::sqrt(covariance.trace() / 3.0); }

TargetField Survey::field() const {
  TargetField result;
  for (const auto& [id, target] : targets) result.targets[id] = {target.p_world_mm, target.sigma_mm()};
  return result;
}

Result<Survey> survey_field(const SurveyInput& input, const SurveyConfig& config) {
  if (auto valid = config.validate(); !valid) return pass_on(valid.error());
  if (input.photos.size() < 3)
    return invalid_input("survey: expected at least 3 photographs, found {}", input.photos.size());
  if (input.bars.empty()) return invalid_input("survey: expected at least one scale bar, found none");
  return Surveyor(input, config).run();
}

}  // namespace imprint
