#include "clients/scale/engine.h"

#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>
#include <stdexcept>
#include <utility>

#include "clients/script.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "photo/photo_name.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLimitS = "60";
constexpr int kCannotRunHere = 2, kTimedOut = 124;
constexpr size_t kMaxReasonBytes = 300;

fs::path EnginesFolder() { return fs::path(UseScripts()) / "engines"; }

// A file in memory, which processes share by its descriptor.
FileDescriptor MakeFile(const std::string& content) {
  FileDescriptor file(::memfd_create("skein-engine", MFD_CLOEXEC));
  const auto size = static_cast<ssize_t>(content.size());
  if (file.get() >= 0 && ::pwrite(file.get(), content.data(), content.size(), 0) == size)
    return file;
  throw std::runtime_error(std::string("no file in memory: ") + std::strerror(errno));
}

std::string ContentOf(const FileDescriptor& file) {
  std::string content(static_cast<size_t>(std::max<off_t>(0, ::lseek(file.get(), 0, SEEK_END))), 0);
  const ssize_t size = ::pread(file.get(), content.data(), content.size(), 0);
  content.resize(static_cast<size_t>(std::max<ssize_t>(0, size)));
  return content;
}

std::string LastLine(const std::string& text) {
  std::string last;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty()) last = line;
  }
  return Printable(last, kMaxReasonBytes);
}

// Returns the exit code; -1 where no process could be started or it died of a signal.
int Run(std::vector<std::string> words, const FileDescriptor& in, const FileDescriptor& out,
        const FileDescriptor& err) {
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, in.get(), STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, out.get(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.get(), STDERR_FILENO);
  pid_t pid = 0;
  const int error = ::posix_spawnp(&pid, argv[0], &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  while (error == 0 && ::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return error == 0 && WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

class ScriptEngine : public Engine {
 public:
  explicit ScriptEngine(const std::string& name)
      : name_(name), script_(EnginesFolder() / (name + ".sh")) {}

  Result<std::vector<WorkerJob>> List() override;
  Status Submit(const std::string& batch, const std::vector<std::string>& invitations,
                const std::vector<std::string>& job_options,
                const std::vector<std::string>& launch_options) override;
  Status Cancel(const std::vector<std::string>& workers) override;

 private:
  Result<std::string> Call(std::vector<std::string> words, const std::string& input) const;

  const std::string name_;
  const std::string script_;
};

Result<std::string> ScriptEngine::Call(std::vector<std::string> words,
                                       const std::string& input) const {
  words.insert(words.begin(), {"timeout", kLimitS, script_});
  const FileDescriptor in = MakeFile(input), out = MakeFile(""), err = MakeFile("");
  const int code = Run(std::move(words), in, out, err);
  if (code == 0) return ContentOf(out);
  std::string reason = LastLine(ContentOf(err));
  if (code == kTimedOut) reason = std::string("no answer within ") + kLimitS + " s";
  if (reason.empty()) reason = "exit code " + std::to_string(code);
  return Status::Error(
      code == kCannotRunHere ? StatusCode::kFailedPrecondition : StatusCode::kUnavailable,
      name_ + ": " + reason);
}

Result<std::vector<WorkerJob>> ScriptEngine::List() {
  const Result<std::string> listed = Call({"list"}, "");
  if (!listed.ok()) return listed.status();
  std::vector<WorkerJob> jobs;
  std::istringstream lines(*listed);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, state, reason;
    words >> name >> state >> std::ws;
    std::getline(words, reason);
    if (ExpiryOfWorker(name) == 0) continue;
    jobs.push_back({name, state == "running", Printable(reason, kMaxReasonBytes)});
  }
  return jobs;
}

Status ScriptEngine::Submit(const std::string& batch, const std::vector<std::string>& invitations,
                            const std::vector<std::string>& job_options,
                            const std::vector<std::string>& launch_options) {
  std::vector<std::string> words = {"submit", batch};
  words.insert(words.end(), job_options.begin(), job_options.end());
  words.emplace_back("--");
  words.insert(words.end(), launch_options.begin(), launch_options.end());
  std::string input;
  for (const std::string& invitation : invitations) input += invitation + "\n";
  return Call(std::move(words), input).status();
}

Status ScriptEngine::Cancel(const std::vector<std::string>& workers) {
  std::vector<std::string> words = {"cancel"};
  words.insert(words.end(), workers.begin(), workers.end());
  return Call(std::move(words), "").status();
}

}  // namespace

std::vector<std::string> EngineNames() {
  std::vector<std::string> names;
  for (const fs::path& file : FilesUnder(EnginesFolder())) {
    if (file.extension() == ".sh") names.push_back(file.stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::unique_ptr<Engine> OpenEngine(const std::string& name) {
  return std::make_unique<ScriptEngine>(name);
}

}  // namespace skein
