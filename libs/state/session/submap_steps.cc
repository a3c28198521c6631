#include "session/submap_steps.h"

#include <set>

namespace skein {

std::string PhotoStep(int64_t image_id) { return "photo " + std::to_string(image_id); }
std::string MergeStep(int64_t merge_id) { return "merge " + std::to_string(merge_id); }
std::string ComparisonStep(int64_t other_submap) {
  return "comparison with " + std::to_string(other_submap);
}
std::string ConsolidationStep(int64_t finish_id) {
  return "consolidation " + std::to_string(finish_id);
}
std::string BatchStep(int64_t finish_id) { return "batch " + std::to_string(finish_id); }
std::string FinalStep(int64_t finish_id) { return "final adjustment " + std::to_string(finish_id); }
std::string AssessmentStep(int64_t finish_id) { return "assessment " + std::to_string(finish_id); }
std::string MaintenanceStep() { return "maintenance"; }
std::string ShapeStep() { return "shape"; }
std::string SeedStep() { return "seed"; }
std::string RestoreStep() { return "restoring"; }
std::string TrialsStep() { return "trials"; }
std::string ModelStep() { return "model"; }

bool CanBeLeftOut(const std::string& step) {
  static const std::set<std::string> kVital = {SeedStep(), RestoreStep(), TrialsStep(),
                                               ModelStep()};
  return kVital.count(step) == 0;
}

}  // namespace skein
