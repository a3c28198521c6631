#include "codecs/confinement.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <functional>
#include <vector>

namespace skein::confinement_test {

constexpr int kUnused = 3;

// In a process of its own: confined, it tries; 0 if that returned true.
[[noreturn]] void Try(const std::function<bool()>& attempt) {
  if (!ConfineThisProcess(kUnused).ok()) _exit(99);
  _exit(attempt() ? 0 : 1);
}

void ExpectAllowed(const std::function<bool()>& attempt) {
  EXPECT_EXIT(Try(attempt), testing::ExitedWithCode(0), "");
}

void ExpectDeadly(const std::function<bool()>& attempt) {
  EXPECT_EXIT(Try(attempt), testing::KilledBySignal(SIGSYS), "");
}

bool IsDenied(int result) { return result == -1 && errno == EACCES; }

TEST(Confinement, LeavesMemoryAndTime) {
  ExpectAllowed([] {
    std::vector<char> large(50'000'000, 1);
    timespec now{};
    return large.back() == 1 && clock_gettime(CLOCK_MONOTONIC, &now) == 0;
  });
}

TEST(Confinement, OpensNoFile) {
  ExpectAllowed([] { return IsDenied(open("/etc/passwd", O_RDONLY)); });
  ExpectAllowed([] { return IsDenied(open("/tmp/skein-confinement", O_WRONLY | O_CREAT, 0600)); });
  ExpectAllowed([] { return IsDenied(access("/etc/passwd", F_OK)); });
  ExpectDeadly([] { return unlink("/nowhere") == 0; });
  ExpectDeadly([] { return rename("/nowhere", "/nowhere2") == 0; });
}

TEST(Confinement, OpensNoSocket) {
  ExpectDeadly([] { return socket(AF_INET, SOCK_STREAM, 0) >= 0; });
  ExpectDeadly([] { return socket(AF_UNIX, SOCK_DGRAM, 0) >= 0; });
}

TEST(Confinement, StartsNoProcess) {
  ExpectDeadly([] { return fork() >= 0; });
  ExpectDeadly([] { return execl("/bin/true", "true", nullptr) == 0; });
}

TEST(Confinement, TouchesNoOtherProcess) {
  ExpectDeadly([] { return kill(getppid(), SIGTERM) == 0; });
  ExpectDeadly([] { return prctl(PR_SET_DUMPABLE, 1) == 0; });
}

TEST(Confinement, RunsNoCodeThatItWrote) {
  ExpectDeadly([] {
    return mmap(nullptr, 4096, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1,
                0) != MAP_FAILED;
  });
  ExpectDeadly([] {
    void* page = mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    return mprotect(page, 4096, PROT_READ | PROT_EXEC) == 0;
  });
}

TEST(Confinement, ReadsNoOtherDescriptor) {
  ExpectDeadly([] {
    char byte = 0;
    return read(STDIN_FILENO, &byte, 1) == 1;
  });
}

TEST(Confinement, AnAbortStaysAnAbort) {
  EXPECT_EXIT(Try([]() -> bool { std::abort(); }), testing::KilledBySignal(SIGABRT), "");
}

}  // namespace skein::confinement_test
