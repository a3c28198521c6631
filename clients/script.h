// `skein launch`, `skein reconstruct`, `skein demo`: shell scripts that lie in scripts/ beside the
// folder of this program.
#pragma once

#include <string>

namespace skein {

// The folder of the scripts. From now on the scripts that this process starts take the programs of
// this build. Throws std::runtime_error where the folder is missing.
std::string UseScripts();

// Becomes the script argv[0].sh, with the programs of this build: its exit code and its signals are
// the script's. Throws std::runtime_error if the script cannot be run.
int RunScript(int argc, char** argv);

}  // namespace skein
