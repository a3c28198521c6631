#include "clients/sim/publish.h"

#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

extern char** environ;

namespace skein::sim {
namespace {

pid_t Start(const std::string& program, std::vector<std::string> arguments) {
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  pid_t pid = 0;
  const int error = posix_spawn(&pid, program.c_str(), nullptr, nullptr, argv.data(), environ);
  if (error != 0) throw std::runtime_error("cannot start " + program + ": " + std::strerror(error));
  return pid;
}

int Wait(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0) {
    if (errno != EINTR) return 1;
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 1;
}

std::vector<std::string> AgentCommand(const RenderedAgent& agent, const PublishOptions& options) {
  std::vector<std::string> arguments = {"skein",    "agent",    "--name",
                                        agent.name, "--images", agent.folder};
  arguments.insert(arguments.end(), options.session.begin(), options.session.end());
  return arguments;
}

}  // namespace

int PublishSession(const std::string& program, const std::vector<RenderedAgent>& agents,
                   const PublishOptions& options) {
  int worst = 0;
  std::vector<pid_t> running;
  for (const RenderedAgent& agent : agents) {
    running.push_back(Start(program, AgentCommand(agent, options)));
    if (options.one_after_the_other) {
      worst = std::max(worst, Wait(running.back()));
      running.clear();
    }
  }
  for (const pid_t pid : running) worst = std::max(worst, Wait(pid));
  return worst;
}

WatchingAgents::WatchingAgents(const std::string& program, const std::vector<RenderedAgent>& agents,
                               const PublishOptions& options) {
  for (const RenderedAgent& agent : agents) {
    std::vector<std::string> arguments = AgentCommand(agent, options);
    arguments.push_back("--watch");
    running_.push_back(Start(program, arguments));
  }
}

WatchingAgents::~WatchingAgents() {
  for (const pid_t pid : running_) kill(pid, SIGTERM);
  for (const pid_t pid : running_) Wait(pid);
}

}  // namespace skein::sim
