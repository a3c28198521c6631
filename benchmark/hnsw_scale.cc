// The HNSW index from a thousand to a million photos: recall against exact search, time, memory.
// Times are processor time of the one thread there is.
//
// Vectors are drawn like real ones: walks on the unit sphere, one photo a step, each walk one
// place. Directions come from a Gaussian with the covariance of the real descriptors given; step
// lengths from the measured distances of real photos to their nearest earlier neighbour.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <set>

#include "benchmark/retrieval_photos.h"
#include "core/file.h"
#include "core/process.h"
#include "core/statistics.h"
#include "features/vlad.h"
#include "retrieval/hnsw_index.h"

namespace skein::benchmark {
namespace {

using RowMatrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr int kTopN = 30;
constexpr int kWalkLength = 200;
constexpr int kNumQueries = 200;
constexpr int kIntrinsicNeighbours = 10;

// Distances of each row to its nearest neighbours among all, ascending, the row itself left out.
std::vector<std::vector<double>> NearestDistances(const RowMatrix& rows, int k) {
  std::vector<std::vector<double>> result;
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const Eigen::VectorXf d = (rows.rowwise() - rows.row(i)).rowwise().norm();
    std::vector<double> sorted(d.data(), d.data() + d.size());
    sorted.erase(sorted.begin() + i);
    std::partial_sort(sorted.begin(), sorted.begin() + k, sorted.end());
    sorted.resize(k);
    result.push_back(std::move(sorted));
  }
  return result;
}

// Levina and Bickel 2004, averaged as MacKay and Ghahramani propose.
double IntrinsicDimension(const RowMatrix& rows) {
  double sum = 0;
  size_t count = 0;
  for (const auto& d : NearestDistances(rows, kIntrinsicNeighbours)) {
    for (size_t j = 0; j + 1 < d.size(); ++j) {
      if (d[j] <= 0) continue;
      sum += std::log(d.back() / d[j]);
      ++count;
    }
  }
  return static_cast<double>(count) / sum;
}

class VectorSource {
 public:
  VectorSource(const RowMatrix& real, uint64_t seed) : random_(seed) {
    mean_ = real.colwise().mean();
    centred_ = real.rowwise() - mean_;
    for (const auto& d : NearestDistances(real, 1)) steps_.push_back(d[0]);
  }

  // The next photo: a step from the last one, or a new place.
  Eigen::RowVectorXf Next() {
    if (step_++ % kWalkLength == 0) return current_ = (mean_ + Direction()).normalized();
    const double chord = steps_[random_() % steps_.size()];
    const double angle = 2 * std::asin(std::min(1.0, chord / 2));
    Eigen::RowVectorXf side = Direction();
    side -= side.dot(current_) * current_;
    current_ = std::cos(angle) * current_ + std::sin(angle) * side.normalized();
    return current_ = current_.normalized().eval();
  }

 private:
  // Gaussian with the sample covariance: a random combination of the centred rows.
  Eigen::RowVectorXf Direction() {
    Eigen::RowVectorXf weights(centred_.rows());
    for (float& w : weights) w = normal_(random_);
    return weights * centred_ / std::sqrt(static_cast<float>(centred_.rows()));
  }

  std::mt19937_64 random_;
  std::normal_distribution<float> normal_;
  Eigen::RowVectorXf mean_, current_;
  RowMatrix centred_;
  std::vector<double> steps_;
  int64_t step_ = 0;
};

RowMatrix RealDescriptors(const std::vector<std::string>& folders, const std::string& codebook_path,
                          const std::string& cache) {
  auto codebook = LoadCodebook(codebook_path);
  if (!codebook) throw std::invalid_argument(codebook.error());
  const VladModel model(*codebook);
  RowMatrix rows(0, model.dim());
  for (const auto& argument : folders) {
    const size_t equals = argument.find('=');
    if (equals == std::string::npos) throw std::invalid_argument(argument + ": not NAME=FOLDER");
    const auto set = LoadStudySet(argument.substr(0, equals), argument.substr(equals + 1), cache,
                                  [](int64_t, int64_t) {});
    if (!set) throw std::runtime_error(set.error());
    for (const auto& photo : set->photos) {
      const auto values = model.DescribeFeatures(photo.features);
      if (values.empty()) continue;
      rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
      rows.bottomRows(1) = Eigen::Map<const Eigen::RowVectorXf>(values.data(), model.dim());
    }
  }
  return rows;
}

using IdSets = std::vector<std::set<int64_t>>;

IdSets ExactIds(const HnswIndex& index, const std::vector<Eigen::RowVectorXf>& queries) {
  IdSets ids(queries.size());
  for (size_t i = 0; i < queries.size(); ++i) {
    for (const auto& n : index.QueryExact(queries[i].data(), kTopN)) ids[i].insert(n.id);
  }
  return ids;
}

double Recall(const HnswIndex& index, const std::vector<Eigen::RowVectorXf>& queries,
              const IdSets& truth) {
  size_t found = 0;
  for (size_t i = 0; i < queries.size(); ++i) {
    for (const auto& n : index.Query(queries[i].data(), kTopN)) found += truth[i].count(n.id);
  }
  return static_cast<double>(found) / static_cast<double>(queries.size() * kTopN);
}

// Judges by fresh steps of the walk, which are not inserted, then replaces the index by what its
// checkpoint holds: two of a million photos would not fit beside the checkpoint.
void Measure(const std::vector<double>& times_s, int64_t memory_before, VectorSource* source,
             HnswIndex* index) {
  std::vector<Eigen::RowVectorXf> queries;
  for (int i = 0; i < kNumQueries; ++i) queries.push_back(source->Next());
  const size_t size = index->size();
  const double memory = static_cast<double>(ResidentMemoryBytes() - memory_before) / size;
  const IdSets truth = ExactIds(*index, queries);
  const double recall = Recall(*index, queries, truth);
  double start_s = CpuTimeS();
  const size_t dim = index->dim();
  const Bytes bytes = index->Encode();
  const double save_s = CpuTimeS() - start_s;
  *index = HnswIndex(dim, {});
  start_s = CpuTimeS();
  auto loaded = HnswIndex::Decode(bytes, dim, {});
  const double load_s = CpuTimeS() - start_s;
  if (!loaded) throw std::runtime_error(loaded.error());
  *index = std::move(*loaded);
  std::printf("%9zu  %7.3f %7.3f  %9.4f  %8.0f  %8.0f  %8.2f %8.2f  %9.4f\n", size,
              1e3 * percentile(times_s, 50), 1e3 * percentile(times_s, 95), recall, memory,
              static_cast<double>(bytes.size()) / size, save_s, load_s,
              Recall(*index, queries, truth));
  std::fflush(stdout);
}

std::vector<double> NearestOf(const RowMatrix& rows) {
  std::vector<double> nearest;
  for (const auto& d : NearestDistances(rows, 1)) nearest.push_back(d[0]);
  return nearest;
}

void PrintKind(const char* kind, const RowMatrix& rows) {
  const auto nearest = NearestOf(rows);
  std::printf(
      "%5td %s vectors of %td values: intrinsic dimension %.1f, distance to the nearest "
      "%.3f %.3f %.3f (p5, p50, p95)\n",
      rows.rows(), kind, rows.cols(), IntrinsicDimension(rows), percentile(nearest, 5),
      percentile(nearest, 50), percentile(nearest, 95));
}

void Run(const RowMatrix& real, size_t max_size) {
  VectorSource source(real, 1);
  RowMatrix sample(2000, real.cols());
  for (Eigen::Index i = 0; i < sample.rows(); ++i) sample.row(i) = source.Next();
  PrintKind("real", real);
  PrintKind("drawn", sample);
  std::printf("%9s  %-15s  %9s  %8s  %8s  %8s %8s  %9s\n", "photos", "p50, p95 ms", "recall@30",
              "B/photo", "on disk", "save s", "load s", "reloaded");
  ::malloc_trim(0);  // else the index grows into what the photos left
  const int64_t memory_before = ResidentMemoryBytes();
  HnswIndex index(static_cast<size_t>(real.cols()), {});
  std::vector<double> times_s;
  for (size_t next = 1000; index.size() < max_size;) {
    const Eigen::RowVectorXf vector = source.Next();
    const double start_s = CpuTimeS();
    index.Query(vector.data(), kTopN);
    index.Insert(static_cast<int64_t>(index.size()) + 1, vector.data());
    times_s.push_back(CpuTimeS() - start_s);
    if (index.size() < next) continue;
    Measure(times_s, memory_before, &source, &index);
    times_s.clear();
    next *= 10;
  }
}

}  // namespace
}  // namespace skein::benchmark

int main(int argc, char** argv) {
  std::vector<std::string> folders;
  std::string cache;
  std::string codebook = SKEIN_DATA_DIR "/vlad_codebook.bin";
  size_t max_size = 100'000;
  CLI::App app("Recall, time and memory of the HNSW index by its size.");
  app.add_option("--set", folders, "NAME=FOLDER of real photos")->required();
  app.add_option("--cache", cache, "Folder for features")->required();
  app.add_option("--codebook", codebook, "VLAD codebook")->capture_default_str();
  app.add_option("--max-size", max_size, "Largest index")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::printf("commit %s\n", SKEIN_COMMIT);
  try {
    using namespace skein::benchmark;
    Run(RealDescriptors(folders, codebook, cache), max_size);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hnsw_scale: %s\n", error.what());
    return 1;
  }
}
