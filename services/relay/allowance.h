// Limit on one client's messages: a token bucket. The bucket holds as many tokens as the rate
// brings in a second.
#pragma once

#include <algorithm>

namespace skein {

class Allowance {
 public:
  explicit Allowance(double per_s) : per_s_(per_s), left_(per_s) {}

  // Nothing may be said until some time has passed.
  bool IsSpent(double now_s) {
    left_ = std::min(per_s_, left_ + per_s_ * (now_s - filled_s_));
    filled_s_ = now_s;
    return left_ < 1;
  }
  // More than is left becomes a debt.
  void Spend(double cost) { left_ -= cost; }

 private:
  double per_s_;
  double left_;
  double filled_s_ = 0;
};

}  // namespace skein
