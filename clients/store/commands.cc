#include "clients/store/commands.h"

#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>

#include "clients/progress_bar.h"
#include "clients/store/session_admit.h"
#include "clients/store/session_check.h"
#include "clients/store/session_clone.h"
#include "clients/store/session_repair.h"
#include "clients/subcommand.h"
#include "core/one_line.h"

namespace skein {
namespace {

constexpr int kProgressSteps = 100;

Progress ShowIn(ProgressBar* bar) {
  return [bar](double part) { bar->Set(std::lround(part * kProgressSteps)); };
}

void Print(const SessionCheck& check, std::ostream& out) {
  for (const Finding& finding : check.findings) {
    out << OneLine(finding.what + ": " + finding.problem) << " (" << TextOf(finding.remedy)
        << ")\n";
  }
  out << check.facts.size() << " facts, " << check.num_photos << " photos, " << check.num_blobs
      << " blobs: "
      << (check.IsWhole() ? "all whole" : std::to_string(check.findings.size()) + " findings")
      << std::endl;
}

nlohmann::json ToJson(const SessionCheck& check) {
  nlohmann::json findings = nlohmann::json::array();
  for (const Finding& finding : check.findings) {
    findings.push_back(
        {{"what", finding.what}, {"problem", finding.problem}, {"remedy", TextOf(finding.remedy)}});
  }
  return {{"facts", check.facts.size()},
          {"photos", check.num_photos},
          {"blobs", check.num_blobs},
          {"findings", findings}};
}

bool IsSession(const std::string& dir, const char* command) {
  if (std::filesystem::exists(SessionPaths{dir}.Ledger()) ||
      std::filesystem::exists(SessionPaths{dir}.SessionFile())) {
    return true;
  }
  std::cerr << "skein " << command << ": " << dir << " holds no session" << std::endl;
  return false;
}

// Damage that costs nothing does not count.
bool HasLoss(const SessionCheck& check) {
  for (const Finding& finding : check.findings) {
    if (finding.remedy != Finding::Remedy::kNone) return true;
  }
  return false;
}

}  // namespace

int RunAdmit(int argc, char** argv) {
  std::string dir;
  bool adopt = false;
  CLI::App app(
      "Whether services may open a session folder, before they do: it holds regular files and\n"
      "folders alone, and its keys were made by this user on this host. A folder that is missing "
      "may\n"
      "be made. `skein launch` asks this.",
      "skein admit");
  app.add_option("SESSION", dir, "Session folder")->required();
  app.add_flag("--adopt", adopt,
               "Take a session that was made elsewhere: its keys go to SESSION/damaged, all "
               "invitations end");
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  const Result<std::vector<std::string>> done = AdmitSession(SessionPaths{dir}, adopt);
  if (!done.ok()) {
    std::cerr << "skein admit: " << OneLine(done.error()) << std::endl;
    return kExitError;
  }
  for (const std::string& line : *done) std::cout << OneLine(line) << std::endl;
  return kExitOk;
}

int RunCheck(int argc, char** argv) {
  std::string dir;
  bool as_json = false;
  CLI::App app(
      "Reads all of a session folder and says what is damaged, and what becomes of it. The "
      "session\n"
      "may be in use. Exits with 1 if `skein repair` or an agent has something to do.",
      "skein check");
  app.add_option("SESSION", dir, "Session folder")->required();
  app.add_flag("--json", as_json, "Print JSON");
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  if (!IsSession(dir, "check")) return kExitError;
  ProgressBar bar("checking", kProgressSteps);
  const SessionCheck check = CheckSession(SessionPaths{dir}, ShowIn(&bar));
  if (as_json) {
    const auto replace = nlohmann::json::error_handler_t::replace;
    std::cout << ToJson(check).dump(2, ' ', false, replace) << std::endl;
  } else {
    Print(check, std::cout);
  }
  return HasLoss(check) ? kExitError : kExitOk;
}

int RunRepair(int argc, char** argv) {
  std::string dir;
  CLI::App app(
      "Makes a damaged session folder whole. What is damaged goes to SESSION/damaged. Photos and\n"
      "what is known of them stays; where facts are lost the maps are made anew. The session's\n"
      "services must not run.",
      "skein repair");
  app.add_option("SESSION", dir, "Session folder")->required();
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  if (!IsSession(dir, "repair")) return kExitError;
  ProgressBar bar("checking", kProgressSteps);
  const Result<Repaired> repaired = RepairSession(SessionPaths{dir}, ShowIn(&bar));
  if (!repaired.ok()) {
    std::cerr << "skein repair: " << OneLine(repaired.error()) << std::endl;
    return kExitError;
  }
  for (const std::string& line : repaired->done) std::cout << OneLine(line) << "\n";
  for (const std::string& photo : repaired->photos_to_send) {
    std::cout << "photo " << OneLine(photo) << " is lost here: send it again\n";
  }
  if (repaired->services_must_run) {
    std::cout << "now start the services (skein launch --session " << dir
              << ") and run `skein finish`\n";
  }
  if (repaired->done.empty() && repaired->photos_to_send.empty()) std::cout << "all is whole\n";
  std::cout.flush();
  return kExitOk;
}

int RunClone(int argc, char** argv) {
  std::string from, to;
  CLI::App app(
      "Copies a session under an id of its own, so that both may run. A plain copy of the folder\n"
      "has the same id, and is refused while the original is there.",
      "skein clone");
  app.add_option("SESSION", from, "Session folder; it may be in use")->required();
  app.add_option("NEW", to, "Folder to make")->required();
  if (const auto code = ParseOptions(&app, argc, argv)) return *code;
  ProgressBar bar("copying", kProgressSteps);
  const Result<Session> clone = CloneSession(SessionPaths{from}, to, ShowIn(&bar));
  if (!clone.ok()) {
    std::cerr << "skein clone: " << OneLine(clone.error()) << std::endl;
    return kExitError;
  }
  std::cout << to << " is session " << clone->session_id << std::endl;
  return kExitOk;
}

}  // namespace skein
