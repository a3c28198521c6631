#pragma once

#include <string>

namespace skein {

// How many threads a job that begins now may run on: this thread's core and those that nobody runs
// on, at most `most`. `loadavg` is the text of /proc/loadavg, whose fourth field tells how many
// threads of the machine run or want to, this one included; `most` if it cannot be read.
int ThreadsForIdleCores(const std::string& loadavg, int cores, int most);

// The same of this machine, now.
int ThreadsForIdleCores(int most);

}  // namespace skein
