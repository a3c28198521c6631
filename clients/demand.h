#pragma once

namespace skein {

// `skein demand`: how many more mappers a session could use, for scripts/launch.sh.
int RunDemand(int argc, char** argv);

}  // namespace skein
