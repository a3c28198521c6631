// Work on one item, message, fact or timer whose exceptions end its turn alone, and the limits from
// which on a session goes on without an item.
#pragma once

#include <exception>
#include <stdexcept>
#include <type_traits>

#include "core/result.h"

namespace skein {

// Exceptions, reported errors, crashes and hangs over one item together.
constexpr int kMaxFailures = 3;
// Deaths by SIGKILL over one item: out of memory, or somebody's doing.
constexpr int kMaxKills = 10;

// The process must end: its state is half changed, or differs from the ledger. The next process
// makes the state anew from the ledger. Attempt lets this exception through.
class BrokenState : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

// Calls work(), a change of state that is worth nothing by half: an exception becomes BrokenState,
// with its text.
template <class Work>
void ChangeWhole(Work&& work) {
  try {
    work();
  } catch (const std::exception& error) {
    throw BrokenState(error.what());
  }
}

namespace attempt_internal {
template <class T>
struct ResultOf {
  using type = Result<T>;
};
template <>
struct ResultOf<void> {
  using type = Status;
};
template <>
struct ResultOf<Status> {
  using type = Status;
};
template <class T>
struct ResultOf<Result<T>> {
  using type = Result<T>;
};
}  // namespace attempt_internal

template <class Work>
using AttemptResult = typename attempt_internal::ResultOf<std::invoke_result_t<Work&>>::type;

// Result<T> of work(); a Status if work() returns that or nothing. An exception is kUnavailable
// with the exception's text: another try may succeed. The caller counts the failure against the
// item, or tells it to whoever asked. std::bad_alloc is such an exception, too: most come of a size
// that the item tells, and a process that is short of memory is killed. BrokenState alone is
// rethrown.
template <class Work>
AttemptResult<Work> Attempt(Work&& work) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work&>>) {
      work();
      return Status::Ok();
    } else {
      return work();
    }
  } catch (const BrokenState&) {
    throw;
  } catch (const std::exception& error) {
    return Unavailable(error.what());
  } catch (...) {
    return Unavailable("unknown exception");
  }
}

}  // namespace skein
