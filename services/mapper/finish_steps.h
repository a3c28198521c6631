#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "mapper/item_log.h"
#include "mapper/model_assessment.h"
#include "session/session_state.h"

namespace skein {

class SubmapRun;

// The steps of a finish on a run's submap. At DRAINED the map is consolidated. At BATCH the largest
// map of a place that has several takes all photos of the place and is mapped again. At SETTLED,
// after the last merge, the map is consolidated and finished, and the run asked for the final
// model. A step that failed three times is left out. Loop's thread only; a part of the run.
class FinishSteps {
 public:
  // target_gsd_mm: of the final model's completeness, see AssessModel.
  FinishSteps(const SessionState& session, double target_gsd_mm, SubmapRun& run)
      : session_(session), target_gsd_mm_(target_gsd_mm), run_(run) {}

  bool IsCut() const { return session_.finish().is_cut(); }
  // The final model stands: what is offered now waits until the finish is over.
  bool IsFinal() const;

  // An item of the ledger that tells of a finish.
  void Do(const Item& item);

  // Before the final model is written: how complete its place is and where it lies. nullopt if that
  // step is left out: the model is written all the same.
  void Assess(std::function<void(std::optional<ModelAssessment>)> then);

  // The step that the worker is at, in words; "" if at none.
  const std::string& doing() const { return doing_; }
  // A job of the run is over. Both times are rough, if that step came next.
  void OnJobOver(double consolidate_s, double finish_s);

 private:
  int64_t FinishId() const { return session_.finish().finish_id; }
  bool IsOver(const Item& item) const;
  bool IsMappedWithItsPlace() const;
  void Consolidate();
  void MapAsBatch(const Item& item);
  void Finish(const Item& item);
  PhotoFacts FactsOfPhotos() const;
  void Tell(std::string doing);

  const SessionState& session_;
  const double target_gsd_mm_;
  SubmapRun& run_;
  std::string doing_;
  double consolidate_s_ = 0, finish_s_ = 0;  // as of the last job
};

}  // namespace skein
