// Memory, CPU time and host of this process.
#pragma once

#include <cstdint>
#include <string>

namespace skein {

// Caps the threads of OpenMP and BLAS through their environment variables. Call it first in main.
// Ceres and OpenCV are capped where they are used. num_threads >= 1.
void CapThreads(int num_threads);

// Resident memory now and at its peak, in bytes; 0 if /proc cannot be read.
int64_t ResidentMemoryBytes();
int64_t PeakMemoryBytes();

// Processor time this process has used, user and system together, seconds.
double CpuTimeS();

std::string HostName();

// Ends this process with exit code 0 in `seconds`, whatever its threads do then, unless it has
// ended by itself. Nothing is destroyed or flushed then. Returns at once.
void EndProcessWithin(double seconds);

// From the kernel's random source.
uint64_t RandomU64();

}  // namespace skein
