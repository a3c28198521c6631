#include "event_loop/sign_of_life.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "core/log.h"

namespace skein {
namespace {

constexpr double kTouchS = 0.5;

std::string FileOfSupervisor() {
  const char* path = std::getenv("SKEIN_ALIVE_FILE");
  return path == nullptr ? "" : path;
}

}  // namespace

SignOfLife::SignOfLife(PollLoop& loop) : SignOfLife(loop, FileOfSupervisor()) {}

SignOfLife::SignOfLife(PollLoop& loop, std::string path) : loop_(loop), path_(std::move(path)) {
  if (!path_.empty()) timer_ = loop_.AddTimer(kTouchS, [this] { Touch(); });
}

SignOfLife::~SignOfLife() {
  loop_.CancelTimer(timer_);
  if (fd_ >= 0) ::close(fd_);
}

void SignOfLife::Touch() {
  if (fd_ < 0) fd_ = ::open(path_.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0644);
  if (fd_ >= 0 && ::futimens(fd_, nullptr) == 0) return;
  if (!std::exchange(failed_, true)) {
    LogWarn("cannot touch {} (SKEIN_ALIVE_FILE): {}; trying on", path_, std::strerror(errno));
  }
}

}  // namespace skein
