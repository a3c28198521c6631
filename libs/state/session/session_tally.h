// Counts of a session that are kept as its facts come, for readers that ask often.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "session/session_state.h"

namespace skein {

// State of a photo on its way. The first four are stages that it waits for or is worked on in.
enum class PhotoPhase {
  kFeatures,
  kRetrieval,
  kMatching,
  kMapper,
  kUnplaced,
  kRegistered,
  kFailed
};
constexpr size_t kNumPhotoPhases = 7;

// kRegistered: in a living submap. kFailed: parked at a stage. kMapper: through matching with
// verified pairs, and no living submap has tried the photo. kUnplaced: through matching otherwise.
// Costs the submaps.
PhotoPhase PhaseOf(const SessionState& state, int64_t image_id, const PhotoState& photo);

// Upper bounds of the latency's buckets in seconds; one bucket more has the rest.
constexpr std::array<double, 13> kLatencyBoundsS = {0.1, 0.25, 0.5, 1,   2.5, 5,   10,
                                                    25,  50,   100, 250, 500, 1000};

// Seconds from a photo's receipt to the commit of its first registration, a photo once.
struct LatencyCounts {
  std::array<int64_t, kLatencyBoundsS.size() + 1> photos{};  // by bucket, not cumulative
  double sum_s = 0;
};

// A pure function of the ledger, as SessionState. A fact costs the submaps, and O(log n) for n
// waiting photos; the end of a submap costs the submap's photos. Memory: one or two map entries a
// photo.
class SessionTally {
 public:
  // Facts in the order of seq; `state` has worked in the fact.
  void Apply(const Fact& fact, const SessionState& state);

  int64_t NumIn(PhotoPhase phase) const { return counts_[static_cast<size_t>(phase)]; }
  // Commit of the fact that brought the photo into the phase which has been there longest; nullopt
  // if the phase has no photo. Only for phases up to kMapper.
  std::optional<int64_t> OldestUtimeUs(PhotoPhase phase) const;
  int64_t photo_bytes() const { return photo_bytes_; }  // of the accepted photos
  const LatencyCounts& latency() const { return latency_; }

 private:
  struct Photo {
    PhotoPhase phase = PhotoPhase::kFeatures;
    int64_t since_utime_us = 0;
    bool was_registered = false;
  };

  void ApplyFact(const image_t& fact, const SessionState& state);
  void ApplyFact(const registration_t& fact, const SessionState& state);
  void ApplyFact(const submap_end_t& fact, const SessionState& state);
  void ApplyFact(const merge_t& fact, const SessionState& state);
  void ApplyFact(const features_t& fact, const SessionState& state);
  void ApplyFact(const candidates_t& fact, const SessionState& state);
  void ApplyFact(const matches_t& fact, const SessionState& state);
  void ApplyFact(const failure_t& fact, const SessionState& state);
  template <class T>
  void ApplyFact(const T&, const SessionState&) {}
  void Look(int64_t image_id, const SessionState& state);
  void LookAtPhotosOf(int64_t submap_id, const SessionState& state);
  void CountLatency(double seconds);

  std::unordered_map<int64_t, Photo> photos_;
  std::array<int64_t, kNumPhotoPhases> counts_{};
  // Utime and photo, of the phases up to kMapper.
  std::array<std::set<std::pair<int64_t, int64_t>>, 4> waiting_;
  int64_t photo_bytes_ = 0;
  LatencyCounts latency_;
};

}  // namespace skein
