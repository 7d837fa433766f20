#include "fusion/fusion_pipeline.h"

#include <algorithm>
#include <utility>

#include "fusion/combine/combine_config.h"
#include "fusion/faceted/faceted.h"
#include "fusion/faceted/section_evidence.h"
#include "fusion/thesis/thesis_geometry.h"
#include "fusion/triangulate/triangulate_config.h"

namespace imprint {
namespace {

/// Cameras of an observation that could not be triangulated, with why.
std::vector<CameraShare> shares_of_failed(const Observation& observation, const std::string& reason) {
  std::vector<CameraShare> shares;
  for (const Imprint& imprint : observation.imprints) {
    CameraShare share;
    share.id = imprint.camera_id;
    share.pose = imprint.pose;
    share.reprojection_rms_px = imprint.quality.reprojection_rms_px;
    share.targets_used = imprint.quality.targets_used;
    share.edge_points = imprint.quality.edge_points;
    share.excluded = true;
    share.reason = imprint.failure.empty() ? reason : imprint.failure;
    shares.push_back(std::move(share));
  }
  return shares;
}

const Imprint* imprint_of(const Observation& observation, const std::string& camera) {
  const auto found = std::ranges::find(observation.imprints, camera, &Imprint::camera_id);
  return found == observation.imprints.end() ? nullptr : &*found;
}

// A camera found to have moved makes doubtful what it saw since it was last known to stand still.
bool doubted_later(const std::vector<Observation>& observations, const Imprint& imprint) {
  return std::ranges::any_of(observations, [&](const Observation& observation) {
    const Imprint* later = imprint_of(observation, imprint.camera_id);
    return later != nullptr && later->pose_doubtful_since_ns != 0 &&
           imprint.sensor_time_ns > later->pose_doubtful_since_ns && imprint.sensor_time_ns <= later->sensor_time_ns;
  });
}

void note_poses(const std::vector<Observation>& observations, std::vector<Measurement::Observation>& reports,
                std::vector<std::string>& warnings) {
  for (std::size_t i = 0; i < reports.size(); ++i) {
    for (CameraShare& share : reports[i].cameras) {
      const Imprint* imprint = imprint_of(observations[i], share.id);
      if (imprint == nullptr) continue;
      share.pose_state = imprint->pose_state;
      share.pose_doubtful = imprint->pose_doubtful || doubted_later(observations, *imprint);
      if (share.pose_doubtful && !share.excluded)
        warnings.push_back(fmt::format(
            "observation {}: camera {}: its pose is doubtful ({})", reports[i].index, share.id,
            imprint->pose_state == PoseState::hold ? "kept, and not confirmed by its targets, or found moved later"
                                                   : "the camera had moved"));
    }
  }
}

// The views of the cameras that agree, for the thesis's estimators.
Result<SpaceCurves> curves_of(const Observation& observation, const ObservedForging& triangulated,
                              const ForgingSpec& forging) {
  std::vector<CameraView> views;
  for (std::size_t i = 0; i < observation.imprints.size(); ++i) {
    if (triangulated.cameras[i].excluded) continue;
    auto view = view_of(observation.imprints[i], static_cast<int>(i), TriangulateConfig{}.min_rim_share);
    if (view) views.push_back(std::move(*view));
  }
  return space_curves(views, forging, ThesisConfig{});
}

/// All observations of a session, triangulated.
struct Triangulated {
  std::vector<ObservedForging> observed;  ///< those that could be
  std::vector<SpaceCurves> curves;        ///< of `observed`, where the thesis's geometry is asked for
  std::vector<double> rotations_deg;      ///< of `observed`
  std::vector<Measurement::Observation> reports;
  std::vector<std::string> warnings;
};

Result<Triangulated> triangulate_all(const std::vector<Observation>& observations, const ForgingSpec& forging,
                                     const std::string& session, GeometryMethod geometry,
                                     const TriangulateConfig& config) {
  Triangulated all;
  std::string first_failure;
  for (const Observation& observation : observations) {
    Measurement::Observation report{
        .index = observation.index, .rotation_deg = observation.rotation_deg, .cameras = {}};
    auto triangulated = triangulate(observation.imprints, forging, config);
    if (triangulated) {
      report.cameras = triangulated->cameras;
      for (const std::string& warning : triangulated->warnings)
        all.warnings.push_back(fmt::format("observation {}: {}", observation.index, warning));
    } else {
      report.cameras = shares_of_failed(observation, triangulated.error().message);
      const std::string failure = fmt::format("observation {}: {}", observation.index, triangulated.error().message);
      if (first_failure.empty()) first_failure = failure;
      all.warnings.push_back(failure + "; the observation is left out");
    }
    for (const auto& [id, why] : observation.missing) {
      CameraShare share;
      share.id = id;
      share.excluded = true;
      share.reason = why;
      report.cameras.push_back(std::move(share));
      all.warnings.push_back(fmt::format("observation {}: camera {} left out: {}", observation.index, id, why));
    }
    all.reports.push_back(std::move(report));
    if (!triangulated) continue;
    if (geometry == GeometryMethod::thesis) {
      auto of_views = curves_of(observation, *triangulated, forging);
      if (!of_views)
        return job_failed("session {}: observation {}: {}", session, observation.index, of_views.error().message);
      all.curves.push_back(std::move(*of_views));
    }
    all.observed.push_back(std::move(*triangulated));
    all.rotations_deg.push_back(observation.rotation_deg);
  }
  if (all.observed.empty()) {
    std::string missing;
    for (const auto& [id, why] : observations.front().missing) missing += fmt::format("; {}: {}", id, why);
    return job_failed("session {}: {}{}", session, first_failure, missing);
  }
  return all;
}

/// Whether sections with faces are to be looked for: the rig says so, or leaves it open and the widths change as the
/// forging is turned.
bool may_have_faces(const std::vector<Observation>& observations, const ForgingSpec& forging) {
  if (forging.section != SectionKind::unknown) return forging.section != SectionKind::round;
  std::vector<std::vector<Imprint>> imprints;
  for (const Observation& observation : observations) imprints.push_back(observation.imprints);
  return change_of_width(imprints) > kRoundestFaceted;
}

}  // namespace

Result<Measurement> fuse(const std::vector<Observation>& observations, const ForgingSpec& forging, std::string session,
                         std::string method, GeometryMethod geometry) {
  if (observations.empty()) return job_failed("session {}: no observation", session);
  const bool joint = geometry == GeometryMethod::joint;
  Result<Triangulated> all = Triangulated{};
  Result<CombinedForging> combined = CombinedForging{};
  const auto combine_with = [&](std::span<const ObservedForging> observed, std::span<const double> rotations) {
    return combined->section_kind == SectionKind::round
               ? combine(observed, rotations, forging, CombineConfig{})
               : combine_faceted(observed, rotations, forging, combined->section_kind, CombineConfig{});
  };
  if (joint && may_have_faces(observations, forging)) {
    TriangulateConfig faceted;
    faceted.out_of_round_share = TriangulateConfig::kFacetedShare;
    all = triangulate_all(observations, forging, session, geometry, faceted);
    if (!all) return pass_on(all.error());
    combined = combine_faceted(all->observed, all->rotations_deg, forging, forging.section, CombineConfig{});
    if (!combined) return job_failed("session {}: {}", session, combined.error().message);
  }
  if (combined->section_kind == SectionKind::round) {
    all = triangulate_all(observations, forging, session, geometry, TriangulateConfig{});
    if (!all) return pass_on(all.error());
    combined = joint ? combine(all->observed, all->rotations_deg, forging, CombineConfig{})
                     : thesis_geometry(all->curves, all->rotations_deg, forging, ThesisConfig{});
    if (!combined) return job_failed("session {}: {}", session, combined.error().message);
  }
  note_poses(observations, all->reports, all->warnings);
  combined->warnings.insert(combined->warnings.begin(), all->warnings.begin(), all->warnings.end());
  Measurement measurement = make_measurement(*combined, std::move(all->reports), std::move(session), std::move(method));
  measurement.geometry = name_of(geometry);
  if (all->observed.size() > 1 && joint) {
    const auto alone = combine_with(std::span(all->observed).first(1), std::span(all->rotations_deg).first(1));
    if (alone) measurement.gain = {static_cast<int>(all->observed.size()), sureness(*alone), sureness(*combined)};
  }
  return measurement;
}

}  // namespace imprint
