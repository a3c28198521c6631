#include "mapping/photo_trial.h"

#include <algorithm>
#include <utility>

#include "core/clock.h"
#include "mapping/misplaced.h"

namespace skein {
namespace {

Verdict Undoing(Refusal refusal) { return {Verdict::Decision::kUndo, std::move(refusal), {}}; }

}  // namespace

PhotoTrial::PhotoTrial(const TrialContext& context, ImageId id, SceneMap* map)
    : context_(context), id_(id), map_(*map), start_s_(MonotonicS()) {}

double PhotoTrial::total_s() const { return MonotonicS() - start_s_; }

bool PhotoTrial::FindPose(FoundPoses* found) {
  visible_ = FindVisiblePoints(map_, id_);
  estimate_ = found != nullptr ? found->Estimate(map_, id_, visible_, context_)
                               : EstimatePose(map_, id_, visible_, context_);
  register_s_ = total_s();
  return estimate_.ok;
}

void PhotoTrial::Place() {
  const double before_s = MonotonicS();
  placement_.emplace(estimate_, visible_, id_, &map_);
  triangulate_s_ = MonotonicS() - before_s;
}

Verdict PhotoTrial::Judge() const {
  if (!IsDetermined(placement_->sigmas())) {
    return Undoing({Refusal::Cause::kTooFewCommonPoints, "pose badly determined by its inliers"});
  }
  if (!placement_->AgreesWithMatches()) return JudgeAgainstNeighbours();
  return {};
}

// Many matches contradict the photo's pose. These may be of similar structures, as of the four
// equal sides of a plinth. Else, of the photo and the photos that its matches lead to, those with
// more agreeing matches stay.
Verdict PhotoTrial::JudgeAgainstNeighbours() const {
  if (OnlySimilarStructuresContradict(map_, {id_})) return {};
  std::vector<ImageId> misplaced = FindMisplacedAround(map_, id_);
  const bool is_misplaced = std::count(misplaced.begin(), misplaced.end(), id_) > 0;
  if (misplaced.empty() || is_misplaced) {
    return Undoing({Refusal::Cause::kContradicted, "pose disagrees with the verified matches"});
  }
  return {Verdict::Decision::kKeepAfterWithdrawing, {}, std::move(misplaced)};
}

void PhotoTrial::Undo() {
  if (placement_) placement_->Undo();
  placement_.reset();
}

}  // namespace skein
