#pragma once

#include <string>

namespace skein {

// Number of threads for a job that begins now: clamp(cores - running + 1, 1, most). `running` is
// the number of runnable threads of the machine, the calling one included: the fourth field of
// `loadavg`, the text of /proc/loadavg. Returns `most` if that field cannot be read.
int ThreadsForIdleCores(const std::string& loadavg, int cores, int most);

// The same of this machine, now.
int ThreadsForIdleCores(int most);

}  // namespace skein
