// Names of the steps of a mapper's work on a submap. A step that threw, crashed or hung three times
// is left out (failure_t), and the submap goes on without it.
#pragma once

#include <cstdint>
#include <string>

namespace skein {

std::string PhotoStep(int64_t image_id);           // left out: the photo is not tried again in this
                                                   // submap
std::string MergeStep(int64_t merge_id);           // left out: the merge ends UNDONE
std::string ComparisonStep(int64_t other_submap);  // for a merge: the other gets no photos
std::string ConsolidationStep(int64_t finish_id);  // the map stays as it was before it
std::string BatchStep(int64_t finish_id);          // the same
std::string FinalStep(int64_t finish_id);          // the same
std::string AssessmentStep(int64_t finish_id);     // the final model tells not how complete it is
std::string MaintenanceStep();                     // no bundle adjustment in the background
std::string ShapeStep();                           // the live view does not show the submap

// Without these there is no submap: it ends, and its photos may be seeded again.
std::string SeedStep();
std::string RestoreStep();
std::string TrialsStep();  // work of a trip to the worker beside its photos
std::string ModelStep();   // encoding and storing

bool CanBeLeftOut(const std::string& step);

}  // namespace skein
