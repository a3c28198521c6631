#include "session/state_names.h"

#include "ledger/facts.h"

namespace skein {

const char* MergeStateName(int8_t state) {
  switch (state) {
    case merge_t::ORDERED:
      return "ordered";
    case merge_t::FROZEN:
      return "frozen";
    case merge_t::DONE:
      return "done";
    case merge_t::UNDONE:
      return "undone";
    default:
      return "failed";
  }
}

const char* FinishStateName(int8_t state) {
  switch (state) {
    case finish_t::REQUESTED:
      return "requested";
    case finish_t::DRAINED:
      return "drained";
    case finish_t::BATCH:
      return "batch";
    case finish_t::SETTLED:
      return "settled";
    case finish_t::DONE:
      return "done";
    case finish_t::DEADLINE:
      return "deadline";
    default:
      return "cut";
  }
}

const char* FailureCauseName(int8_t cause) {
  switch (cause) {
    case failure_t::UNREADABLE:
      return "unreadable";
    case failure_t::PHONE_FORMAT:
      return "phone format";
    case failure_t::TOO_SMALL:
      return "too small";
    case failure_t::TOO_LARGE:
      return "too large";
    case failure_t::VANISHED:
      return "vanished";
    default:
      return "failed";
  }
}

}  // namespace skein
