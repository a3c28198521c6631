#include "mapping/background_ba.h"

#include <stdexcept>
#include <utility>

#include "core/clock.h"
#include "core/threads.h"

namespace skein {
namespace {

constexpr int kBackgroundNiceness = 10;

}  // namespace

void BackgroundBa::Start(Bundle bundle, const BundleOptions& options) {
  if (IsRunning()) throw std::logic_error("a background bundle adjustment is running");
  cancel_ = done_ = false;
  error_ = nullptr;
  refined_.bundle = std::move(bundle);
  BundleOptions cancellable = options;
  cancellable.cancel = &cancel_;
  thread_ = std::thread([this, cancellable] {
    SetNicenessOfThread(kBackgroundNiceness);
    try {
      Solve(cancellable);
    } catch (...) {
      error_ = std::current_exception();
    }
    done_ = true;
  });
}

void BackgroundBa::Solve(const BundleOptions& options) {
  const Timer timer;
  summary_ = SolveBundle(options, &refined_.bundle);
  refined_.seconds = timer.ElapsedS();
  if (summary_.usable && !cancel_)
    refined_.shape = CheckShape(refined_.bundle, options.num_threads);
}

std::optional<RefinedBundle> BackgroundBa::TakeIfDone() {
  if (!IsRunning() || !done_) return std::nullopt;
  thread_.join();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  if (!summary_.usable) return std::nullopt;
  refined_.factor = std::move(summary_.factor);
  return std::move(refined_);
}

void BackgroundBa::Cancel() {
  cancel_ = true;
  if (IsRunning()) thread_.join();
}

}  // namespace skein
