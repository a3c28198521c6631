#include "session/diagnosis.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/angles.h"
#include "core/limits.h"

namespace skein {
namespace {

using Cause = Diagnosis::Cause;
using Edge = CovisibilityGraph::Edge;

// Mean grey levels. At 5 % the noise of a phone's sensor is as large as most texture.
constexpr float kDark = 0.05F, kBright = 0.95F;
// Sharp photos of five real sets: 0.16 to 0.21. Blurred by a Gaussian of 4 pixels at a longest side
// of 1,600, which most maps still take: 0.31 to 0.40; of 8 pixels: 0.58 to 0.68; by 31 pixels of
// motion: 0.53 to 0.63. With noise.
constexpr float kBlurred = 0.45F;
// Of a photo that shows a thing in front of nothing; the same sets have 0.6 and more.
constexpr float kBareCoverage = 0.35F;
constexpr int kBareKeypoints = 300;

std::string Percent(float share) { return std::to_string(std::lround(100 * share)) + " %"; }

Diagnosis Of(Cause cause, std::string what, std::string remedy) {
  Diagnosis diagnosis;
  diagnosis.cause = cause;
  diagnosis.what = std::move(what);
  diagnosis.remedy = std::move(remedy);
  return diagnosis;
}

Diagnosis Waiting(const std::string& what) { return Of(Cause::kWaiting, what, ""); }

std::optional<Diagnosis> InWork(const PhotoState& photo) {
  if (photo.failed()) {
    Diagnosis failed =
        Of(Cause::kFailed, photo.failed_reason, "shoot it again, or send it again as a JPEG");
    failed.reason = photo.failed_reason;
    return failed;
  }
  if (photo.features_seq == 0) return Waiting("waits for its features");
  if (photo.features.num_keypoints == 0) return std::nullopt;  // it is compared with nothing
  if (photo.candidates_seq == 0) return Waiting("waits for its candidates");
  if (photo.matches_seq == 0) return Waiting("waits for its matches");
  return std::nullopt;
}

// What is wrong with the photo itself.
std::optional<Diagnosis> InThePhoto(const features_t& features) {
  if (features.brightness < kDark) {
    return Of(Cause::kTooDark, "too dark: mean grey level " + Percent(features.brightness),
              "is the lens covered? else expose longer or bring light, and shoot again");
  }
  if (features.brightness > kBright) {
    return Of(Cause::kTooBright, "too bright: mean grey level " + Percent(features.brightness),
              "expose shorter, and shoot again");
  }
  if (features.blur > kBlurred) {
    return Of(Cause::kBlurred,
              "blurred: " + Percent(features.blur) + ", where sharp photos have 20 %",
              "hold the camera still, wait for its focus, and shoot again");
  }
  if (features.num_keypoints < kBareKeypoints || features.coverage < kBareCoverage) {
    return Of(Cause::kBare,
              "few details: " + std::to_string(features.num_keypoints) + " keypoints, on " +
                  Percent(features.coverage) + " of the photo",
              "is something in front of the lens? else step back, so that more than a bare surface "
              "is seen");
  }
  return std::nullopt;
}

Diagnosis WithoutOverlap(const PhotoState& photo) {
  if (photo.candidates.num_candidates == 0) return Waiting("waits for photos that overlap it");
  return Of(Cause::kNoOverlap,
            "no photo overlaps it; " + std::to_string(photo.candidates.num_candidates) +
                " were compared with it",
            "shoot again from halfway between here and the nearest place that was photographed");
}

template <class Predicate>
bool AllStrong(const std::vector<Edge>& edges, Predicate predicate) {
  return std::all_of(edges.begin(), edges.end(), [&](const Edge& edge) {
    return edge.num_inliers < limits::kMinPoseInliers || predicate(edge);
  });
}

std::optional<Diagnosis> OfOneSpot(const CovisibilityGraph& graph, int64_t image_id,
                                   const std::string& best) {
  const std::vector<Edge>& edges = graph.EdgesOf(image_id);
  if (AllStrong(edges, [&](const Edge& e) {
        return e.tri_angle_rad < DegToRad(limits::kMinTriangulationAngleDeg) ||
               graph.IsOfOneSpot(image_id, e);
      })) {
    return Of(Cause::kRotationOnly, "taken from the same spot as all photos that overlap it",
              "take a step sideways, a tenth of the distance to what " + best +
                  " shows, and shoot again; of an object that turns before the camera, cover what "
                  "stands still behind it");
  }
  return std::nullopt;
}

// The photo's turn has come, and no map has tried it.
std::optional<Diagnosis> WithoutInitialPair(const std::vector<Edge>& edges, int num_inliers,
                                            const std::string& best) {
  if (num_inliers < limits::kMinPoseInliers) return std::nullopt;
  if (AllStrong(edges, [](const Edge& e) { return e.geometry == Edge::kPlanar; })) {
    return Of(Cause::kPlanarOnly, "it and what overlaps it show one flat surface alone",
              "shoot again with something in view that stands out of the surface");
  }
  if (num_inliers < limits::kMinSeedInliers) return std::nullopt;
  return Of(Cause::kNoInitialPair,
            "no map could begin with it and " + best + ", which share " +
                std::to_string(num_inliers) + " points",
            "shoot two more, each a few steps further to the side, without zoom, and send photos "
            "as the camera wrote them");
}

// Of a photo that no map has tried and no finish has seen: its turn comes without anybody's doing.
std::optional<Diagnosis> BeforeItsTurn(const SessionState& state, const PhotoState& photo,
                                       int num_inliers, bool is_linked) {
  if (photo.matches_seq <= state.finish().settled_seq) return std::nullopt;
  if (is_linked) return Waiting("waits for its map to try it");
  if (num_inliers >= limits::kMinSeedInliers) return Waiting("waits for a map to begin with it");
  return std::nullopt;
}

Diagnosis InTheMap(const SubmapLife::Photo* trial, int num_inliers, const std::string& best) {
  const auto text = [&](const std::string& else_what) {
    return trial == nullptr || trial->reason.empty() ? else_what : trial->reason;
  };
  switch (trial == nullptr ? registration_t::OTHER : trial->cause) {
    case registration_t::SIMILAR_PLACE:
      return Of(Cause::kSimilarPlace, text("it may be of another, visually similar place"),
                "shoot what is different here, and walk here from a place that was photographed, a "
                "photo every two steps");
    case registration_t::CONTRADICTED:
      return Of(Cause::kContradicted, text("its matches lead to different poses"),
                "shoot again nearer to where " + best + " was taken");
    case registration_t::CAMERA:
      return Of(Cause::kCamera, text("no possible camera fits it"),
                "shoot again without zoom, and send photos as the camera wrote them");
    default:
      break;
  }
  const std::string needed = " of " + std::to_string(limits::kMinPoseInliers) + " inliers with ";
  const std::string inliers = std::to_string(num_inliers);
  return Of(Cause::kWeakOverlap,
            num_inliers < limits::kMinPoseInliers
                ? inliers + needed + best
                : text("no map holds a photo that overlaps it") + "; best link: " + inliers +
                      " inliers with " + best,
            "go halfway towards where " + best + " was taken, and shoot again");
}

}  // namespace

std::string Diagnosis::Text() const { return remedy.empty() ? what : what + "; " + remedy; }

const char* CauseName(Diagnosis::Cause cause) {
  switch (cause) {
    case Cause::kWaiting:
      return "waiting";
    case Cause::kFailed:
      return "failed";
    case Cause::kTooDark:
      return "too dark";
    case Cause::kTooBright:
      return "too bright";
    case Cause::kBlurred:
      return "blurred";
    case Cause::kBare:
      return "few details";
    case Cause::kNoOverlap:
      return "no overlap";
    case Cause::kWeakOverlap:
      return "weak overlap";
    case Cause::kRotationOnly:
      return "rotation only";
    case Cause::kPlanarOnly:
      return "flat surface only";
    case Cause::kSimilarPlace:
      return "similar place";
    case Cause::kContradicted:
      return "contradicted";
    case Cause::kCamera:
      return "camera";
    case Cause::kNotInTime:
      return "not in time";
    case Cause::kNoInitialPair:
      return "no initial pair";
  }
  return "";
}

const char* TrialCauseName(int8_t registration_cause) {
  switch (registration_cause) {
    case registration_t::FEW_COMMON_POINTS:
      return CauseName(Cause::kWeakOverlap);
    case registration_t::SIMILAR_PLACE:
      return CauseName(Cause::kSimilarPlace);
    case registration_t::CONTRADICTED:
      return CauseName(Cause::kContradicted);
    case registration_t::CAMERA:
      return CauseName(Cause::kCamera);
    default:
      return "other";
  }
}

Diagnosis Diagnose(const SessionState& state, const PhotoState& photo) {
  if (const auto in_work = InWork(photo)) return *in_work;
  const int64_t id = photo.image.image_id;
  const std::vector<Edge>& edges = state.covisibility().EdgesOf(id);
  const auto best = std::max_element(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) {
    return a.num_inliers < b.num_inliers;
  });
  if (best == edges.end() || best->num_inliers < limits::kMinSeedInliers) {
    if (const auto in_photo = InThePhoto(photo.features)) return *in_photo;
  }
  if (best == edges.end()) return WithoutOverlap(photo);
  const SubmapLife::Photo* trial = state.FindTrial(id);
  const bool is_linked = std::any_of(edges.begin(), edges.end(), [&](const Edge& edge) {
    return edge.num_inliers >= limits::kMinPoseInliers && state.IsRegistered(edge.other_id);
  });
  const std::string other = state.NameOf(best->other_id);
  std::optional<Diagnosis> diagnosis;
  if (trial == nullptr && state.finish().is_cut()) {
    diagnosis = Of(Cause::kNotInTime, "not tried in time", "finish again, with more time");
  } else if (!is_linked && best->num_inliers >= limits::kMinPoseInliers) {
    diagnosis = OfOneSpot(state.covisibility(), id, other);
  }
  if (!diagnosis && trial == nullptr) {
    diagnosis = BeforeItsTurn(state, photo, best->num_inliers, is_linked);
    if (!diagnosis && !is_linked) diagnosis = WithoutInitialPair(edges, best->num_inliers, other);
  }
  if (!diagnosis) diagnosis = InTheMap(trial, best->num_inliers, other);
  if (trial != nullptr) diagnosis->reason = trial->reason;
  diagnosis->num_inliers = best->num_inliers;
  diagnosis->best_other_id = best->other_id;
  return *diagnosis;
}

}  // namespace skein
