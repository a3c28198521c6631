// The HNSW index from a thousand to a million photos: recall against exact search, time, memory,
// checkpoint. Each photo is looked up, then inserted, as in the service. Times are processor time
// of the one thread. The vectors are drawn like the real ones given (drawn_descriptors.h).
//
// Recall is that of 200 photos over each stage, looked up but not inserted, against exact search in
// full precision. The vectors are drawn again for it, since memory holds the index alone. A true
// neighbour may be of another place: where a place has too few photos, some of a million others are
// near by chance. The graph has no path to those.
//
// --resume goes on with the index that an interrupted run wrote last. Samples are the same for
// every largest size.
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <numeric>
#include <optional>
#include <random>
#include <set>

#include "benchmark/stages/drawn_descriptors.h"
#include "benchmark/stages/retrieval_photos.h"
#include "core/file.h"
#include "core/hash.h"
#include "core/process.h"
#include "core/statistics.h"
#include "features/vlad.h"
#include "retrieval/hnsw_index.h"
#include "retrieval/retrieval_state.h"

namespace skein::benchmark {
namespace {

constexpr size_t kTopN = 30;
constexpr int64_t kFirstStage = 1000;
constexpr int64_t kNumSamples = 200;  // of a stage up to ten times the one before
constexpr size_t kWritePeriod = 50'000;
constexpr size_t kIntrinsicNeighbours = 10;
constexpr float kNear = 1.25f;  // half of the 30th real neighbours are farther

struct Options {
  std::vector<std::string> sets;  // NAME=FOLDER
  std::string cache;
  std::string codebook = SKEIN_DATA_DIR "/vlad_codebook.bin";
  int64_t max_size = 100'000;
  bool resume = false;
  bool shuffled = false;  // photos of a stage in any order, else place by place
  HnswOptions index;
};

RowMatrix Describe(const VladModel& model, const StudySet& set) {
  RowMatrix rows(0, model.dim());
  for (const auto& photo : set.photos) {
    const auto values = model.DescribeFeatures(photo.features);
    if (values.empty()) continue;
    rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
    rows.bottomRows(1) = Eigen::Map<const Eigen::RowVectorXf>(values.data(), model.dim());
  }
  return rows;
}

std::vector<RowMatrix> RealDescriptors(const Options& options) {
  auto codebook = LoadCodebook(options.codebook);
  if (!codebook) throw std::invalid_argument(codebook.error());
  const VladModel model(std::move(*codebook));
  std::vector<RowMatrix> sets;
  for (const auto& argument : options.sets) {
    const auto set = LoadStudySet(argument, options.cache, [](int64_t, int64_t) {});
    if (!set) throw std::runtime_error(set.error());
    sets.push_back(Describe(model, *set));
  }
  return sets;
}

RowMatrix Stack(const std::vector<RowMatrix>& sets) {
  RowMatrix all(0, sets[0].cols());
  for (const RowMatrix& set : sets) {
    all.conservativeResize(all.rows() + set.rows(), Eigen::NoChange);
    all.bottomRows(set.rows()) = set;
  }
  return all;
}

// Ascending distances of each row to its k nearest among the other rows.
std::vector<std::vector<double>> NearestDistances(const RowMatrix& rows, size_t k) {
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
double IntrinsicDimension(const std::vector<std::vector<double>>& nearest) {
  double sum = 0;
  double count = 0;
  for (const auto& d : nearest) {
    const size_t k = std::min(d.size(), kIntrinsicNeighbours);
    for (size_t j = 0; j + 1 < k; ++j) {
      if (d[j] <= 0) continue;
      sum += std::log(d[k - 1] / d[j]);
      count += 1;
    }
  }
  return count / sum;
}

void PrintKind(const char* kind, const std::vector<std::vector<double>>& nearest) {
  std::printf("%-22s %5.1f ", kind, IntrinsicDimension(nearest));
  for (const size_t rank : {size_t{1}, size_t{10}, kTopN}) {
    std::vector<double> distances;
    for (const auto& d : nearest) {
      if (d.size() >= rank) distances.push_back(d[rank - 1]);
    }
    std::printf("  %.3f %.3f %.3f", percentile(distances, 5), percentile(distances, 50),
                percentile(distances, 95));
  }
  std::printf("\n");
}

void PrintCosinesToOtherSets(const std::vector<RowMatrix>& sets) {
  std::vector<double> cosines;
  for (size_t a = 0; a < sets.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const RowMatrix products = sets[a] * sets[b].transpose();
      cosines.insert(cosines.end(), products.data(), products.data() + products.size());
    }
  }
  std::printf("cosines between sets, p5 p50 p95: %.3f %.3f %.3f\n", percentile(cosines, 5),
              percentile(cosines, 50), percentile(cosines, 95));
}

using Answers = std::vector<std::vector<Neighbour>>;

struct Recall {
  double all = 0, own_place = 0, near = 0;
  double share_own_place = 0;  // of all true neighbours
};

// Of true neighbours that `is_counted`.
template <typename Predicate>
std::pair<double, double> CountFound(const Answers& answers, const ExactNeighbours& truth,
                                     Predicate is_counted) {
  double found = 0, wanted = 0;
  for (size_t i = 0; i < answers.size(); ++i) {
    for (const ExactNeighbour& t : truth[i]) {
      if (!is_counted(i, t)) continue;
      found += std::any_of(answers[i].begin(), answers[i].end(),
                           [&](const Neighbour& n) { return n.id == t.photo; });
      wanted += 1;
    }
  }
  return {found, wanted};
}

struct Lookup {
  Answers answers;
  std::vector<double> times_s;
};

Lookup LookUp(const RowMatrix& queries, const HnswIndex& index) {
  Lookup lookup;
  for (Eigen::Index i = 0; i < queries.rows(); ++i) {
    const double start_s = CpuTimeS();
    lookup.answers.push_back(index.Query(queries.row(i).data(), kTopN));
    lookup.times_s.push_back(CpuTimeS() - start_s);
  }
  return lookup;
}

// As the service writes it, with its checksum. Returns the size in bytes.
size_t Write(const HnswIndex& index, const std::string& path) {
  const Bytes bytes = index.Encode();
  HashBytes(bytes.data(), bytes.size());
  const Status written = WriteFileAtomic(path, bytes);
  if (!written.ok()) throw std::runtime_error(written.error());
  return bytes.size();
}

HnswIndex Read(const std::string& path, size_t dim, const HnswOptions& options) {
  const auto bytes = ReadFile(path);
  if (!bytes) throw std::runtime_error(bytes.error());
  HashBytes(bytes->data(), bytes->size());
  auto index = HnswIndex::Decode(*bytes, dim, options);
  if (!index) throw std::runtime_error(index.error());
  return std::move(*index);
}

std::vector<std::vector<double>> DistancesOf(const ExactNeighbours& neighbours) {
  std::vector<std::vector<double>> distances;
  for (const auto& list : neighbours) {
    distances.emplace_back();
    for (const ExactNeighbour& n : list) distances.back().push_back(n.distance);
  }
  return distances;
}

class Scale {
 public:
  explicit Scale(const Options& options)
      : options_(options), drawn_(PrintReal(RealDescriptors(options)), 1) {
    ::malloc_trim(0);  // else the index grows into what the photos left
    memory_before_ = ResidentMemoryBytes();
    const auto dim = static_cast<size_t>(drawn_.dim());
    if (options_.resume) {
      index_.emplace(Read(Path(), dim, options_.index));
    } else {
      index_.emplace(dim, options_.index);
    }
  }

  void Run() {
    for (int64_t stage = kFirstStage; next_ < options_.max_size; stage *= 10) {
      const std::vector<int64_t> photos = ChooseSamples(stage);
      Insert(photos);
      if (index_->size() == static_cast<size_t>(next_) - left_out_.size()) Report();
    }
    std::filesystem::remove(Path());
  }

 private:
  static std::vector<RowMatrix> PrintReal(std::vector<RowMatrix> sets) {
    const RowMatrix all = Stack(sets);
    std::printf("%td real vectors of %td values; ", all.rows(), all.cols());
    PrintCosinesToOtherSets(sets);
    std::printf("%-22s %5s   %-17s  %-17s  %-17s (p5 p50 p95)\n", "", "dim.", "nearest", "10th",
                "30th");
    PrintKind("real", NearestDistances(all, kTopN));
    return sets;
  }

  std::string Path() const { return options_.cache + "/hnsw_scale.bin"; }

  // Those that are not in it yet.
  void Insert(const std::vector<int64_t>& photos) {
    times_s_.clear();
    for (const int64_t photo : photos) {
      if (index_->Contains(photo)) continue;
      const Eigen::RowVectorXf vector = drawn_.Get(photo);
      const double start_s = CpuTimeS();
      const auto search = index_->Find(vector.data());
      index_->NearestExpanded(search, kTopN, RetrievalOptions().num_expanding);
      index_->Insert(photo, search);
      times_s_.push_back(CpuTimeS() - start_s);
      if (index_->size() % kWritePeriod == 0) Write(*index_, Path());
    }
    // What a stage costs at its size, not on the way there.
    times_s_.erase(times_s_.begin(), times_s_.begin() + static_cast<int64_t>(times_s_.size()) / 2);
  }

  // Of the stage that ends at `stage`, or at the largest size. Returns its other photos, in the
  // order of insertion.
  std::vector<int64_t> ChooseSamples(int64_t stage) {
    const int64_t start = next_;
    const int64_t spacing = std::max<int64_t>(10, (stage - start) / kNumSamples);
    std::vector<int64_t> photos;
    samples_.clear();
    for (; next_ < std::min(stage, options_.max_size); ++next_) {
      const bool is_sample = (next_ - start) % spacing == spacing / 2;
      (is_sample ? samples_ : photos).push_back(next_);
    }
    left_out_.insert(samples_.begin(), samples_.end());
    std::mt19937 random(static_cast<uint32_t>(start));
    if (options_.shuffled) std::shuffle(photos.begin(), photos.end(), random);
    return photos;
  }

  Recall RecallOf(const Answers& answers, const ExactNeighbours& truth) {
    const auto all = CountFound(answers, truth, [](size_t, const auto&) { return true; });
    const auto own = CountFound(answers, truth, [this](size_t i, const ExactNeighbour& t) {
      return drawn_.PlaceOf(t.photo) == drawn_.PlaceOf(samples_[i]);
    });
    const auto near = CountFound(
        answers, truth, [](size_t, const ExactNeighbour& t) { return t.distance < kNear; });
    return {all.first / all.second, own.first / own.second, near.first / near.second,
            own.second / all.second};
  }

  void Report() {
    const double size = static_cast<double>(index_->size());
    const double memory = static_cast<double>(ResidentMemoryBytes() - memory_before_) / size;
    RowMatrix queries(samples_.size(), drawn_.dim());
    for (size_t i = 0; i < samples_.size(); ++i) queries.row(i) = drawn_.Get(samples_[i]);
    const ExactNeighbours truth = FindExactly(&drawn_, queries, next_, left_out_, kTopN);
    PrintKind(("drawn, " + std::to_string(next_)).c_str(), DistancesOf(truth));
    const Lookup lookup = LookUp(queries, *index_);
    const Recall recall = RecallOf(lookup.answers, truth);
    std::printf(
        "%8zu photos: query and insertion p50 %.3f p95 %.3f ms; recall@30 %.4f, of the own place "
        "(%.3f of all) %.4f, of those nearer than %.2f %.4f; %.0f bytes a photo in memory\n",
        index_->size(), 1e3 * percentile(times_s_, 50), 1e3 * percentile(times_s_, 95), recall.all,
        recall.share_own_place, recall.own_place, kNear, recall.near, memory);
    ReportReload(queries, truth);
    std::fflush(stdout);
  }

  // Goes on with the index as read again; two at a time would be too much.
  void ReportReload(const RowMatrix& queries, const ExactNeighbours& truth) {
    const std::string path = Path();
    const size_t dim = index_->dim();
    double start_s = CpuTimeS();
    const size_t size_bytes = Write(*index_, path);
    std::printf("         checkpoint: %.0f bytes a photo, written in %.2f s\n",
                static_cast<double>(size_bytes) / static_cast<double>(index_->size()),
                CpuTimeS() - start_s);
    HnswOptions other = options_.index;
    for (const size_t factor : {4, 2, 1}) {
      other.ef_search = factor * options_.index.ef_search;
      index_.reset();
      start_s = CpuTimeS();
      index_.emplace(Read(path, dim, other));
      const double read_s = CpuTimeS() - start_s;
      const Lookup lookup = LookUp(queries, *index_);
      const Recall recall = RecallOf(lookup.answers, truth);
      std::printf(
          "         read in %.2f s; ef %zu: recall@30 %.4f, of the own place %.4f, query p50 %.3f, "
          "p95 %.3f ms\n",
          read_s, SearchBreadth(other.ef_search, index_->size()), recall.all, recall.own_place,
          1e3 * percentile(lookup.times_s, 50), 1e3 * percentile(lookup.times_s, 95));
    }
  }

  Options options_;
  DrawnDescriptors drawn_;
  int64_t memory_before_ = 0;
  std::optional<HnswIndex> index_;
  std::vector<double> times_s_;
  int64_t next_ = 0;              // photo
  std::vector<int64_t> samples_;  // of this stage
  std::set<int64_t> left_out_;    // of all stages
};

}  // namespace
}  // namespace skein::benchmark

int main(int argc, char** argv) {
  skein::benchmark::Options options;
  CLI::App app("Recall, time and memory of the HNSW index by its size.");
  app.add_option("--set", options.sets, "NAME=FOLDER of real photos")->required();
  app.add_option("--cache", options.cache, "Folder for features and the index's file")->required();
  app.add_option("--codebook", options.codebook, "VLAD codebook")->capture_default_str();
  app.add_option("--max-size", options.max_size, "Largest index")
      ->check(CLI::Range(int64_t{1000}, int64_t{100'000'000}))
      ->capture_default_str();
  app.add_option("--ef", options.index.ef_search, "Breadth of search")->capture_default_str();
  app.add_option("--ef-construction", options.index.ef_construction, "Breadth of insertion")
      ->capture_default_str();
  app.add_flag("--resume", options.resume, "Go on with the index in the cache folder");
  app.add_flag("--shuffled", options.shuffled,
               "Insert the photos of a stage in any order, not place by place");
  CLI11_PARSE(app, argc, argv);
  std::printf("commit %s\n", SKEIN_COMMIT);
  try {
    skein::benchmark::Scale(options).Run();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "hnsw_scale: %s\n", error.what());
    return 1;
  }
}
