// How long others have had to be heard.
#pragma once

#include <algorithm>
#include <optional>

namespace skein {

// Seconds for which a loop has gone round and so has heard who spoke. A round counts for at most
// kLongestRoundS, even if the process was stopped or the disk held it up: else everybody would seem
// to have been silent meanwhile.
class ListeningClock {
 public:
  static constexpr double kLongestRoundS = 1;

  // Once a round, after messages were read; `now_s` is any monotonic time.
  void NoteRound(double now_s) {
    if (last_s_) heard_s_ += std::clamp(now_s - *last_s_, 0.0, kLongestRoundS);
    last_s_ = now_s;
  }
  double now_s() const { return heard_s_; }

 private:
  std::optional<double> last_s_;
  double heard_s_ = 0;
};

}  // namespace skein
