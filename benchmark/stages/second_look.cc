// Pairs that SecondLook saves and pairs that it loses, replayed on exhaustively matched photos.
//
// The photos arrive in the order given, faster than they are matched. Each asks retrieval for 30
// candidates. A free worker takes the next photo and works through them by SecondLook. A pair's
// outcome is read from the exhaustive matching. Every pair takes the same time. All workers know a
// pair's outcome one pair's time after its photo's last one.
#include "matching/second_look.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <deque>
#include <functional>
#include <numeric>
#include <optional>
#include <random>

#include "benchmark/stages/retrieval_photos.h"
#include "features/vlad.h"
#include "retrieval/hnsw_index.h"
#include "retrieval/retrieval_state.h"

namespace skein::benchmark {
namespace {

constexpr int32_t kOverlapping = 50;
constexpr size_t kStrongest = 10;
constexpr int kNumShuffles = 3;  // random orders besides the names'

struct Options {
  std::vector<std::string> sets;  // NAME=FOLDER
  std::string cache;
  std::string codebook = SKEIN_DATA_DIR "/vlad_codebook.bin";
  int num_workers = 1;
  bool second_look = true;
};

// One set in one order of arrival.
struct Session {
  std::vector<std::vector<float>> vectors;
  InlierCounts inliers;  // [i][j], j < i
};

struct Score {
  double matched = 0, verified = 0, inliers = 0, overlapping = 0;
  double strongest = 0, strongest_wanted = 0;
  int num_apart = 0;  // photos outside the largest connected component
  int num_weak = 0;   // photos that lost their strongest pairs
};

Session Arrange(const StudySet& set, const VladModel& model, const InlierCounts& inliers,
                const std::vector<size_t>& order) {
  Session session;
  for (size_t i = 0; i < order.size(); ++i) {
    session.vectors.push_back(model.DescribeFeatures(set.photos[order[i]].features));
    session.inliers.emplace_back();
    for (size_t j = 0; j < i; ++j) {
      const auto [a, b] = std::minmax(order[i], order[j]);
      session.inliers[i].push_back(inliers[b][a]);
    }
  }
  return session;
}

// Photos at work at the same time. Times are in pairs.
class Workers {
 public:
  Workers(const Session& session, const std::vector<std::vector<int64_t>>& candidates,
          const Options& options)
      : session_(session),
        candidates_(candidates),
        options_(options),
        matched_(candidates.size()),
        workers_(options.num_workers) {}

  // Of each photo, those it was matched with.
  std::vector<std::vector<int64_t>> Run() {
    for (Worker* worker = Next(); worker; worker = Next()) {
      if (worker->look) {
        Step(worker);
      } else {
        Take(worker);
      }
    }
    return std::move(matched_);
  }

 private:
  struct Worker {
    int64_t now = 0;
    int64_t photo = 0;
    std::optional<SecondLook> look;  // while it works on a photo
    std::deque<int64_t> in_work;
  };

  // The worker that is next; null if no photo is left.
  Worker* Next() {
    Worker* next = nullptr;
    const bool any_left = next_photo_ < static_cast<int64_t>(candidates_.size());
    for (Worker& worker : workers_) {
      if (!worker.look && !any_left) continue;
      if (!next || worker.now < next->now) next = &worker;
    }
    return next;
  }

  void Take(Worker* worker) {
    const int64_t photo = next_photo_++;
    worker->photo = photo;
    worker->look.emplace(
        candidates_[photo], graph_, worker->now, [photo](int64_t other) { return other < photo; },
        options_.second_look);
  }

  void Step(Worker* worker) {
    worker->look->Advance(worker->now);
    while (const auto other = worker->look->Take()) {
      worker->in_work.push_back(*other);
      matched_[worker->photo].push_back(*other);
    }
    if (worker->in_work.empty()) return Finish(worker);
    const int64_t other = worker->in_work.front();
    worker->in_work.pop_front();
    worker->look->Tell(other, session_.inliers[worker->photo][other]);
    ++worker->now;
  }

  void Finish(Worker* worker) {
    const int64_t photo = worker->photo;
    for (const int64_t other : matched_[photo]) {
      const int32_t inliers = session_.inliers[photo][other];
      if (inliers > 0) graph_.Add(photo, other, inliers, worker->now + 1);
    }
    worker->look.reset();
  }

  const Session& session_;
  const std::vector<std::vector<int64_t>>& candidates_;
  const Options& options_;
  CovisibilityGraph graph_;  // positions are times
  std::vector<std::vector<int64_t>> matched_;
  std::vector<Worker> workers_;
  int64_t next_photo_ = 0;
};

int CountApart(const std::vector<std::vector<int64_t>>& neighbours) {
  std::vector<size_t> root(neighbours.size());
  std::iota(root.begin(), root.end(), 0);
  const std::function<size_t(size_t)> find = [&](size_t i) {
    return root[i] == i ? i : root[i] = find(root[i]);
  };
  for (size_t i = 0; i < root.size(); ++i) {
    for (const int64_t j : neighbours[i]) root[find(i)] = find(j);
  }
  std::vector<int> sizes(root.size(), 0);
  for (size_t i = 0; i < root.size(); ++i) ++sizes[find(i)];
  return static_cast<int>(root.size()) - *std::max_element(sizes.begin(), sizes.end());
}

void AddStrongest(const std::vector<int32_t>& inliers, const std::vector<int64_t>& matched,
                  Score* score) {
  std::vector<int64_t> strongest(inliers.size());
  std::iota(strongest.begin(), strongest.end(), 0);
  std::stable_sort(strongest.begin(), strongest.end(),
                   [&](int64_t a, int64_t b) { return inliers[a] > inliers[b]; });
  if (strongest.size() > kStrongest) strongest.resize(kStrongest);
  for (const int64_t other : strongest) {
    if (inliers[other] <= kOverlapping) continue;
    score->strongest_wanted += 1;
    score->strongest += std::count(matched.begin(), matched.end(), other);
  }
}

// Whether the strongest matched pair has less than half of the strongest's inliers.
bool IsWeak(const std::vector<int32_t>& inliers, const std::vector<int64_t>& matched) {
  int32_t most = 0;
  for (const int64_t other : matched) most = std::max(most, inliers[other]);
  const auto strongest = std::max_element(inliers.begin(), inliers.end());
  return strongest != inliers.end() && *strongest > std::max(kOverlapping, 2 * most);
}

// Of each photo, as the service answers.
std::vector<std::vector<int64_t>> Retrieve(const Session& session) {
  const RetrievalOptions options;
  HnswIndex index(session.vectors[0].size(), {});
  std::vector<std::vector<int64_t>> candidates(session.vectors.size());
  for (size_t i = 0; i < session.vectors.size(); ++i) {
    const auto search = index.Find(session.vectors[i].data());
    for (const auto& n : index.NearestExpanded(search, options.top_n, options.num_expanding)) {
      candidates[i].push_back(n.id);
    }
    index.Insert(static_cast<int64_t>(i), search);
  }
  return candidates;
}

Score Replay(const Session& session, const Options& options) {
  Score score;
  const auto candidates = Retrieve(session);
  const auto matched = Workers(session, candidates, options).Run();
  std::vector<std::vector<int64_t>> verified(matched.size());
  for (size_t i = 0; i < matched.size(); ++i) {
    score.matched += static_cast<double>(matched[i].size());
    for (const int64_t other : matched[i]) {
      const int32_t inliers = session.inliers[i][other];
      if (inliers == 0) continue;
      verified[i].push_back(other);
      score.verified += 1;
      score.inliers += inliers;
      score.overlapping += inliers > kOverlapping;
    }
    AddStrongest(session.inliers[i], matched[i], &score);
    score.num_weak += IsWeak(session.inliers[i], matched[i]);
  }
  score.num_apart = CountApart(verified);
  return score;
}

void Print(const char* method, const Score& score, const Score& plain) {
  std::printf("  %-12s %7.0f %6.3f  %7.0f %6.3f  %6.3f  %6.3f  %6.3f  %5d  %4d\n", method,
              score.matched, score.matched / plain.matched, score.verified,
              score.verified / plain.verified, score.overlapping / plain.overlapping,
              score.inliers / plain.inliers, score.strongest / score.strongest_wanted,
              score.num_apart, score.num_weak);
}

void Study(const StudySet& set, const VladModel& model, const InlierCounts& inliers,
           const Options& options) {
  std::vector<size_t> order(set.photos.size());
  std::iota(order.begin(), order.end(), 0);
  for (int shuffle = 0; shuffle <= kNumShuffles; ++shuffle) {
    const std::string name = shuffle == 0 ? "name" : "shuffle " + std::to_string(shuffle);
    std::printf("%s, %zu photos, order: %s\n", set.name.c_str(), order.size(), name.c_str());
    if (shuffle > 0) {
      std::mt19937 random(shuffle);
      std::shuffle(order.begin(), order.end(), random);
    }
    const Session session = Arrange(set, model, inliers, order);
    Options plain_options = options;
    plain_options.second_look = false;
    const Score plain = Replay(session, plain_options);
    Print("plain", plain, plain);
    Print("second look", Replay(session, options), plain);
  }
}

void Run(const Options& options) {
  auto codebook = LoadCodebook(options.codebook);
  if (!codebook) throw std::invalid_argument(codebook.error());
  const VladModel model(std::move(*codebook));
  std::printf("  %-12s %7s %6s  %7s %6s  %6s  %6s  %6s  %5s  %4s\n", "pairs:", "matched", "share",
              "verif.", "share", "> 50", "inlrs", "best10", "apart", "weak");
  for (const auto& argument : options.sets) {
    const auto set = LoadStudySet(argument, options.cache, [](int64_t, int64_t) {});
    if (!set) throw std::runtime_error(set.error());
    const auto inliers = MatchExhaustively(*set, options.cache, [](int64_t, int64_t) {});
    if (!inliers) throw std::runtime_error(inliers.error());
    Study(*set, model, *inliers, options);
  }
}

}  // namespace
}  // namespace skein::benchmark

int main(int argc, char** argv) {
  skein::benchmark::Options options;
  CLI::App app("Pairs that the second look spares and loses, against plain top-30.");
  app.add_option("--set", options.sets, "NAME=FOLDER of photos")->required();
  app.add_option("--cache", options.cache, "Folder for features and pairs")->required();
  app.add_option("--codebook", options.codebook, "VLAD codebook")->capture_default_str();
  app.add_option("--workers", options.num_workers, "Photos at work at the same time")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  std::printf("commit %s\n", SKEIN_COMMIT);
  try {
    skein::benchmark::Run(options);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "second_look: %s\n", error.what());
    return 1;
  }
}
