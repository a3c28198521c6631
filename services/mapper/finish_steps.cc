#include "mapper/finish_steps.h"

#include <cmath>
#include <utility>
#include <vector>

#include "mapper/submap_run.h"
#include "merging/submap_merge.h"
#include "session/places.h"
#include "session/read_session.h"
#include "session/submap_steps.h"

namespace skein {
namespace {

Submap::Absorb AbsorbInto(Submap* submap, const Submap::EventSink& sink) {
  return [submap, sink](const Submap& anew) {
    const Absorption absorption = AbsorbBatch(anew, submap);
    for (const PhotoEvent& event : absorption.events) sink(event);
    return absorption.status.ok();
  };
}

// ", about 12 s"; "" for less than half a second.
std::string About(double seconds) {
  return seconds < 0.5 ? "" : ", about " + std::to_string(std::lround(seconds)) + " s";
}

}  // namespace

bool FinishSteps::IsFinal() const {
  const FinishState& finish = session_.finish();
  return finish.state == finish_t::SETTLED && run_.worked_seq() >= finish.settled_seq;
}

// The finish was cut, and did without this submap.
bool FinishSteps::IsOver(const Item& item) const {
  return !session_.finishing() || FinishId() != item.id;
}

void FinishSteps::Consolidate() {
  const std::string step = ConsolidationStep(FinishId());
  if (run_.IsLeftOut(step)) return run_.Pump();
  Tell("consolidates" + About(consolidate_s_));
  run_.RunJob(
      step,
      [by_place = IsMappedWithItsPlace()](Submap& submap, SubmapRun::Outcome* outcome) {
        const Submap::EventSink sink = outcome->Sink();
        submap.Consolidate(sink, {!by_place, AbsorbInto(&submap, sink)});
      },
      [&run = run_](const SubmapRun::Outcome& outcome) { run.Apply(outcome); });
}

// In a finish a place is mapped again once: by BATCH where it has several maps, else with its map's
// first consolidation.
bool FinishSteps::IsMappedWithItsPlace() const {
  return session_.finish().batch_seq > 0 ||
         IsOfDividedPlace(FindPlaces(session_), run_.submap_id());
}

void FinishSteps::Do(const Item& item) {
  if (IsOver(item)) return;
  if (item.kind == Item::Kind::kDrained) Consolidate();
  if (item.kind == Item::Kind::kBatch) MapAsBatch(item);
  if (item.kind == Item::Kind::kSettled) Finish(item);
}

void FinishSteps::MapAsBatch(const Item& item) {
  const std::string step = BatchStep(item.id);
  if (run_.IsLeftOut(step)) return;
  const std::vector<Place> places = FindPlaces(session_);
  const Place* place = FindDividedPlace(places, run_.submap_id());
  if (place == nullptr) return;
  std::vector<std::vector<int64_t>> others;
  for (const int64_t id : place->submaps) {
    if (id != run_.submap_id()) others.push_back(session_.RegisteredIn(id));
  }
  run_.LoadPhotos(place->photos, [this, step, others,
                                  num = place->photos.size()](const FetchedPhotos& photos) {
    Tell("maps " + std::to_string(num) + " photos anew as a batch");
    run_.RunJob(
        step,
        [photos, others](Submap& submap, SubmapRun::Outcome* outcome) {
          AddToSubmap(photos, &submap);
          submap.MapAsBatch({true, others, AbsorbInto(&submap, outcome->Sink())}, outcome->Sink());
        },
        [&run = run_](const SubmapRun::Outcome& outcome) { run.Apply(outcome); });
  });
}

void FinishSteps::Finish(const Item& item) {
  if (session_.FindSubmap(run_.submap_id())->final_ledger_seq >= item.seq) return;
  const std::string step = FinalStep(item.id);
  if (run_.IsLeftOut(step)) return run_.AskForFinal();
  Tell("final adjustment" + About(finish_s_));
  run_.RunJob(
      step,
      [by_place = IsMappedWithItsPlace()](Submap& submap, SubmapRun::Outcome* outcome) {
        const Submap::EventSink sink = outcome->Sink();
        submap.Finish(sink, {!by_place, AbsorbInto(&submap, sink)});
      },
      [&run = run_](const SubmapRun::Outcome& outcome) {
        run.Report(outcome.events);
        run.AskForFinal();
      });
}

void FinishSteps::Assess(std::function<void(std::optional<ModelAssessment>)> then) {
  const std::string step = AssessmentStep(FinishId());
  if (run_.IsLeftOut(step)) return then(std::nullopt);
  run_.RunOnWorker(
      step,
      [photos = FactsOfPhotos(), target_gsd_mm = target_gsd_mm_](Submap& submap) {
        return AssessModel(submap.map().reconstruction(), photos, target_gsd_mm);
      },
      std::move(then));
}

// Up to SETTLED, so that all final models of a finish lie in one frame on the earth.
PhotoFacts FinishSteps::FactsOfPhotos() const {
  return {PositionsOf(session_, session_.finish().settled_seq), TexturesOf(session_)};
}

void FinishSteps::Tell(std::string doing) {
  doing_ = std::move(doing);
  run_.PublishStatus();
}

void FinishSteps::OnJobOver(double consolidate_s, double finish_s) {
  doing_.clear();
  consolidate_s_ = consolidate_s;
  finish_s_ = finish_s;
}

}  // namespace skein
