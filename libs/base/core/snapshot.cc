#include "core/snapshot.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace skein {
namespace {

constexpr int kNiceness = 10;

bool WriteAll(int fd, const Bytes& bytes) {
  size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t count = write(fd, bytes.data() + written, bytes.size() - written);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    written += static_cast<size_t>(count);
  }
  return true;
}

// Never returns: what belongs to the parent must not be destroyed twice.
[[noreturn]] void RunChild(const std::function<Bytes()>& encode, pid_t parent, int write_fd) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(1);
  signal(SIGINT, SIG_IGN);  // of the terminal: the parent decides
  signal(SIGTERM, SIG_DFL);
  setpriority(PRIO_PROCESS, 0, kNiceness);
  bool done = false;
  try {
    done = WriteAll(write_fd, encode());
  } catch (...) {
    done = false;
  }
  _exit(done ? 0 : 1);
}

}  // namespace

Result<std::shared_ptr<Snapshot>> Snapshot::Take(const std::function<Bytes()>& encode) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Unavailable(std::string("no pipe for a snapshot: ") + std::strerror(errno));
  }
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    RunChild(encode, parent, ends[1]);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    return Unavailable(std::string("no process for a snapshot: ") + std::strerror(errno));
  }
  return std::shared_ptr<Snapshot>(new Snapshot(child, ends[0]));
}

Result<Bytes> Snapshot::Read() {
  Bytes bytes;
  Bytes buffer(1 << 20);
  ssize_t count = 0;
  while ((count = read(read_fd_, buffer.data(), buffer.size())) != 0) {
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return Unavailable(std::string("snapshot: ") + std::strerror(errno));
    bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + count);
  }
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
  child_ = -1;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
    return Status::Error("the process that makes the snapshot failed");
  }
  return bytes;
}

Snapshot::~Snapshot() {
  close(read_fd_);
  if (child_ < 0) return;
  kill(child_, SIGKILL);
  while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) continue;
}

}  // namespace skein
