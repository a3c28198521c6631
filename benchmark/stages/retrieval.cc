// What retrieval finds and what it costs, on sets of photos in their order of arrival.
//
// Reference (the paper's Tables II and III): all pairs are matched and verified. Of a photo's pairs
// with earlier photos and more than 50 inliers the 30 strongest count. The codebook is trained on
// the other sets only, unless one is given. "Expanded" is what the service does (hnsw_index.h),
// compared with exact search expanded likewise.
#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <numeric>
#include <opencv2/core.hpp>
#include <opencv2/flann.hpp>
#include <set>

#include "benchmark/stages/retrieval_photos.h"
#include "codecs/exif_reader.h"
#include "codecs/image_decoding.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/statistics.h"
#include "features/model_choice.h"
#include "features/train_codebook.h"
#include "features/vlad.h"
#include "photo/photo_header.h"
#include "retrieval/hnsw_index.h"
#include "retrieval/retrieval_state.h"

namespace skein::benchmark {
namespace {

constexpr int kTopN = 30;
const size_t kNumExpanding = RetrievalOptions().num_expanding;
constexpr int kTreeBranching = 10;
constexpr int kTreeIterations = 11;
constexpr int32_t kTruePairInliers = 50;  // a true pair has more
constexpr size_t kMinPredecessors = 60;   // photos with fewer are not judged

struct Options {
  std::vector<std::string> sets;   // NAME=FOLDER, judged and, for the others, trained on
  std::vector<std::string> train;  // NAME=FOLDER, trained on only
  std::string cache;
  std::string codebook;
  std::vector<std::string> models;  // ONNX, judged beside VLAD
  TrainingOptions training;
};

using Vectors = std::vector<std::vector<float>>;

// Ids (index of photo) of the photos most like photo i among 0..i-1, nearest first.
using Ranking = std::vector<int64_t>;
struct Method {
  std::string name;
  std::vector<Ranking> rankings;  // kTopN each
  std::vector<double> times_s;    // query and insertion, a photo
};

struct Reference {
  std::vector<Ranking> strongest;  // at most kTopN a photo, most inliers first
};

Reference MakeReference(const InlierCounts& inliers) {
  Reference reference;
  for (const auto& row : inliers) {
    Ranking ids;
    for (size_t j = 0; j < row.size(); ++j) {
      if (row[j] > kTruePairInliers) ids.push_back(static_cast<int64_t>(j));
    }
    std::stable_sort(ids.begin(), ids.end(), [&](int64_t a, int64_t b) { return row[a] > row[b]; });
    if (ids.size() > kTopN) ids.resize(kTopN);
    reference.strongest.push_back(std::move(ids));
  }
  return reference;
}

Ranking Ids(const std::vector<Neighbour>& neighbours) {
  Ranking ids;
  for (const auto& n : neighbours) ids.push_back(n.id);
  return ids;
}

// Photo by photo: query, then insert. `restart_at`: there the index is written and read again.
Method RunIndex(const std::string& name, const Vectors& vectors, const HnswOptions& options,
                size_t num_expanding, size_t restart_at = 0) {
  Method method{name, {}, {}};
  HnswIndex index(vectors[0].size(), options);
  for (size_t i = 0; i < vectors.size(); ++i) {
    if (restart_at > 0 && i == restart_at) {
      auto loaded = HnswIndex::Decode(index.Encode(), index.dim(), options);
      index = std::move(*loaded);
    }
    const Timer timer;
    const auto search = index.Find(vectors[i].data());
    method.rankings.push_back(Ids(index.NearestExpanded(search, kTopN, num_expanding)));
    index.Insert(static_cast<int64_t>(i), search);
    method.times_s.push_back(timer.ElapsedS());
  }
  return method;
}

// By comparing with every photo before, in full precision.
Method RunExact(const Vectors& vectors) {
  Method method{"exact", {}, {}};
  const auto as_row = [&](size_t i) {
    return Eigen::Map<const Eigen::RowVectorXf>(vectors[i].data(), vectors[i].size());
  };
  for (size_t i = 0; i < vectors.size(); ++i) {
    const Timer timer;
    std::vector<std::pair<float, int64_t>> all;
    for (size_t j = 0; j < i; ++j) {
      all.emplace_back((as_row(i) - as_row(j)).squaredNorm(), static_cast<int64_t>(j));
    }
    const size_t k = std::min<size_t>(kTopN, all.size());
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(k), all.end());
    method.times_s.push_back(timer.ElapsedS());
    method.rankings.emplace_back();
    for (size_t n = 0; n < k; ++n) method.rankings.back().push_back(all[n].second);
  }
  return method;
}

// Hierarchical k-means over the photos so far, rebuilt for each photo, which favours the tree.
// Only the search is timed. FLANN's default of 32 leaves is checked.
Method RunTree(const Vectors& vectors) {
  Method method{"vocabulary tree", {}, {}};
  cv::Mat all;
  for (const auto& vector : vectors) all.push_back(cv::Mat(vector).reshape(1, 1));
  for (int i = 0; i < all.rows; ++i) {
    method.rankings.emplace_back();
    if (i == 0) continue;
    cv::flann::Index tree(all.rowRange(0, i),
                          cv::flann::KMeansIndexParams(kTreeBranching, kTreeIterations));
    const int k = std::min(i, kTopN);
    cv::Mat ids(1, k, CV_32S);
    cv::Mat distances(1, k, CV_32F);
    const Timer timer;
    tree.knnSearch(all.row(i), ids, distances, k, cv::flann::SearchParams(32));
    method.times_s.push_back(timer.ElapsedS());
    for (int j = 0; j < k; ++j) {
      if (ids.at<int>(j) >= 0) method.rankings.back().push_back(ids.at<int>(j));
    }
  }
  return method;
}

// Sums over the photos that have enough predecessors.
struct Score {
  double precision = 0;      // of the 30 returned, how many are in the reference
  double attainable = 0;     // the same if all were found
  double strongest_ten = 0;  // of the ten strongest true pairs, how many are in the 30
  std::vector<double> recall{0, 0, 0, 0};  // of the reference, in the first 5, 10, 20, 30
};

Score Judge(const Method& method, const Reference& reference) {
  static constexpr size_t kDepths[] = {5, 10, 20, 30};
  Score score;
  double hits = 0, possible = 0, returned = 0, true_pairs = 0, strong = 0, strong_found = 0;
  std::vector<double> found(4, 0);
  for (size_t i = kMinPredecessors; i < method.rankings.size(); ++i) {
    const Ranking& ranking = method.rankings[i];
    const Ranking& truth = reference.strongest[i];
    returned += kTopN;
    possible += static_cast<double>(truth.size());
    true_pairs += static_cast<double>(truth.size());
    for (size_t t = 0; t < truth.size(); ++t) {
      const auto at = static_cast<size_t>(std::find(ranking.begin(), ranking.end(), truth[t]) -
                                          ranking.begin());
      const bool is_found = at < ranking.size();
      hits += is_found;
      for (int d = 0; d < 4; ++d) found[d] += at < std::min(kDepths[d], ranking.size());
      strong += t < 10;
      strong_found += t < 10 && is_found;
    }
  }
  score.precision = hits / returned;
  score.attainable = possible / returned;
  score.strongest_ten = strong_found / strong;
  for (int d = 0; d < 4; ++d) score.recall[d] = found[d] / true_pairs;
  return score;
}

void Print(const Method& method, const Reference& reference, double exact_precision) {
  const Score s = Judge(method, reference);
  std::printf("  %-16s %6.2f %6.2f %8.4f  %.3f %.3f %.3f %.3f  %8.4f  %7.3f %7.3f\n",
              method.name.c_str(), 100 * s.precision, 100 * s.precision / s.attainable,
              s.precision / exact_precision, s.recall[0], s.recall[1], s.recall[2], s.recall[3],
              s.strongest_ten, 1e3 * mean(method.times_s), 1e3 * percentile(method.times_s, 95));
}

void Progress(const std::string& what, int64_t done, int64_t total) {
  std::fprintf(stderr, "\r%s %lld/%lld ", what.c_str(), static_cast<long long>(done),
               static_cast<long long>(total));
  if (done == total) std::fprintf(stderr, "\n");
}

std::vector<StudySet> Load(const std::vector<std::string>& arguments, const std::string& cache) {
  std::vector<StudySet> sets;
  for (const auto& argument : arguments) {
    auto set = LoadStudySet(
        argument, cache,
        [what = argument + ": features"](int64_t a, int64_t b) { Progress(what, a, b); });
    if (!set) throw std::runtime_error(set.error());
    sets.push_back(std::move(*set));
  }
  return sets;
}

Codebook TrainWithout(const std::string& name, const std::vector<StudySet>& sets,
                      const TrainingOptions& training) {
  std::vector<LocalFeatures> photos;
  for (const auto& set : sets) {
    if (set.name == name) continue;
    for (const auto& photo : set.photos) photos.push_back(photo.features);
  }
  if (photos.empty())
    throw std::invalid_argument("nothing to train on; give --train or --codebook");
  return TrainCodebook(photos, "without-" + name, training);
}

// Descriptors of a set's photos, and what made them.
struct Described {
  std::string model;
  int dim = 0;
  Vectors vectors;
  double seconds = 0;  // of all photos
};

Described DescribeByVlad(const StudySet& set, const Codebook& codebook) {
  const VladModel model(codebook);
  Described described{"VLAD " + model.id(), model.dim(), {}, 0};
  const Timer timer;
  for (const auto& photo : set.photos) {
    described.vectors.push_back(model.DescribeFeatures(photo.features));
  }
  described.seconds = timer.ElapsedS();
  return described;
}

// Decoding, which extraction has done already, is not timed.
Described DescribeByModel(const StudySet& set, const std::string& onnx_path) {
  ModelChoice choice;
  choice.onnx_path = onnx_path;
  const auto model = LoadModel(choice);
  Described described{onnx_path + " (" + model->id() + ")", model->dim(), {}, 0};
  for (const auto& photo : set.photos) {
    const Bytes bytes = *ReadFile(photo.path);
    const cv::Mat image = *DecodePhoto(bytes);
    const auto header = ReadPhotoHeader(bytes);
    const int orientation = header ? ReadExif(bytes, *header).orientation : 1;
    const Timer timer;
    described.vectors.push_back(model->Describe({image, orientation, nullptr}));
    described.seconds += timer.ElapsedS();
    described.vectors.back().resize(model->dim());  // of a photo that shows nothing
  }
  return described;
}

Reference MatchAll(const StudySet& set, const Options& options) {
  auto inliers = MatchExhaustively(
      set, options.cache, [&](int64_t a, int64_t b) { Progress(set.name + ": reference", a, b); });
  if (!inliers) throw std::runtime_error(inliers.error());
  return MakeReference(*inliers);
}

void Study(const StudySet& set, const Described& described, const Reference& reference) {
  const Vectors& vectors = described.vectors;
  std::printf("%s: %zu photos, %s of %d values, %.1f ms a photo\n", set.name.c_str(),
              set.photos.size(), described.model.c_str(), described.dim,
              1e3 * described.seconds / static_cast<double>(vectors.size()));
  std::printf("  %-16s %6s %6s %8s  %-23s  %8s  %7s %7s\n", "method", "P@30 %", "of max", "/exact",
              "recall @5 @10 @20 @30", "best ten", "mean ms", "p95 ms");
  const Method truth = RunExact(vectors);
  const double exact_precision = Judge(truth, reference).precision;
  Print(truth, reference, exact_precision);
  for (const Method& method : {RunTree(vectors), RunIndex("HNSW", vectors, {}, 0),
                               RunIndex("HNSW, restarted", vectors, {}, 0, vectors.size() / 2)}) {
    Print(method, reference, exact_precision);
  }
  HnswOptions exact;
  exact.exact = true;
  const Method expanded = RunIndex("exact, expanded", vectors, exact, kNumExpanding);
  const double expanded_precision = Judge(expanded, reference).precision;
  Print(expanded, reference, expanded_precision);
  Print(RunIndex("HNSW, expanded", vectors, {}, kNumExpanding), reference, expanded_precision);
}

Codebook CodebookFor(const StudySet& set, const std::vector<StudySet>& sets,
                     const Options& options) {
  if (options.codebook.empty()) return TrainWithout(set.name, sets, options.training);
  auto codebook = LoadCodebook(options.codebook);
  if (!codebook) throw std::invalid_argument(codebook.error());
  return *codebook;
}

void Run(const Options& options) {
  std::vector<StudySet> sets = Load(options.sets, options.cache);
  const size_t num_judged = sets.size();
  for (auto& set : Load(options.train, options.cache)) sets.push_back(std::move(set));
  for (size_t i = 0; i < num_judged; ++i) {
    const StudySet& set = sets[i];
    if (set.photos.size() <= kMinPredecessors) {
      throw std::invalid_argument(set.name + " has too few photos to be judged");
    }
    const Reference reference = MatchAll(set, options);
    Study(set, DescribeByVlad(set, CodebookFor(set, sets, options)), reference);
    for (const std::string& model : options.models) {
      Study(set, DescribeByModel(set, model), reference);
    }
  }
}

}  // namespace
}  // namespace skein::benchmark

int main(int argc, char** argv) {
  skein::benchmark::Options options;
  CLI::App app("Precision, recall and time of retrieval against exhaustive matching.");
  app.add_option("--set", options.sets, "NAME=FOLDER of a set to judge")->required();
  app.add_option("--train", options.train, "NAME=FOLDER of a set to train on only");
  app.add_option("--cache", options.cache, "Folder for features and reference")->required();
  app.add_option("--codebook", options.codebook, "Use this codebook; default: train on other sets");
  app.add_option("--global-model", options.models,
                 "ONNX model to judge beside VLAD, with MODEL.json beside it where it needs one");
  app.add_option("--seed", options.training.seed, "Of the training")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  cv::setNumThreads(1);
  std::printf("commit %s\n", SKEIN_COMMIT);
  try {
    skein::benchmark::Run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "retrieval: %s\n", error.what());
    return 1;
  }
}
