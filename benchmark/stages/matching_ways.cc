// Compares ways to match and verify a pair on the same pairs: each photo with its retrieval
// candidates. Prints the number of verified pairs, their inliers, the share that the true poses
// confirm, and the CPU time.
//
// A pair is true if at least half of its inliers lie within 4 px of the true epipolar lines, in
// both photos. This test misses a false match along an epipolar line. A match is therefore "wrong"
// by a third photo, in which the full product matches the same feature of the first photo. The
// features in the first and the third photo triangulate at 3 degrees or more. Their point,
// reprojected, is more than 8 px from the match in the second photo.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>

#include "benchmark/stages/retrieval_photos.h"
#include "core/angles.h"
#include "core/clock.h"
#include "features/vlad.h"
#include "geometry/model_poses.h"
#include "matching/pair_matcher.h"
#include "sfm/database.h"
#include "sfm/triangulation.h"
#include "vocabulary/codebook.h"

namespace skein::benchmark {
namespace {

constexpr double kMaxLineErrorPx = 4, kMaxPointErrorPx = 8, kMinAngleRad = DegToRad(3);

struct Options {
  std::string set, cache, poses;
  std::string codebook, databases;
  std::vector<double> camera;  // of the truth: f, cx, cy, k
  size_t top_n = 20;
  KernelVersion kernel = FastestKernel();
  bool colmap = false;
};

// A photo by the truth: its pose, and its features on the plane z = 1.
struct TruePhoto {
  Matrix3x4d pose;  // cam_from_world
  std::vector<Eigen::Vector2d> rays;
};

// Undistorts by fixed-point iteration.
Eigen::Vector2d Ray(const Eigen::Vector2d& pixel, const std::vector<double>& camera) {
  const Eigen::Vector2d distorted = (pixel - Eigen::Vector2d(camera[1], camera[2])) / camera[0];
  Eigen::Vector2d ray = distorted;
  for (int i = 0; i < 10; ++i) ray = distorted / (1 + camera[3] * ray.squaredNorm());
  return ray;
}

class Truth {
 public:
  Truth(const Options& options, const StudySet& set, const std::vector<PhotoFeaturesPtr>& photos)
      : photos_(photos.size()) {
    if (options.poses.empty()) return;
    focal_px_ = options.camera.at(0);
    const auto poses = ReadPoses(options.poses);
    if (!poses) throw std::invalid_argument(poses.error());
    std::map<std::string, CameraPose> by_name;
    for (const NamedPose& named : poses->poses) {
      std::string name = named.name;
      by_name[std::filesystem::path(name).filename()] = named.pose;
      std::replace(name.begin(), name.end(), '/', '_');
      by_name[name] = named.pose;
    }
    for (size_t i = 0; i < photos.size(); ++i) {
      const std::filesystem::path path = set.photos[i].path;
      auto found = by_name.find(path.filename());
      if (found == by_name.end()) found = by_name.find(path.stem());
      if (found == by_name.end()) continue;
      TruePhoto& photo = photos_[i].emplace();
      photo.pose.leftCols<3>() = found->second.rotation.toRotationMatrix();
      photo.pose.col(3) = found->second.translation;
      for (const auto& point : photos[i]->points) photo.rays.push_back(Ray(point, options.camera));
    }
  }

  bool Knows(size_t i) const { return photos_[i].has_value(); }

  // Distance from the epipolar line in px, the larger one of both photos.
  double LineErrorPx(size_t i, size_t j, uint32_t a, uint32_t b) const {
    const Eigen::Matrix3d E = Essential(i, j);
    const Eigen::Vector3d x1 = photos_[i]->rays[a].homogeneous();
    const Eigen::Vector3d x2 = photos_[j]->rays[b].homogeneous();
    const Eigen::Vector3d line2 = E * x1, line1 = E.transpose() * x2;
    const double error = std::abs(x2.dot(line2)) * focal_px_;
    return error / std::min(line1.head<2>().norm(), line2.head<2>().norm());
  }

  bool IsOnLines(size_t i, size_t j, uint32_t a, uint32_t b) const {
    return LineErrorPx(i, j, a, b) <= kMaxLineErrorPx;
  }

  // Distance in px, in photo j, of feature b from the reprojected point of features a (photo i) and
  // c (photo k). nullopt: no true pose, a match off the epipolar line, a point behind a camera, or
  // an angle below kMinAngleRad.
  std::optional<double> DistancePx(size_t i, uint32_t a, size_t k, uint32_t c, size_t j,
                                   uint32_t b) const {
    if (!Knows(i) || !Knows(j) || !Knows(k) || !IsOnLines(i, k, a, c)) return std::nullopt;
    const auto &first = *photos_[i], &second = *photos_[k];
    const Eigen::Vector3d xyz =
        TriangulatePoint(first.pose, second.pose, first.rays[a], second.rays[c]);
    const Eigen::Vector3d in1 = first.pose * xyz.homogeneous();
    const Eigen::Vector3d in2 = second.pose * xyz.homogeneous();
    const Eigen::Vector3d in3 = photos_[j]->pose * xyz.homogeneous();
    if (in1.z() <= 0 || in2.z() <= 0 || in3.z() <= 0) return std::nullopt;
    const Eigen::Vector3d ray1 = first.pose.leftCols<3>().transpose() * in1.normalized();
    const Eigen::Vector3d ray2 = second.pose.leftCols<3>().transpose() * in2.normalized();
    if (std::acos(std::min(1.0, ray1.dot(ray2))) < kMinAngleRad) return std::nullopt;
    return (in3.hnormalized() - photos_[j]->rays[b]).norm() * focal_px_;
  }

 private:
  Eigen::Matrix3d Essential(size_t i, size_t j) const {
    const Eigen::Matrix3d R =
        photos_[j]->pose.leftCols<3>() * photos_[i]->pose.leftCols<3>().transpose();
    const Eigen::Vector3d t = photos_[j]->pose.col(3) - R * photos_[i]->pose.col(3);
    Eigen::Matrix3d cross;
    cross << 0, -t.z(), t.y(), t.z(), 0, -t.x(), -t.y(), t.x(), 0;
    return cross * R;
  }

  double focal_px_ = 0;
  std::vector<std::optional<TruePhoto>> photos_;
};

using Pair = std::pair<size_t, size_t>;  // the later photo first

struct Outcome {
  PairResult result;
  double cpu_ms = 0;

  size_t inliers() const {
    return IsVerified(result.geometry) ? result.geometry.inlier_matches.size() : 0;
  }
};

struct Way {
  std::string name;
  std::function<PairResult(const PhotoFeatures&, const PhotoFeatures&)> match;
  std::vector<Outcome> outcomes;  // of each pair
};

// The full product, then COLMAP's own estimation as its matchers call it.
PairResult MatchAsColmap(const PhotoFeatures& a, const PhotoFeatures& b) {
  static DescriptorMatcher matcher{MatchOptions()};
  PairResult result;
  Timer timer;
  FeatureMatches matches;
  for (const IndexPair& pair : matcher.Match({a.descriptors.data(), int(a.points.size())},
                                             {b.descriptors.data(), int(b.points.size())})) {
    matches.emplace_back(pair.first, pair.second);
  }
  result.product_s = timer.ElapsedS();
  timer.Restart();
  RansacLimits limits;
  limits.max_error = limits::kMaxErrorPx;
  limits.confidence = kTwoViewConfidence;
  limits.min_inlier_ratio = kMinPairInlierRatio;
  limits.max_num_trials = 10000;
  result.geometry = EstimateByColmap({a.camera, a.points, b.camera, b.points}, matches, limits);
  result.geometry_s = timer.ElapsedS();
  return result;
}

std::vector<Pair> PairsOf(const StudySet& set, const Options& options) {
  const VladModel model(CodebookOf(options.codebook));
  std::vector<Eigen::VectorXf> vectors;
  for (const StudyPhoto& photo : set.photos) {
    const auto vector = model.DescribeFeatures(photo.features);
    vectors.push_back(Eigen::Map<const Eigen::VectorXf>(vector.data(), vector.size()));
  }
  std::vector<Pair> pairs;
  for (size_t i = 1; i < vectors.size(); ++i) {
    std::vector<std::pair<float, size_t>> best;
    for (size_t j = 0; j < i; ++j) best.emplace_back(-vectors[i].dot(vectors[j]), j);
    std::sort(best.begin(), best.end());
    best.resize(std::min(best.size(), options.top_n));
    for (const auto& [similarity, j] : best) pairs.emplace_back(i, j);
  }
  return pairs;
}

struct Score {
  size_t pairs = 0, verified = 0, true_pairs = 0, false_pairs = 0;
  size_t false_30 = 0, false_100 = 0;  // false pairs with so many inliers or more
  size_t inliers = 0, on_lines = 0, told = 0, wrong = 0;
  double cpu_ms = 0, product = 0, geometry = 0;  // the last two: shares of the time
};

// Features of photo i matched in other photos by the full product.
using Tracks = std::vector<std::map<uint32_t, std::vector<std::pair<size_t, uint32_t>>>>;

Tracks TracksOf(const Way& way, const std::vector<Pair>& pairs, size_t num_photos) {
  Tracks tracks(num_photos);
  for (size_t p = 0; p < pairs.size(); ++p) {
    if (way.outcomes[p].inliers() == 0) continue;
    for (const auto& match : way.outcomes[p].result.geometry.inlier_matches) {
      tracks[pairs[p].first][match.point2D_idx1].emplace_back(pairs[p].second, match.point2D_idx2);
      tracks[pairs[p].second][match.point2D_idx2].emplace_back(pairs[p].first, match.point2D_idx1);
    }
  }
  return tracks;
}

// Whether a third photo shows that the match is wrong; nullopt: no third photo decides it.
std::optional<bool> IsWrong(const Pair& pair, const FeatureMatch& match, const Truth& truth,
                            const Tracks& tracks) {
  const auto [i, j] = pair;
  const auto track = tracks[i].find(match.point2D_idx1);
  if (track == tracks[i].end()) return std::nullopt;
  for (const auto& [k, c] : track->second) {
    if (k == j) continue;
    const auto distance = truth.DistancePx(i, match.point2D_idx1, k, c, j, match.point2D_idx2);
    if (distance) return *distance > kMaxPointErrorPx;
  }
  return std::nullopt;
}

void AddTruth(const Pair& pair, const Outcome& outcome, const Truth& truth, const Tracks& tracks,
              Score* score) {
  const auto [i, j] = pair;
  if (outcome.inliers() == 0 || !truth.Knows(i) || !truth.Knows(j)) return;
  size_t on_lines = 0;
  for (const auto& match : outcome.result.geometry.inlier_matches) {
    on_lines += truth.IsOnLines(i, j, match.point2D_idx1, match.point2D_idx2);
    const std::optional<bool> is_wrong = IsWrong(pair, match, truth, tracks);
    score->told += is_wrong.has_value();
    score->wrong += is_wrong.value_or(false);
  }
  score->on_lines += on_lines;
  const bool is_true = 2 * on_lines >= outcome.inliers();
  ++(is_true ? score->true_pairs : score->false_pairs);
  score->false_30 += !is_true && outcome.inliers() >= 30;
  score->false_100 += !is_true && outcome.inliers() >= 100;
}

void Print(const char* name, const Score& s) {
  const double n = std::max<size_t>(1, s.pairs), in = std::max<size_t>(1, s.inliers);
  const double parts = std::max(1e-12, s.product + s.geometry);
  const double ms = s.cpu_ms / n;
  std::printf(
      "  %-16s %5zu %5zu %5zu %5zu %4zu %4zu  %8.1f %6.3f %7zu %6.4f  %6.2f = %5.2f + "
      "%5.2f\n",
      name, s.pairs, s.verified, s.true_pairs, s.false_pairs, s.false_30, s.false_100,
      static_cast<double>(s.inliers) / std::max<size_t>(1, s.verified), s.on_lines / in, s.told,
      static_cast<double>(s.wrong) / std::max<size_t>(1, s.told), ms, ms * s.product / parts,
      ms * s.geometry / parts);
}

// Pairs by the inliers of the first way: not verified, few, many.
void PrintTable(const std::vector<Way>& ways, const std::vector<Pair>& pairs, const Truth& truth,
                size_t num_photos) {
  const Tracks tracks = TracksOf(ways[0], pairs, num_photos);
  const std::vector<size_t> bounds{0, 1, 30, 100, SIZE_MAX};
  for (size_t b = 0; b <= bounds.size() - 1; ++b) {
    const bool all = b + 1 == bounds.size();
    if (all) {
      std::printf("all pairs\n");
    } else if (b == 0) {
      std::printf("not verified by %s\n", ways[0].name.c_str());
    } else {
      std::printf("%zu inliers or more by %s\n", std::max<size_t>(15, bounds[b]),
                  ways[0].name.c_str());
    }
    for (const Way& way : ways) {
      Score score;
      for (size_t p = 0; p < pairs.size(); ++p) {
        const size_t first = ways[0].outcomes[p].inliers();
        if (!all && (first < bounds[b] || first >= bounds[b + 1])) continue;
        const Outcome& outcome = way.outcomes[p];
        ++score.pairs;
        score.verified += outcome.inliers() > 0;
        score.inliers += outcome.inliers();
        score.cpu_ms += outcome.cpu_ms;
        score.product += outcome.result.product_s;
        score.geometry += outcome.result.geometry_s;
        AddTruth(pairs[p], outcome, truth, tracks, &score);
      }
      Print(way.name.c_str(), score);
    }
  }
}

// Matches of the first way and another: those of both, and of one alone.
struct Share {
  size_t matches = 0, told = 0, wrong = 0;
  std::vector<double> errors_px;

  void Add(const Pair& pair, const FeatureMatch& match, const Truth& truth, const Tracks& tracks) {
    ++matches;
    const auto [i, j] = pair;
    if (!truth.Knows(i) || !truth.Knows(j)) return;
    errors_px.push_back(truth.LineErrorPx(i, j, match.point2D_idx1, match.point2D_idx2));
    const std::optional<bool> is_wrong = IsWrong(pair, match, truth, tracks);
    told += is_wrong.has_value();
    wrong += is_wrong.value_or(false);
  }

  void Print(const char* name, size_t pairs) {
    double sum_sq = 0;
    for (double& error : errors_px) {
      error = std::min(error, kMaxLineErrorPx);
      sum_sq += error * error;
    }
    std::sort(errors_px.begin(), errors_px.end());
    const double median = errors_px.empty() ? 0 : errors_px[errors_px.size() / 2];
    std::printf(
        "  %-28s %8.1f a pair, from the true line median %.3f, RMS %.3f px; wrong %.4f of %zu\n",
        name, static_cast<double>(matches) / std::max<size_t>(1, pairs), median,
        std::sqrt(sum_sq / std::max<size_t>(1, errors_px.size())),
        static_cast<double>(wrong) / std::max<size_t>(1, told), told);
  }
};

void PrintShares(const Way& first, const Way& other, const std::vector<Pair>& pairs,
                 const Truth& truth, size_t num_photos) {
  const Tracks tracks = TracksOf(first, pairs, num_photos);
  Share both, first_alone, other_alone;
  size_t count = 0;
  for (size_t p = 0; p < pairs.size(); ++p) {
    if (first.outcomes[p].inliers() == 0 || other.outcomes[p].inliers() == 0) continue;
    ++count;
    std::map<uint32_t, uint32_t> firsts;
    for (const auto& match : first.outcomes[p].result.geometry.inlier_matches) {
      firsts[match.point2D_idx1] = match.point2D_idx2;
    }
    for (const auto& match : other.outcomes[p].result.geometry.inlier_matches) {
      const auto found = firsts.find(match.point2D_idx1);
      const bool in_both = found != firsts.end() && found->second == match.point2D_idx2;
      (in_both ? both : other_alone).Add(pairs[p], match, truth, tracks);
      if (in_both) firsts.erase(found);
    }
    for (const auto& [a, b] : firsts) first_alone.Add(pairs[p], {a, b}, truth, tracks);
  }
  std::printf("pairs that both verify: %zu\n", count);
  both.Print("both", count);
  first_alone.Print((first.name + " alone").c_str(), count);
  other_alone.Print((other.name + " alone").c_str(), count);
}

// Photos of one size and focal length have one camera.
void WritePhotos(const StudySet& set, ColmapDatabase* database) {
  std::map<std::tuple<int, int, double, bool>, CameraId> cameras;
  for (size_t i = 0; i < set.photos.size(); ++i) {
    const StudyPhoto& photo = set.photos[i];
    CameraId& camera_id =
        cameras[{photo.width_px, photo.height_px, photo.focal_px, photo.focal_from_exif}];
    if (camera_id == 0) {
      camera_id = database->WriteCamera(
          PriorCamera(photo.width_px, photo.height_px, photo.focal_px, photo.focal_from_exif));
    }
    const auto id = static_cast<ImageId>(i + 1);
    database->WriteImage(id, camera_id, std::filesystem::path(photo.path).filename());
    database->WriteKeypoints(id, photo.features.keypoints);
  }
}

// What a way verified, for mapper_offline and COLMAP's mapper.
void WriteDatabase(const StudySet& set, const std::vector<Pair>& pairs, const Way& way,
                   const std::string& folder) {
  std::string name = way.name;
  std::replace(name.begin(), name.end(), ' ', '-');
  const std::filesystem::path file = std::filesystem::path(folder) / (name + ".db");
  std::filesystem::create_directories(folder);
  std::filesystem::remove(file);
  ColmapDatabase database(file.string());
  WritePhotos(set, &database);
  for (size_t p = 0; p < pairs.size(); ++p) {
    if (way.outcomes[p].inliers() == 0) continue;
    const auto id = [](size_t i) { return static_cast<ImageId>(i + 1); };
    const TwoViewGeometry& geometry = way.outcomes[p].result.geometry;
    database.WriteMatches(id(pairs[p].first), id(pairs[p].second), geometry.inlier_matches);
    database.WriteTwoViewGeometry(id(pairs[p].first), id(pairs[p].second), geometry);
  }
}

std::map<std::string, KernelVersion> KernelsByName() {
  std::map<std::string, KernelVersion> kernels;
  for (const KernelVersion version : kKernelVersions) kernels[KernelName(version)] = version;
  return kernels;
}

void Run(const Options& options) {
  const auto set = LoadStudySet(options.set, options.cache, [](int64_t, int64_t) {});
  if (!set) throw std::invalid_argument(set.error());
  const DescriptorCells cells(CodebookOf(options.codebook));
  std::vector<PhotoFeaturesPtr> photos;
  for (const StudyPhoto& photo : set->photos) {
    photos.push_back(ForMatching(photo, static_cast<int64_t>(photos.size()) + 1, &cells));
  }
  const std::vector<Pair> pairs = PairsOf(*set, options);
  std::vector<Way> ways;
  for (const bool cascade : {false, true}) {
    const auto matcher = std::make_shared<PairMatcher>(cascade, options.kernel);
    ways.push_back({cascade ? "cascade" : "full product",
                    [matcher](const auto& a, const auto& b) { return matcher->Match(a, b); },
                    {}});
  }
  if (options.colmap) ways.push_back({"COLMAP", MatchAsColmap, {}});
  for (const auto& [i, j] : pairs) {
    for (Way& way : ways) {
      Outcome outcome;
      const double start_s = ThreadCpuS();
      outcome.result = way.match(*photos[i], *photos[j]);
      outcome.cpu_ms = 1e3 * (ThreadCpuS() - start_s);
      way.outcomes.push_back(std::move(outcome));
    }
  }
  std::printf("%s: %zu photos, %zu pairs\n", set->name.c_str(), photos.size(), pairs.size());
  std::printf("  %-16s %5s %5s %5s %5s %4s %4s  %8s %6s %7s %6s  CPU ms = product + geometry\n", "",
              "pairs", "verif", "true", "false", ">=30", ">100", "inliers", "lines", "told",
              "wrong");
  const Truth truth(options, *set, photos);
  PrintTable(ways, pairs, truth, photos.size());
  for (size_t w = 1; w < ways.size(); ++w) {
    PrintShares(ways[0], ways[w], pairs, truth, photos.size());
  }
  for (const Way& way : ways) {
    if (!options.databases.empty()) WriteDatabase(*set, pairs, way, options.databases);
  }
}

}  // namespace
}  // namespace skein::benchmark

int main(int argc, char** argv) {
  skein::benchmark::Options options;
  CLI::App app("Ways to match a pair of photos, on the pairs that retrieval names.");
  app.add_option("--set", options.set, "NAME=FOLDER of photos")->required();
  app.add_option("--cache", options.cache, "Folder for features")->required();
  app.add_option(
      "--poses", options.poses,
      "True poses, as `skein evaluate` takes them; a photo AGENT_NAME is AGENT/NAME, too");
  app.add_option("--camera", options.camera, "The camera of the true poses: f cx cy k")
      ->expected(4);
  app.add_option("--codebook", options.codebook, "VLAD codebook; default: the shipped one");
  app.add_option("--top-n", options.top_n, "Earlier photos a photo")->capture_default_str();
  app.add_option("--databases", options.databases,
                 "Folder for a COLMAP database a way, of what it verified");
  app.add_option("--kernel", options.kernel,
                 "Kernel of both ways, not of --colmap; default: the fastest here")
      ->transform(CLI::CheckedTransformer(skein::benchmark::KernelsByName()));
  app.add_flag("--colmap", options.colmap, "Also COLMAP's own estimation");
  CLI11_PARSE(app, argc, argv);
  std::printf("commit %s\n", SKEIN_COMMIT);
  try {
    skein::benchmark::Run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "matching_ways: %s\n", error.what());
    return 1;
  }
}
