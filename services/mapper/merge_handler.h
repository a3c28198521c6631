#pragma once

#include <functional>

#include "skein/merge_t.hpp"

namespace skein {

class SubmapRun;

// Carries out merges in which the mapper's submap takes part. SubmapRun gives access to the map
// (RunOnSubmap), to the ledger's facts and to what is submitted. Loop's thread only.
class MergeHandler {
 public:
  virtual ~MergeHandler() = default;

  // The run has worked through everything before the order and rests until `resume` is called:
  //   source: submit FROZEN with its model, wait for DONE (then never resume) or UNDONE
  //   target: wait for FROZEN, absorb, submit DONE or UNDONE
  virtual void OnOrdered(const merge_t& ordered, SubmapRun& run, std::function<void()> resume) = 0;
  // A further fact of a merge.
  virtual void OnMergeFact(const merge_t& merge, SubmapRun& run) = 0;
  // The run is no more: what was open is forgotten.
  virtual void OnRunGone() = 0;
};

}  // namespace skein
