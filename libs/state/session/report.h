#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>

#include "session/session_history.h"

namespace skein {

// Number of photos that came, by outcome. received = registered + deferred + failed.
struct PhotoCounts {
  int64_t received = 0;    // accepted or refused
  int64_t registered = 0;  // in at least one living submap
  int64_t deferred = 0;    // through matching or on the way, and in no submap
  int64_t failed = 0;      // refused, parked, or lost with their agent
  int64_t duplicates = 0;  // offers of a content that was there already
};

PhotoCounts CountPhotos(const SessionRecord& session, int64_t num_duplicates);

// For each registered photo the seconds from ingest's receipt to the commit of its first
// registration, in the order of photos.
std::vector<double> PhotoToPoseSeconds(const SessionRecord& session);

// {p50, p95, p99, stages: [{stage, p50, p95, work_p50, work_p95}]}
//
// Seconds of the photos that are registered: from ingest's receipt to the commit of the first
// registration. A stage (PhotoStage) begins when the one before has ended. The rest of a stage,
// beside work, is waiting for a free worker, transfer and commit. Matching reports sums over its
// threads, so work is clamped to the stage's length. Work is null if no fact tells it.
nlohmann::json LatencyPart(const SessionRecord& session);

// [{image, cause, reason, remedy}] of the photos that are in no submap, those on their way
// included.
nlohmann::json DeferredPart(const SessionState& state);

// Candidates named and hit, pairs matched and verified, mean seconds a photo in the index.
nlohmann::json RetrievalPart(const SessionHistory& history);

// report.json: what happened in the session up to `done_utime_us`. docs: services/ingest/README.md.
nlohmann::json MakeReport(const SessionRecord& session, int64_t num_duplicates,
                          int64_t done_utime_us);

}  // namespace skein
