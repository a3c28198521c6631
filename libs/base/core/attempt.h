// Work on one item, message or request whose exceptions end that item's turn alone.
#pragma once

#include <exception>
#include <type_traits>
#include <utility>

#include "core/result.h"

namespace skein {

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
// item, or tells it to whoever asked.
template <class Work>
AttemptResult<Work> Attempt(Work&& work) {
  try {
    if constexpr (std::is_void_v<std::invoke_result_t<Work&>>) {
      work();
      return Status::Ok();
    } else {
      return work();
    }
  } catch (const std::exception& error) {
    return Unavailable(error.what());
  } catch (...) {
    return Unavailable("unknown exception");
  }
}

}  // namespace skein
