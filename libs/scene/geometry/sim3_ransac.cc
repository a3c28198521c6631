#include "geometry/sim3_ransac.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <utility>

#include "core/option_check.h"
#include "core/statistics.h"
#include "geometry/sim3_score.h"

namespace skein {
namespace {

using Triple = std::array<size_t, 3>;
using Random = std::mt19937_64;

constexpr size_t kDepthSamples = 101;  // of one photo, for the median ratio of depths

// The similarity that one photo implies by itself: both submaps hold the same camera.
struct ImageHypothesis {
  Eigen::Quaterniond rotation;
  double log_scale = 0.0;  // median over the common points of log(target depth / source depth)
};

// Score of a hypothesis: more photos win, then more inlier points with less error.
struct TotalScore {
  int num_inlier_images = 0;
  double sum_ratios = 0.0;  // SoftRatio of the inlier photos

  bool BetterThan(const TotalScore& other) const {
    if (num_inlier_images != other.num_inlier_images) {
      return num_inlier_images > other.num_inlier_images;
    }
    return sum_ratios > other.sum_ratios;
  }
};

bool IsInlierImage(const ImageScore& score, const Sim3Options& options) {
  return score.num_points > 0 && score.num_inliers >= options.min_inlier_ratio * score.num_points;
}

double SoftRatio(const ImageScore& score, double max_error_px) {
  // Truncated error rather than a bare count: hypotheses that differ little are told apart.
  return (score.num_inliers - score.sum_error_px / (max_error_px + 1e-12)) / score.num_points;
}

TotalScore Score(const std::vector<SharedPhoto>& shared, const std::vector<size_t>& usable,
                 const Similarity& hypothesis, const Sim3Options& options, int max_points) {
  TotalScore total;
  for (const size_t i : usable) {
    const ImageScore score = ScoreImage(shared[i], hypothesis, max_points);
    if (!IsInlierImage(score, options)) continue;
    ++total.num_inlier_images;
    total.sum_ratios += SoftRatio(score, MaxErrorPx(shared[i].target_camera));
  }
  return total;
}

std::optional<ImageHypothesis> HypothesisOfImage(const SharedPhoto& image) {
  std::vector<double> log_ratios;
  const size_t step = std::max<size_t>(1, image.points.size() / kDepthSamples);
  for (size_t i = 0; i < image.points.size(); i += step) {
    const double source = image.cam_from_source.Apply(image.points[i].source_xyz).z();
    const double target = image.cam_from_target.Apply(image.points[i].target_xyz).z();
    if (source > 0 && target > 0) log_ratios.push_back(std::log(target / source));
  }
  if (log_ratios.empty()) return std::nullopt;
  ImageHypothesis hypothesis;
  hypothesis.rotation =
      (image.cam_from_target.rotation.conjugate() * image.cam_from_source.rotation).normalized();
  hypothesis.log_scale = UpperMedian(std::move(log_ratios));
  return hypothesis;
}

Eigen::Quaterniond MeanRotation(const std::array<Eigen::Quaterniond, 3>& rotations) {
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (const Eigen::Quaterniond& q : rotations) sum += q.coeffs() * q.coeffs().transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> solver(sum);
  return Eigen::Quaterniond(Eigen::Vector4d(solver.eigenvectors().col(3))).normalized();
}

// Rotation and scale from the three photos, translation from their centres.
Similarity FromPoses(const std::vector<SharedPhoto>& shared,
                     const std::vector<std::optional<ImageHypothesis>>& hypotheses,
                     const Triple& triple) {
  std::array<Eigen::Quaterniond, 3> rotations;
  double log_scale = 0;
  for (int k = 0; k < 3; ++k) {
    rotations[k] = hypotheses[triple[k]]->rotation;
    log_scale += hypotheses[triple[k]]->log_scale / 3;
  }
  Similarity result;
  result.rotation = MeanRotation(rotations);
  result.scale = std::exp(log_scale);
  for (const size_t i : triple) {
    const Eigen::Vector3d centre =
        result.scale * (result.rotation * shared[i].cam_from_source.Centre());
    result.translation += (shared[i].cam_from_target.Centre() - centre) / 3;
  }
  return result;
}

// One random common point of each of the three photos.
std::optional<Similarity> FromPoints(const std::vector<SharedPhoto>& shared, const Triple& triple,
                                     Random* random) {
  std::vector<Eigen::Vector3d> source, target;
  for (const size_t i : triple) {
    const auto& points = shared[i].points;
    const auto& point =
        points[std::uniform_int_distribution<size_t>(0, points.size() - 1)(*random)];
    source.push_back(point.source_xyz);
    target.push_back(point.target_xyz);
  }
  return SimilarityFromPoints(source, target);
}

std::vector<Triple> AllTriples(const std::vector<size_t>& usable) {
  std::vector<Triple> triples;
  for (size_t a = 0; a < usable.size(); ++a) {
    for (size_t b = a + 1; b < usable.size(); ++b) {
      for (size_t c = b + 1; c < usable.size(); ++c) {
        triples.push_back({usable[a], usable[b], usable[c]});
      }
    }
  }
  return triples;
}

Triple RandomTriple(const std::vector<size_t>& usable, Random* random) {
  std::uniform_int_distribution<size_t> pick(0, usable.size() - 1);
  Triple triple;
  do {
    for (size_t& i : triple) i = usable[pick(*random)];
  } while (triple[0] == triple[1] || triple[1] == triple[2] || triple[0] == triple[2]);
  return triple;
}

// One or two photos: each by itself. A photo's pose and the depths of its points fix all seven
// degrees of freedom.
std::vector<Triple> SingleImages(const std::vector<size_t>& usable) {
  std::vector<Triple> triples;
  for (const size_t i : usable) triples.insert(triples.end(), 10, Triple{i, i, i});
  return triples;
}

std::vector<Triple> TriplesToTry(const std::vector<size_t>& usable, Random* random) {
  if (usable.size() < 3) return SingleImages(usable);
  const double n = usable.size();
  if (n * (n - 1) * (n - 2) / 6 <= kNumSim3Trials) return AllTriples(usable);
  std::vector<Triple> triples(kNumSim3Trials);
  for (Triple& triple : triples) triple = RandomTriple(usable, random);
  return triples;
}

struct Best {
  Similarity hypothesis;
  TotalScore score;
  bool found = false;

  void Offer(const Similarity& candidate, const TotalScore& candidate_score) {
    if (found && !candidate_score.BetterThan(score)) return;
    hypothesis = candidate;
    score = candidate_score;
    found = true;
  }
};

Best Search(const std::vector<SharedPhoto>& shared, const std::vector<size_t>& usable,
            const std::vector<std::optional<ImageHypothesis>>& hypotheses,
            const Sim3Options& options, int* num_trials) {
  Random random(options.seed);
  Best best;
  const auto offer = [&](const Similarity& candidate) {
    best.Offer(candidate, Score(shared, usable, candidate, options, kMaxScoredPoints));
    ++*num_trials;
  };
  for (const Triple& triple : TriplesToTry(usable, &random)) {
    offer(FromPoses(shared, hypotheses, triple));
    const std::optional<Similarity> from_points = FromPoints(shared, triple, &random);
    if (from_points) offer(*from_points);
  }
  return best;
}

std::vector<bool> InlierImages(const std::vector<SharedPhoto>& shared,
                               const std::vector<size_t>& usable, const Similarity& similarity,
                               const Sim3Options& options) {
  std::vector<bool> inliers(shared.size(), false);
  for (const size_t i : usable) {
    inliers[i] = IsInlierImage(ScoreImage(shared[i], similarity, 0), options);
  }
  return inliers;
}

// Refine, find the inliers again, refine again, as long as that is better.
Similarity RefineBest(const std::vector<SharedPhoto>& shared, const std::vector<size_t>& usable,
                      Similarity similarity, const Sim3Options& options) {
  TotalScore score = Score(shared, usable, similarity, options, 0);
  for (int round = 0; round < 3; ++round) {
    const std::vector<bool> used = InlierImages(shared, usable, similarity, options);
    const Similarity refined = RefineSim3(shared, used, similarity);
    const TotalScore refined_score = Score(shared, usable, refined, options, 0);
    if (!refined_score.BetterThan(score)) break;
    similarity = refined;
    score = refined_score;
  }
  return similarity;
}

void Report(const std::vector<SharedPhoto>& shared, const std::vector<size_t>& usable,
            const Sim3Options& options, Sim3Result* result) {
  double sum_error_px = 0;
  for (const size_t i : usable) {
    const ImageScore score = ScoreImage(shared[i], result->target_from_source, 0);
    result->num_common_points += score.num_points;
    if (!IsInlierImage(score, options)) continue;
    result->inlier_image_ids.push_back(shared[i].image_id);
    result->num_inlier_points += score.num_inliers;
    sum_error_px += score.sum_error_px;
  }
  std::sort(result->inlier_image_ids.begin(), result->inlier_image_ids.end());
  if (result->num_inlier_points > 0)
    result->mean_error_px = sum_error_px / result->num_inlier_points;
}

Sim3Result TooFew(const std::vector<size_t>& usable, const std::vector<SharedPhoto>& shared) {
  Sim3Result result;
  result.num_usable_images = static_cast<int>(usable.size());
  result.reason = std::to_string(usable.size()) + " of " + std::to_string(shared.size()) +
                  " shared images have enough common points";
  return result;
}

// Of each photo with enough common points.
std::vector<std::optional<ImageHypothesis>> HypothesesOf(const std::vector<SharedPhoto>& shared,
                                                         const Sim3Options& options) {
  std::vector<std::optional<ImageHypothesis>> hypotheses;
  for (const SharedPhoto& photo : shared) {
    const bool enough = photo.points.size() >= static_cast<size_t>(options.min_common_points);
    hypotheses.push_back(enough ? HypothesisOfImage(photo) : std::nullopt);
  }
  return hypotheses;
}

std::vector<size_t> UsableOf(const std::vector<std::optional<ImageHypothesis>>& hypotheses) {
  std::vector<size_t> usable;
  for (size_t i = 0; i < hypotheses.size(); ++i) {
    if (hypotheses[i]) usable.push_back(i);
  }
  return usable;
}

// Refines a similarity and judges it.
Sim3Result Refine(const Similarity& initial, const std::vector<SharedPhoto>& shared,
                  const std::vector<size_t>& usable, const Sim3Options& options) {
  Sim3Result result;
  result.num_usable_images = static_cast<int>(usable.size());
  result.target_from_source = RefineBest(shared, usable, initial, options);
  Report(shared, usable, options, &result);
  const int num_inlier_images = static_cast<int>(result.inlier_image_ids.size());
  result.success = num_inlier_images >= options.min_inlier_images;
  if (!result.success) {
    result.reason = "only " + std::to_string(num_inlier_images) + " of " +
                    std::to_string(usable.size()) + " shared images agree on a similarity";
  }
  return result;
}

}  // namespace

Status Sim3Options::Check() const {
  return FirstError({InRange("min_inlier_ratio", min_inlier_ratio, 0.01, 1.0),
                     InRange("min_inlier_images", min_inlier_images, 1, 1000),
                     InRange("min_common_points", min_common_points, 1, 10000)});
}

std::vector<SharedPhoto> PairSharedViews(const std::vector<SharedView>& source,
                                         const std::vector<SharedView>& target) {
  std::map<int64_t, const SharedView*> target_views;
  for (const SharedView& view : target) {
    if (view.camera.VerifyParams()) target_views[view.image_id] = &view;
  }
  std::vector<SharedPhoto> shared;
  for (const SharedView& view : source) {
    const auto it = target_views.find(view.image_id);
    if (it == target_views.end() || !view.camera.VerifyParams()) continue;
    SharedPhoto image{view.image_id,
                      view.camera,
                      it->second->camera,
                      view.cam_from_world,
                      it->second->cam_from_world,
                      {}};
    for (const auto& [idx, observation] : view.observations) {
      const auto other = it->second->observations.find(idx);
      if (other == it->second->observations.end()) continue;
      image.points.push_back({idx, observation.xyz, other->second.xyz, observation.pixel});
    }
    std::sort(image.points.begin(), image.points.end(),
              [](const auto& a, const auto& b) { return a.point2D_idx < b.point2D_idx; });
    shared.push_back(std::move(image));
  }
  std::sort(shared.begin(), shared.end(),
            [](const auto& a, const auto& b) { return a.image_id < b.image_id; });
  return shared;
}

Sim3Result EstimateSim3(const std::vector<SharedPhoto>& shared, const Sim3Options& options) {
  ThrowUnlessSound(options.Check());
  const std::vector<std::optional<ImageHypothesis>> hypotheses = HypothesesOf(shared, options);
  const std::vector<size_t> usable = UsableOf(hypotheses);
  if (usable.size() < static_cast<size_t>(options.min_inlier_images)) return TooFew(usable, shared);
  int num_trials = 0;
  const Best best = Search(shared, usable, hypotheses, options, &num_trials);
  Sim3Result result = Refine(best.hypothesis, shared, usable, options);
  result.num_trials = num_trials;
  return result;
}

Sim3Result RefineSim3From(const Similarity& initial, const std::vector<SharedPhoto>& shared,
                          const Sim3Options& options) {
  ThrowUnlessSound(options.Check());
  const std::vector<size_t> usable = UsableOf(HypothesesOf(shared, options));
  if (usable.size() < static_cast<size_t>(options.min_inlier_images)) return TooFew(usable, shared);
  return Refine(initial, shared, usable, options);
}

}  // namespace skein
