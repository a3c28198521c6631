// Items of work of kind "matching". A photo's item is its image id. If a photo was matched with its
// best candidates alone, the rest is an item of its own, and a stage of its own where it fails.
#pragma once

#include <cstdint>
#include <string>

#include "skein/failure_t.hpp"

namespace skein {

constexpr char kMatchingKind[] = "matching";
constexpr char kRestStage[] = "rest";  // of failure_t

// Rests come after all photos where the highest item goes first, the oldest of them before others.
inline int64_t RestItem(int64_t image_id) { return -image_id; }
inline bool IsRestItem(int64_t item) { return item < 0; }
inline int64_t PhotoOfItem(int64_t item) { return item < 0 ? -item : item; }

// The kind of work that a stage's failure is of.
inline std::string KindOfStage(const std::string& stage) {
  return stage == kRestStage ? kMatchingKind : stage;
}
// The stage at which an item of a kind of work fails.
inline std::string StageOfItem(const std::string& kind, int64_t item) {
  return kind == kMatchingKind && IsRestItem(item) ? kRestStage : kind;
}
// The item that failed; 0 if the failure is of none.
inline int64_t ItemOfFailure(const failure_t& failure) {
  if (failure.submap_id != 0) return failure.submap_id;
  return failure.stage == kRestStage ? RestItem(failure.image_id) : failure.image_id;
}

}  // namespace skein
