// How the process before this one ended.
#pragma once

#include <csignal>
#include <cstdlib>

namespace skein {

// The signal of which that process died, as the supervisor tells it; 0: none, or not known.
inline int PreviousExitSignal() {
  const char* text = std::getenv("SKEIN_PREVIOUS_EXIT_SIGNAL");
  return text == nullptr ? 0 : std::atoi(text);
}

// Whether what the process worked on is to blame: a crash, or a hang (SIGALRM). SIGKILL comes from
// outside.
inline bool IsCrash(int signal) {
  return signal == SIGSEGV || signal == SIGABRT || signal == SIGBUS || signal == SIGFPE ||
         signal == SIGILL || signal == SIGALRM;
}

}  // namespace skein
