// Expected failure as a value: a result or the text of an error for a person to read.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace skein {

// Success, or the reason of a failure.
struct Status {
  static Status Ok() { return {}; }
  static Status Error(std::string text) { return {true, std::move(text)}; }

  bool ok() const { return !failed; }
  explicit operator bool() const { return ok(); }
  const std::string& error() const { return text; }

  bool failed = false;
  std::string text;
};

// A T, or the reason why there is none. Reading the value of a failed result throws
// std::logic_error: callers look at ok() first.
template <class T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}
  Result(Status status) : state_(std::in_place_index<1>, std::move(status.text)) {
    if (status.ok()) throw std::logic_error("Result made of a Status that is ok");
  }
  static Result Error(std::string text) { return Result(Status::Error(std::move(text))); }

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  // Empty if ok().
  std::string error() const { return ok() ? std::string() : std::get<1>(state_); }
  Status status() const { return ok() ? Status::Ok() : Status::Error(std::get<1>(state_)); }

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
    if (!ok()) throw std::logic_error("value of a failed result: " + std::get<1>(state_));
    return std::get<0>(state_);
  }

  std::variant<T, std::string> state_;
};

}  // namespace skein
