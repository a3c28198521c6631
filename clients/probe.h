#pragma once

namespace skein {

// `skein probe`: does this LCM URL carry a message from this host back to it? Scripts choose
// between udpm and tcpq with it.
int RunProbe(int argc, char** argv);

}  // namespace skein
