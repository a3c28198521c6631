#include "core/process.h"

#include <sys/random.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace skein {
namespace {

// Value of a "Key:  123 kB" line of /proc/self/status, in bytes.
int64_t StatusBytes(const std::string& key) {
  std::ifstream status("/proc/self/status");
  for (std::string word; status >> word;) {
    int64_t kilobytes = 0;
    if (word == key + ":" && status >> kilobytes) return kilobytes * 1024;
  }
  return 0;
}

double Seconds(const timeval& time) { return time.tv_sec + 1e-6 * time.tv_usec; }

}  // namespace

void CapThreads(int num_threads) {
  if (num_threads < 1) throw std::invalid_argument("CapThreads: need at least one thread");
  const std::string text = std::to_string(num_threads);
  for (const char* name : {"OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "OMP_THREAD_LIMIT"}) {
    ::setenv(name, text.c_str(), 1);
  }
}

int64_t ResidentMemoryBytes() { return StatusBytes("VmRSS"); }

int64_t PeakMemoryBytes() { return StatusBytes("VmHWM"); }

double CpuTimeS() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
}

std::string HostName() {
  char name[256] = {};
  if (::gethostname(name, sizeof(name) - 1) != 0) return "unknown";
  return name;
}

void EndProcessWithin(double seconds) {
  std::thread([seconds] {
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    std::_Exit(0);
  }).detach();
}

uint64_t RandomU64() {
  uint64_t value = 0;
  if (::getrandom(&value, sizeof(value), 0) != sizeof(value)) {
    throw std::runtime_error("getrandom failed");
  }
  return value;
}

}  // namespace skein
