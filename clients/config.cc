#include "clients/config.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

#include "clients/subcommand.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr const char* kServices[] = {"ingest", "features", "retrieval", "matching", "mapper",
                                     "merger", "guide",    "dense",     "relay",    "web"};

// A service knows its options itself. Its output is ours.
int Run(std::vector<std::string> words) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  int status = 0;
  const int error = ::posix_spawn(&pid, argv[0], nullptr, nullptr, argv.data(), environ);
  if (error != 0 || ::waitpid(pid, &status, 0) != pid) {
    throw std::runtime_error("cannot run " + words[0] + ": build it, it belongs beside skein");
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : kExitError;
}

}  // namespace

int RunConfig(int argc, char** argv) {
  std::string file;
  CLI::App app("Prints every service's options with their defaults, as a file for --config.",
               "skein config");
  app.add_option("--config", file, "With the values of this file in place of the defaults")
      ->check(CLI::ExistingFile);
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  const fs::path folder = fs::read_symlink("/proc/self/exe").parent_path();
  for (const char* service : kServices) {
    std::fflush(stdout);
    const fs::path program = folder / (std::string("skein-") + service);
    if (!fs::exists(program)) {
      std::printf("# skein-%s is not built: its options are not here\n\n", service);
      continue;
    }
    std::vector<std::string> words = {program, "--print-config"};
    if (!file.empty()) words.insert(words.end(), {"--config", file});
    if (const int code = Run(words); code != 0) return code;
    std::printf("\n");
  }
  return kExitOk;
}

}  // namespace skein
