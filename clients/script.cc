#include "clients/script.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace skein {

namespace fs = std::filesystem;

std::string UseScripts() {
  const fs::path build = fs::read_symlink("/proc/self/exe").parent_path().parent_path();
  std::error_code error;
  // In a build tree scripts/ is a link. The scripts find the checkout by the folder that it leads
  // to.
  const fs::path folder = fs::canonical(build / "scripts", error);
  if (error) throw std::runtime_error("no scripts in " + (build / "scripts").string());
  ::setenv("SKEIN_BUILD", build.c_str(), 1);
  ::setenv("SKEIN_SUBCOMMANDS", "1", 1);  // lib.sh: how messages name the scripts
  return folder;
}

int RunScript(int, char** argv) {
  const std::string script = UseScripts() + "/" + argv[0] + ".sh";
  ::execv(script.c_str(), argv);
  throw std::runtime_error("cannot run " + script + ": " + std::strerror(errno));
}

}  // namespace skein
