#include "event_loop/sign_of_life.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "core/file.h"
#include "core/file_below.h"
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
  Status status;
  if (fd_ < 0) {
    const std::filesystem::path session = std::filesystem::path(path_).parent_path().parent_path();
    Result<FileDescriptor> file = OpenFileBelow(session, path_, O_WRONLY | O_CREAT);
    status = file.status();
    if (file.ok()) fd_ = file->Release();
  }
  if (fd_ >= 0 && ::futimens(fd_, nullptr) == 0) return;
  if (status.ok()) status = FileError("cannot touch", path_, errno);
  if (!std::exchange(failed_, true)) {
    LogWarn("{} (SKEIN_ALIVE_FILE); trying on", status.error());
  }
}

}  // namespace skein
