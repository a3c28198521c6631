#pragma once

// In which order a photo is matched with its candidates, and when that is enough.
//
// Verified pairs speak for their neighbours: when v was tried, a photo c that shares much with v
// should fare as v did. With strength(n) = n / (n + 50) of a pair of n inliers (0 if not verified;
// 50 is where the paper takes photos for overlapping), expected(c) is the mean of
//   strength(photo, v), weighted by strength(v, c), over all v tried so far,
// and of a small prior by c's rank in retrieval. First comes who should have most inliers:
//   expected(c) * max_v min(inliers(photo, v), inliers(v, c)),
// the latter being the points that a chain photo - v - c can carry; then those of whom nothing is
// known yet, in the order of retrieval. A photo that retrieval did not name joins when it should
// overlap.
//
// One of the first num_sure candidates is left out only on evidence, never for its rank: tried
// photos must speak for it with a total weight of min_evidence, and say either that it would fail
// (expected below min_expected) or, once the photo has min_strong overlapping pairs, that it is
// implied: chains photo - v - c carry its points already, with
//   1 - prod_v (1 - strength(photo, v) strength(v, c)) >= max_implied.
// So photos of another place or walk, of which the tried ones know nothing, are always tried. The
// candidates after num_sure are such a try, too, while the photo has fewer than few_strong
// overlapping pairs; then only, like photos that retrieval did not name, if they should overlap.
// With nothing known of any pair and few that overlap this is plain matching in the order of
// retrieval.

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "covisibility/covisibility.h"

namespace skein {

struct SecondLookOptions {
  bool enabled = true;  // off: all candidates, in their order
  size_t batch = 2;     // pairs matched before the next decision
  double prior_weight = 0.5;
  size_t num_sure = 20;
  size_t few_strong = 6;             // pairs of at least 50 inliers
  double min_evidence = 0.5;         // as one tried photo of 50 common inliers gives
  double min_expected = 0.23;        // of the 15 inliers that keep a pair
  double min_expected_joined = 0.5;  // of 50 inliers
  size_t min_strong = 12;            // pairs of at least 50 inliers
  double max_implied = 0.5;
  size_t max_joined = 10;  // photos that retrieval did not name

  // Throws std::invalid_argument.
  void Check() const;
};

// The order for one photo: a function of its candidates, the outcomes told, and the graph up to
// `seq`, or up to where Advance went. The graph must outlive it; what is later in it is not seen.
class SecondLook {
 public:
  // `candidates`: best first, each once, without the photo. `may_join`: whether a photo that
  // retrieval did not name may be matched; true of earlier photos only, so that each pair is
  // matched once.
  using MayJoin = std::function<bool(int64_t)>;
  SecondLook(const std::vector<int64_t>& candidates, const CovisibilityGraph& graph, int64_t seq,
             MayJoin may_join, const SecondLookOptions& options);

  // The next photos to match; empty when it is enough. Call Tell for each before the next call.
  std::vector<int64_t> Next() const { return Best(options_.batch); }
  // The first `count` in order as known now. One of whom nothing is known waits for those before it
  // that will speak for it.
  std::vector<int64_t> Best(size_t count) const;
  // 0 inliers: not verified, or cannot be matched.
  void Tell(int64_t other_id, int32_t num_inliers);
  // Sees the graph up to `seq` from now on: other photos' pairs that became known while this one is
  // worked on. An older one changes nothing.
  void Advance(int64_t seq);

  int64_t seq() const { return seq_; }
  size_t num_tried() const { return told_.size(); }

 private:
  struct Candidate {
    double prior = 0;
    bool named = false;  // by retrieval
    size_t rank = 0;     // in retrieval, if named
    bool tried = false;
    double weight = 0;       // sum of strength(v, c)
    int32_t bottleneck = 0;  // max of min(inliers(photo, v), inliers(v, c))
    double weighted = 0;     // sum of strength(v, c) strength(photo, v)
    double not_implied = 1;  // product of 1 - the same
  };

  struct Outcome {
    int64_t other_id = 0;
    int32_t num_inliers = 0;
  };

  // What the edges of a tried photo after `after_seq` say of their other photos.
  void Learn(const Outcome& outcome, int64_t after_seq);
  bool IsInformed(const Candidate& c) const { return c.weight >= options_.min_evidence; }
  double Expected(const Candidate& candidate) const;
  double ExpectedInliers(const Candidate& candidate) const;
  std::vector<int64_t> WorthwhileBestFirst() const;
  bool IsWorthwhile(const Candidate& candidate) const;

  const CovisibilityGraph& graph_;
  int64_t seq_;
  MayJoin may_join_;
  SecondLookOptions options_;
  std::unordered_map<int64_t, Candidate> candidates_;
  std::vector<int64_t> order_;  // ids of candidates_, as they came up
  std::vector<Outcome> told_;
  size_t num_strong_ = 0;
  size_t num_joined_ = 0;  // tried ones that retrieval did not name
};

}  // namespace skein
