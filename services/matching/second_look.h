#pragma once

// The order in which a photo is matched with its candidates, and where it ends.
//
// Verified pairs predict their neighbours: when v was tried, a photo c that overlaps with v should
// do as v did. A pair of n inliers has
//
//   strength(n) = n / (n + 50), 0 if not verified; 50 inliers are overlap in the paper.
//
// v speaks for the part of c that it shows, of c's best known pair:
//
//   weight(v, c) = strength(v, c) inliers(v, c) / max_u inliers(u, c).
//
// Over all tried v and a small prior by c's rank in retrieval
//
//   expected(c) = weighted mean of strength(photo, v), weights weight(v, c),
//   carried(c)  = max_v min(inliers(photo, v), inliers(v, c)),
//
// carried(c): number of points that a chain photo - v - c can carry. Candidates come by falling
// expected(c) * carried(c), then the unknown ones in the order of retrieval. A photo that is no
// candidate joins them if it is expected to overlap.
//
// One of the first kNumSure candidates is left out for two reasons only, with a total weight of at
// least kMinEvidence:
//  - It would fail: expected(c) < kMinExpected.
//  - It is implied: the photo has kMinStrong overlapping pairs, and
//     1 - prod_v (1 - strength(photo, v) weight(v, c)) >= kMaxImplied.
//
// So candidates that the tried photos know nothing about, such as those of another walk, are always
// tried. The shortlist is retrieval's first kShortlist = 30 candidates. Shortlisted candidates
// after kNumSure are tried while the photo has fewer than kFewStrong overlapping pairs. Candidates
// after the shortlist are tried only if they are expected to overlap. With no known pair the
// shortlist is matched in the order of retrieval. The constants stand in second_look.cc.
//
// A photo may be lonely then: fewer than kNumConnected overlapping pairs. ToCompare() names the
// candidates that were not tried although one of the two photos is lonely. coarse_search.h finds
// the best of them by their features, and these are matched, too: global descriptors say little
// about bare walls or photos that overlap by a corner.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <unordered_map>
#include <vector>

#include "covisibility/covisibility.h"

namespace skein {

// The order for one photo. The order is a function of the candidates, the outcomes, and the graph
// up to `seq` or Advance's seq. The order in which pairs in work end does not matter: a choice
// rests on the outcomes of all but the last kMaxInWork - 1, or of more if these leave none. The
// graph must outlive it.
class SecondLook {
 public:
  // `candidates`: best first, each once, without the photo. `may_join`: whether a photo outside of
  // them may be matched. `may_join` is true of earlier photos only, so each pair is matched once.
  // Not `enabled`: all candidates, in their order.
  using MayJoin = std::function<bool(int64_t)>;
  SecondLook(const std::vector<int64_t>& candidates, const CovisibilityGraph& graph, int64_t seq,
             MayJoin may_join, bool enabled);

  // The next photo to match, which is in work from then on. nullopt: call Tell for a photo in work
  // first; if none is in work, the photo has enough pairs.
  std::optional<int64_t> Take();
  // The first `count` to take in order as known now. A candidate without enough evidence waits
  // while a verified neighbour of it is in work or comes before it.
  std::vector<int64_t> Best(size_t count) const;
  // Once Take has ended: candidates that were not tried although one of the two photos is lonely,
  // best first.
  std::vector<int64_t> ToCompare() const;
  // Take gives these candidates next, whatever is expected of them. Ignored if they were taken.
  void Choose(const std::vector<int64_t>& ids);
  // The outcome of one in work, 0 inliers: not verified, or cannot be matched. Throws
  // std::invalid_argument if it is not in work.
  void Tell(int64_t other_id, int32_t num_inliers);
  // Reads the graph up to `seq` from now on, with pairs that other workers verified meanwhile. A
  // lower seq changes nothing.
  void Advance(int64_t seq);

  int64_t seq() const { return seq_; }
  size_t num_tried() const { return told_.size(); }
  size_t num_in_work() const { return in_work_.size(); }

 private:
  struct Candidate {
    double prior = 0;
    bool shortlisted = false;  // among retrieval's first kShortlist
    size_t rank = 0;           // in retrieval; 0 for a photo that joined
    bool taken = false;
    bool chosen = false;     // see Choose
    double weight = 0;       // sum of weight(v, c)
    int32_t bottleneck = 0;  // max of min(inliers(photo, v), inliers(v, c))
    double weighted = 0;     // sum of weight(v, c) strength(photo, v)
    double not_implied = 1;  // product of 1 - the same
  };

  struct Outcome {
    int64_t other_id = 0;
    int32_t num_inliers = 0;
  };
  struct InWork {
    int64_t other_id = 0;
    std::optional<int32_t> num_inliers;  // once it is told
  };

  // Learns from the first in work, whose outcome is told.
  void LearnFirstInWork();
  // Adds the evidence of a tried photo's edges after `after_seq` to their other photos.
  void Learn(const Outcome& outcome, int64_t after_seq);
  // weight(v, c) of v's `edge` to c.
  double WeightOf(const CovisibilityGraph::Edge& edge) const;
  static bool IsInformed(const Candidate& candidate);
  static double Expected(const Candidate& candidate);
  static double ExpectedInliers(const Candidate& candidate);
  std::vector<int64_t> WorthwhileBestFirst() const;
  bool IsWorthwhile(const Candidate& candidate) const;
  bool IsLonely(int64_t image_id) const;

  const CovisibilityGraph& graph_;
  int64_t seq_;
  MayJoin may_join_;
  bool enabled_;
  std::unordered_map<int64_t, Candidate> candidates_;
  std::vector<int64_t> order_;  // ids of candidates_, as they came up
  std::deque<InWork> in_work_;  // as they were taken, told or not, but not learned from
  std::vector<Outcome> told_;
  size_t num_strong_ = 0;
  size_t num_joined_ = 0;  // taken ones outside of the shortlist
};

}  // namespace skein
