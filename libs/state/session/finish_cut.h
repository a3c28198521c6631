#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "session/session_state.h"

namespace skein {

// Photos and submaps that a finish left out at its deadline. All is a function of the ledger.
struct FinishCut {
  struct Submap {
    int64_t submap_id = 0;
    std::string left_out;  // for a person
  };

  double after_s = 0;                // since the request
  std::string during;                // the stage, for a person
  std::vector<int64_t> not_matched;  // photos that were still in work, by id
  // Photos with verified pairs that no living submap has tried, by id.
  std::vector<int64_t> not_tried;
  std::vector<Submap> submaps;  // living submaps whose final model was cut short
};

// Precondition: the session's finish is cut and not DONE yet.
FinishCut FindCut(const SessionState& session);

// report.json's "cut".
nlohmann::json CutPart(const SessionState& session, const FinishCut& cut);

// "cut after 30 s during ...: 5 photos not matched in time (a/1.jpg, a/2.jpg, ...); ...".
std::string CutSummary(const SessionState& session, const FinishCut& cut);

}  // namespace skein
