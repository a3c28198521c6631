// Expected failure as a value: a code for the program, a text for a person. A caller that must
// decide asks for the code; the text is only shown.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace skein {

enum class StatusCode {
  kOk,
  kInvalidArgument,     // the input is wrong, whatever the state of the rest
  kNotFound,            // a file, blob or entry that is not there
  kAlreadyExists,       // an entry that must be new is there
  kDataLoss,            // damaged, cut short, or of another format or version
  kUnavailable,         // not now: a device, file or process refuses; a retry may succeed
  kResourceExhausted,   // above a limit of size or number
  kFailedPrecondition,  // right in itself, but not in this state
  kInternal,            // anything else
};

// Success, or the code and text of a failure.
struct Status {
  static Status Ok() { return {}; }
  static Status Error(StatusCode code, std::string text) { return {code, std::move(text)}; }
  static Status Error(std::string text) { return {StatusCode::kInternal, std::move(text)}; }

  bool ok() const { return code == StatusCode::kOk; }
  explicit operator bool() const { return ok(); }
  const std::string& error() const { return text; }
  // A failure with `what: ` before its text; success stays success.
  Status Within(const std::string& what) const {
    return ok() ? *this : Status{code, what + ": " + text};
  }

  StatusCode code = StatusCode::kOk;
  std::string text;
};

inline Status InvalidArgument(std::string text) {
  return Status::Error(StatusCode::kInvalidArgument, std::move(text));
}
inline Status NotFound(std::string text) {
  return Status::Error(StatusCode::kNotFound, std::move(text));
}
inline Status AlreadyExists(std::string text) {
  return Status::Error(StatusCode::kAlreadyExists, std::move(text));
}
inline Status DataLoss(std::string text) {
  return Status::Error(StatusCode::kDataLoss, std::move(text));
}
inline Status Unavailable(std::string text) {
  return Status::Error(StatusCode::kUnavailable, std::move(text));
}
inline Status ResourceExhausted(std::string text) {
  return Status::Error(StatusCode::kResourceExhausted, std::move(text));
}
inline Status FailedPrecondition(std::string text) {
  return Status::Error(StatusCode::kFailedPrecondition, std::move(text));
}

// A T, or the failure. Reading the value of a failed result throws std::logic_error: callers look
// at ok() first.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Status status) : state_(std::in_place_index<1>, std::move(status)) {
    if (std::get<1>(state_).ok()) throw std::logic_error("Result made of a Status that is ok");
  }
  static Result Error(std::string text) { return Result(Status::Error(std::move(text))); }

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  StatusCode code() const { return ok() ? StatusCode::kOk : std::get<1>(state_).code; }
  // Empty if ok().
  std::string error() const { return ok() ? std::string() : std::get<1>(state_).text; }
  Status status() const { return ok() ? Status::Ok() : std::get<1>(state_); }

  T& value() & { return Checked(); }
  const T& value() const& { return const_cast<Result*>(this)->Checked(); }
  T&& value() && { return std::move(Checked()); }
  T& operator*() & { return Checked(); }
  const T& operator*() const& { return value(); }
  T&& operator*() && { return std::move(Checked()); }
  T* operator->() { return &Checked(); }
  const T* operator->() const { return &value(); }

 private:
  T& Checked() {
    if (!ok()) throw std::logic_error("value of a failed result: " + std::get<1>(state_).text);
    return std::get<0>(state_);
  }

  std::variant<T, Status> state_;
};

}  // namespace skein
