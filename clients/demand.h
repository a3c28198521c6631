#pragma once

#include <string>

namespace skein {

// `skein demand`: how many more mappers a session could use, for scripts/launch.sh.
int RunDemand(int argc, char** argv);

// The shortage as a user reads it in `skein status` and on the page: "2 more mappers wanted".
std::string MappersWanted(int num_short);

}  // namespace skein
