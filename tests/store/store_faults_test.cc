// Faults of the system beneath the session folder: a call that fails, no memory, no descriptors, a
// power loss. After each of them what was acknowledged is there, and the session goes on.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "auth/session_keys.h"
#include "blobs/blob_store.h"
#include "clients/store/session_check.h"
#include "core/file.h"
#include "core/hash.h"
#include "ledger/session_folder.h"
#include "store/power_loss.h"
#include "store/scenario.h"
#include "testing/test_folder.h"

namespace skein::store_test {
namespace store_faults_test {

namespace fs = std::filesystem;

using Environment = std::map<std::string, std::string>;
using Acknowledged = std::vector<std::string>;

constexpr int kNoFault = 3;  // store_scenario's exit code
constexpr int kNumStates = 300;

fs::path InMemory() { return fs::exists("/dev/shm") ? "/dev/shm" : fs::temp_directory_path(); }

struct Ran {
  int code = 0;  // -1: ended by a signal
  Acknowledged acknowledged;
};

Ran RunScenario(const std::string& kind, const fs::path& dir, const std::string& shim = "",
                const Environment& environment = {}) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("pipe");
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
    const std::string library = std::string(SKEIN_BINARY_DIR) + "/tests/lib" + shim + ".so";
    if (!shim.empty()) setenv("LD_PRELOAD", library.c_str(), 1);
    for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
    const std::string program = std::string(SKEIN_BINARY_DIR) + "/bin/store_scenario";
    execl(program.c_str(), program.c_str(), kind.c_str(), dir.c_str(), nullptr);
    _exit(127);
  }
  close(ends[1]);
  std::string output;
  char buffer[4096];
  for (ssize_t size; (size = read(ends[0], buffer, sizeof(buffer))) > 0;) {
    output.append(buffer, static_cast<size_t>(size));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  Ran ran;
  ran.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  std::istringstream lines(output);
  for (std::string line; std::getline(lines, line);) {
    const bool is_one = line.rfind(kAcknowledged, 0) == 0;
    if (is_one) ran.acknowledged.push_back(line.substr(kAcknowledged.size()));
  }
  return ran;
}

std::string TextOf(const SessionCheck& check) {
  std::string text;
  for (const Finding& finding : check.findings)
    text += finding.what + ": " + finding.problem + "\n";
  return text;
}

// "" if nothing but what the services see to themselves was found.
std::string Damage(const SessionCheck& check) {
  const bool harmless =
      std::all_of(check.findings.begin(), check.findings.end(),
                  [](const Finding& f) { return f.remedy == Finding::Remedy::kNone; });
  return harmless ? "" : TextOf(check);
}

bool HasFactOf(const SessionCheck& check, const std::string& name) {
  return std::any_of(check.facts.begin(), check.facts.end(), [&](const Fact& fact) {
    const auto* image = std::get_if<image_t>(&fact);
    return image != nullptr && image->name == name;
  });
}

bool HasFileOf(const SessionPaths& paths, int number) {
  const Result<Bytes> file = ReadFile(paths.Image("alice", NameOf(number)).string());
  return file.ok() && *file == PhotoOf(number);
}

// What of that is lost; "" if nothing is. Before the first photo the ledger is just being made.
std::string Lost(const SessionPaths& paths, const Acknowledged& acknowledged) {
  if (acknowledged.empty()) return "";
  const SessionCheck check = CheckSession(paths);
  const bool has_photos = acknowledged.back().rfind("photo", 0) == 0;
  std::string lost = has_photos ? Damage(check) : "";
  for (const std::string& line : acknowledged) {
    const size_t space = line.find(' ');
    const std::string kind = line.substr(0, space), value = line.substr(space + 1);
    bool is_there = false;
    if (kind == "session") is_there = check.session_id == value;
    if (kind == "root") {
      const auto keys =
          OpenSessionKeys(paths.Keys().string(), check.session_id, Role::kViewer, "v");
      is_there = keys.ok() && HashBytes(keys->trust.root.data(), keys->trust.root.size()) == value;
    }
    if (kind == "photo") {
      is_there = HasFactOf(check, NameOf(std::stoi(value))) && HasFileOf(paths, std::stoi(value));
    }
    if (!is_there) lost += "lost: " + line + "\n";
  }
  return lost;
}

// The session takes the rest of the photos and is whole then.
std::string GoesOn(const fs::path& session) {
  const Ran ran = RunScenario("write", session);
  if (ran.code != 0) return "does not go on";
  const SessionCheck check = CheckSession({session});
  for (int number = 1; number <= kNumPhotos; ++number) {
    if (!HasFactOf(check, NameOf(number))) return "lacks a photo at the end\n" + TextOf(check);
  }
  return check.IsWhole() ? "" : "is not whole at the end\n" + TextOf(check);
}

struct Fault {
  const char* call;
  int error;
};
std::string TextOf(const Fault& fault) {
  return std::string(fault.call) + ": " + std::strerror(fault.error);
}

constexpr Fault kFaults[] = {{"write", EIO},  {"write", ENOSPC}, {"sync", EIO},
                             {"rename", EIO}, {"open", EMFILE},  {"malloc", ENOMEM}};

Environment FaultAt(const Fault& fault, int number, const fs::path& dir) {
  return {{"SKEIN_FAIL_CALL", fault.call},
          {"SKEIN_FAIL_AT", std::to_string(number)},
          {"SKEIN_FAIL_ERRNO", std::to_string(fault.error)},
          {"SKEIN_FAIL_UNDER", dir.string()}};
}

// Of hundreds of opens and thousands of allocations ever fewer are tried.
int Next(const Fault& fault, int number) {
  const std::string call = fault.call;
  const bool is_dense = (call != "malloc" && call != "open") || number < 50;
  return is_dense ? number + 1 : number + 1 + number / 25;
}

fs::path Below(const fs::path& dir, const std::string& subfolder) {
  return subfolder.empty() ? dir : dir / subfolder;
}

// Calls test(ran, dir) for each number of a call, until a run makes fewer. `prepare` fills dir.
void ForEachFault(const std::string& kind, const std::string& subfolder,
                  const std::function<void(const fs::path&)>& prepare,
                  const std::function<std::string(const Ran&, const fs::path&)>& test) {
  for (const Fault& fault : kFaults) {
    int num_faults = 0;
    for (int number = 1;; number = Next(fault, number)) {
      ASSERT_LT(number, 100'000) << TextOf(fault);
      const TestFolder folder(InMemory());
      prepare(folder.path());
      const Ran ran = RunScenario(kind, Below(folder.path(), subfolder), "fail_calls",
                                  FaultAt(fault, number, folder.path()));
      if (ran.code == kNoFault) break;
      ++num_faults;
      const bool may_abort = fault.error == ENOMEM;
      EXPECT_TRUE(ran.code == 0 || ran.code == 1 || (may_abort && ran.code == -1)) << ran.code;
      EXPECT_EQ(test(ran, folder.path()), "") << TextOf(fault) << ", number " << number;
      if (testing::Test::HasFailure()) return;
    }
    EXPECT_GT(num_faults, 5) << TextOf(fault);
    std::printf("%s: %d faults\n", TextOf(fault).c_str(), num_faults);
  }
}

void CopyTo(const fs::path& from, const fs::path& to) {
  const std::string command = "cp -a '" + from.string() + "' '" + to.string() + "'";
  if (std::system(command.c_str()) != 0) throw std::runtime_error(command);
}

// A session with all photos.
class WholeSession {
 public:
  WholeSession() {
    if (RunScenario("write", Path()).code != 0) throw std::runtime_error("no session");
  }
  fs::path Path() const { return folder_ / "session"; }

 private:
  TestFolder folder_{InMemory()};
};

// One fact is damaged, and of one photo a copy is missing.
void DamageSession(const SessionPaths& paths) {
  fs::remove(paths.Image("alice", NameOf(1)));
  Bytes bytes = *ReadFile(paths.Ledger().string());
  const std::string name = NameOf(3);
  const auto at = std::search(bytes.begin(), bytes.end(), name.begin(), name.end());
  ASSERT_NE(at, bytes.end());
  *at ^= 1;
  std::ofstream(paths.Ledger(), std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  ASSERT_NE(Damage(CheckSession(paths)), "");
}

// A repair that was interrupted, begun again: whole, and no more is lost than the damage took.
std::string RepairedAnew(const SessionPaths& paths) {
  if (RunScenario("repair", paths.root.parent_path()).code != 0) return "is not repaired";
  const SessionCheck check = CheckSession(paths);
  std::string lost = Damage(check);
  for (int number = 1; number <= kNumPhotos; ++number) {
    if (!HasFileOf(paths, number)) lost += "lost: photo " + std::to_string(number) + "\n";
    const bool was_damaged = number == 3;
    if (!was_damaged && !HasFactOf(check, NameOf(number))) {
      lost += "lost: the fact of photo " + std::to_string(number) + "\n";
    }
  }
  return lost;
}

TEST(StoreFaults, TakingInPhotos) {
  ForEachFault(
      "write", "session", [](const fs::path&) {},
      [](const Ran& ran, const fs::path& dir) {
        const std::string lost = Lost({dir / "session"}, ran.acknowledged);
        return lost.empty() ? GoesOn(dir / "session") : lost;
      });
}

TEST(StoreFaults, CloningASession) {
  const WholeSession whole;
  ForEachFault(
      "clone", "", [&](const fs::path& dir) { CopyTo(whole.Path(), dir / "session"); },
      [](const Ran& ran, const fs::path& dir) -> std::string {
        const SessionCheck before = CheckSession({dir / "session"});
        if (!before.IsWhole()) return "the session was damaged: " + TextOf(before);
        const bool is_there = OpenSession(dir / "clone").ok();
        if (!is_there) return ran.acknowledged.empty() ? "" : "the clone is missing";
        const SessionCheck clone = CheckSession({dir / "clone"});
        return clone.IsWhole() && clone.num_photos == kNumPhotos ? "" : TextOf(clone);
      });
}

TEST(StoreFaults, RepairingASession) {
  const WholeSession damaged;
  DamageSession({damaged.Path()});
  ForEachFault(
      "repair", "", [&](const fs::path& dir) { CopyTo(damaged.Path(), dir / "session"); },
      [](const Ran&, const fs::path& dir) { return RepairedAnew({dir / "session"}); });
}

// Calls test(acknowledged, folder) with states that a power loss leaves at some point of the run.
void ForEachState(const std::string& kind, const std::string& subfolder,
                  const std::function<void(const fs::path&)>& prepare,
                  const std::function<std::string(const Acknowledged&, const fs::path&)>& test) {
  const TestFolder folder(InMemory());
  const fs::path recorded = folder / "recorded", before = folder / "before", log = folder / "log";
  fs::create_directories(recorded);
  prepare(recorded);
  CopyTo(recorded, before);
  const Ran ran =
      RunScenario(kind, Below(recorded, subfolder), "record_writes",
                  {{"SKEIN_RECORD_UNDER", recorded.string()}, {"SKEIN_RECORD_TO", log.string()}});
  ASSERT_EQ(ran.code, 0);
  const std::vector<LogRecord> records = ReadLog(log);
  ASSERT_GT(records.size(), 20u);
  fs::remove_all(recorded);
  CopyTo(before, recorded);
  std::mt19937_64 random(1);
  for (uint64_t seed = 0; seed < kNumStates; ++seed) {
    PowerLoss loss(recorded);
    const size_t end = 1 + random() % records.size();
    for (size_t i = 0; i < end; ++i) loss.Apply(records[i]);
    const fs::path state = folder / "state";
    loss.WriteState(seed, state);
    EXPECT_EQ(test(loss.notes(), state), "")
        << "seed " << seed << ", after " << end << " of " << records.size() << " records";
    if (testing::Test::HasFailure()) return;
    fs::remove_all(state);
  }
}

TEST(PowerLoss, TakingInPhotos) {
  ForEachState(
      "write", "session", [](const fs::path&) {},
      [](const Acknowledged& acknowledged, const fs::path& dir) {
        const std::string lost = Lost({dir / "session"}, acknowledged);
        return lost.empty() ? GoesOn(dir / "session") : lost;
      });
}

TEST(PowerLoss, RepairingASession) {
  const WholeSession damaged;
  DamageSession({damaged.Path()});
  ForEachState(
      "repair", "", [&](const fs::path& dir) { CopyTo(damaged.Path(), dir / "session"); },
      [](const Acknowledged&, const fs::path& dir) { return RepairedAnew({dir / "session"}); });
}

TEST(PowerLoss, CloningASession) {
  const WholeSession whole;
  ForEachState(
      "clone", "", [&](const fs::path& dir) { CopyTo(whole.Path(), dir / "session"); },
      [](const Acknowledged& acknowledged, const fs::path& dir) -> std::string {
        if (!CheckSession({dir / "session"}).IsWhole()) return "the session was damaged";
        if (acknowledged.empty()) return "";
        const SessionCheck clone = CheckSession({dir / "clone"});
        return clone.IsWhole() && clone.num_photos == kNumPhotos ? "" : TextOf(clone);
      });
}

}  // namespace store_faults_test
}  // namespace skein::store_test
