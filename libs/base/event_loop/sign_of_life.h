// Shows the supervisor of a process that its loop comes round.
#pragma once

#include <string>

#include "event_loop/poll_loop.h"

namespace skein {

// Touches a file twice a second from the loop; it is made when the loop runs for the first time. A
// process that is stopped, deadlocked or lost in a handler touches it no more. A file that cannot
// be made is tried again. The file is SESSION/run/NAME: below SESSION no symbolic link is followed
// (core/file_below.h). Loop's thread only.
class SignOfLife {
 public:
  // The file that the supervisor names in SKEIN_ALIVE_FILE; without one nothing is done.
  explicit SignOfLife(PollLoop& loop);
  SignOfLife(PollLoop& loop, std::string path);
  ~SignOfLife();
  SignOfLife(const SignOfLife&) = delete;
  SignOfLife& operator=(const SignOfLife&) = delete;

 private:
  void Touch();

  PollLoop& loop_;
  const std::string path_;
  int fd_ = -1;
  bool failed_ = false;  // and was logged
  PollLoop::TimerId timer_ = 0;
};

}  // namespace skein
