#pragma once

#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>

namespace skein {

// Jobs of several parties for one worker, so that parties whose jobs wait get equal shares of its
// time: start-time fair queueing (Goyal, Vin and Cheng, SIGCOMM 1996) with equal weights. A party's
// own jobs stay in order. Time that a party left unused is not saved up. One thread.
class FairJobQueue {
 public:
  using Job = std::function<void()>;
  struct Next {
    std::string party;
    Job job;
  };

  void Add(const std::string& party, Job job);
  // The next job, of the party that has had the least time; none if none waits.
  std::optional<Next> Take();
  // A job of the party took so long.
  void NoteWork(const std::string& party, double seconds);

  size_t num_parties() const { return parties_.size(); }

 private:
  struct Party {
    std::deque<Job> jobs;
    double had_s = 0;  // time, counted from what others have had when the party came
  };

  std::map<std::string, Party> parties_;
  double level_s_ = 0;  // time that the party of the latest job has had
};

}  // namespace skein
