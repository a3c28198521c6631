// For tests over real transports: child processes, and a network of the test's own.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "core/clock.h"

namespace skein {

// A process that runs a function or a program. The process dies with this object or with the test.
class Child {
 public:
  explicit Child(const std::function<void()>& body) {
    pid_ = ::fork();
    if (pid_ != 0) return;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    body();
    ::_exit(0);
  }
  explicit Child(std::vector<std::string> command)
      : Child([&command] {
          std::vector<char*> words;
          for (std::string& word : command) words.push_back(word.data());
          words.push_back(nullptr);
          ::execvp(words[0], words.data());
          ::_exit(127);
        }) {}
  ~Child() { Kill(); }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  pid_t pid() const { return pid_; }
  void Signal(int signal) const { ::kill(pid_, signal); }
  void Kill() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  pid_t pid_ = -1;
};

// Whether something accepts connections on the port of this host within timeout_s.
inline bool WaitForPort(int port, double timeout_s) {
  const Timer timer;
  while (timer.ElapsedS() < timeout_s) {
    const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    address.sin_port = htons(static_cast<uint16_t>(port));
    const bool open = ::connect(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    ::close(fd);
    if (open) return true;
    ::usleep(20000);
  }
  return false;
}

// Moves this test into a network of its own, loopback with multicast. False where that is not
// permitted: the test is then to be skipped.
inline bool EnterOwnNetwork() {
  if (::unshare(CLONE_NEWNET) != 0) return false;
  return std::system(
             "ip link set lo up && ip link set lo multicast on && "
             "ip route add 224.0.0.0/4 dev lo") == 0;
}

}  // namespace skein
