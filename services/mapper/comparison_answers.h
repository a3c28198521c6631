#pragma once

#include <cstdint>
#include <vector>

#include "core/bytes.h"
#include "mapper/photo_loader.h"
#include "node/node.h"
#include "session/session_state.h"
#include "skein/shared_request_t.hpp"

namespace skein {

class SubmapRun;

// Answers to the merger's requests (shared_request_t): poses and points of the photos through which
// a run's submap is compared with another. Photos that the submap does not hold are loaded and
// placed as guests meanwhile. If that failed three times, the answer has nothing. Loop's thread
// only; a part of the run.
class ComparisonAnswers {
 public:
  ComparisonAnswers(Node& node, const SessionState& session, PhotoLoader& photos, SubmapRun& run)
      : node_(node), session_(session), photos_(photos), run_(run) {}

  // A request is dropped while another is answered: guests take seconds, and more where the worker
  // is busy. The merger asks again, for something else when it has given this up.
  void Answer(const shared_request_t& request);

 private:
  bool MayAnswer(const std::vector<int64_t>& image_ids) const;
  void Reply(int64_t request_id, Bytes shared);

  Node& node_;
  const SessionState& session_;
  PhotoLoader& photos_;
  SubmapRun& run_;
  bool answering_ = false;
};

}  // namespace skein
