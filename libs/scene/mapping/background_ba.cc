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
  bundles_.before = std::move(bundle);
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
  bundles_.after = bundles_.before;
  summary_ = SolveBundle(options, &bundles_.after);
  bundles_.seconds = timer.ElapsedS();
  if (summary_.usable && !cancel_) bundles_.shape = CheckShape(bundles_.after);
}

std::optional<RefinedBundle> BackgroundBa::TakeIfDone() {
  if (!IsRunning() || !done_) return std::nullopt;
  thread_.join();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  if (!summary_.usable) return std::nullopt;
  bundles_.factor = std::move(summary_.factor);
  return std::move(bundles_);
}

void BackgroundBa::Cancel() {
  cancel_ = true;
  if (IsRunning()) thread_.join();
}

}  // namespace skein
