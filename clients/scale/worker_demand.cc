#include "clients/scale/worker_demand.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace skein {
namespace {

double MeanS(const StageTimes& times, const std::string& stage) {
  const auto done = times.by_stage.find(stage);
  if (done == times.by_stage.end() || done->second.empty()) return kUnknownItemS;
  return times.sum_s.at(stage) / static_cast<double>(done->second.size());
}

}  // namespace

WorkerDemand DemandOf(const SessionTally& tally, const StageTimes& times) {
  const int64_t features = tally.NumIn(PhotoPhase::kFeatures);
  const int64_t matching =
      features + tally.NumIn(PhotoPhase::kRetrieval) + tally.NumIn(PhotoPhase::kMatching);
  return {matching, static_cast<double>(features) * MeanS(times, "features") +
                        static_cast<double>(matching) * MeanS(times, "matching")};
}

int NumWanted(double work_s, double target_s, int min, int max) {
  return static_cast<int>(std::clamp<double>(std::ceil(work_s / target_s), min, max));
}

}  // namespace skein
