#pragma once

#include <atomic>
#include <exception>
#include <memory>
#include <optional>
#include <thread>

#include "bundle/bundle.h"
#include "mapping/model_check.h"

namespace skein {

// A bundle that was refined while the map went on.
struct RefinedBundle {
  Bundle bundle;
  std::shared_ptr<const BundleFactor> factor;
  double seconds = 0;  // wall time
  ShapeCheck shape;    // of the bundle
};

// Solves one bundle at a time in a thread of its own, at low priority. Used by one thread.
class BackgroundBa {
 public:
  BackgroundBa() = default;
  ~BackgroundBa() { Cancel(); }
  BackgroundBa(const BackgroundBa&) = delete;
  BackgroundBa& operator=(const BackgroundBa&) = delete;

  bool IsRunning() const { return thread_.joinable(); }
  // Throws std::logic_error if it runs.
  void Start(Bundle bundle, const BundleOptions& options);
  // The result, once, when it is there and usable; ends the run also when it is not usable. Throws
  // what the run has thrown.
  std::optional<RefinedBundle> TakeIfDone();
  // Stops at the next iteration and drops the result.
  void Cancel();

 private:
  void Solve(const BundleOptions& options);

  std::thread thread_;
  std::atomic<bool> cancel_{false};
  std::atomic<bool> done_{false};
  RefinedBundle refined_;
  BundleSummary summary_;
  std::exception_ptr error_;
};

}  // namespace skein
