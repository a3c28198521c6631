// The `skein` command: runs the subcommand that its first argument names.
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "clients/advise.h"
#include "clients/agent.h"
#include "clients/config.h"
#include "clients/demand.h"
#include "clients/evaluate.h"
#include "clients/export/export.h"
#include "clients/finish.h"
#include "clients/invite.h"
#include "clients/launched.h"
#include "clients/probe.h"
#include "clients/revoke.h"
#include "clients/scale/scale.h"
#include "clients/script.h"
#include "clients/sim/sim.h"
#include "clients/status.h"
#include "clients/store/commands.h"
#include "clients/subcommand.h"
#include "clients/view/view.h"
#include "core/one_line.h"
#include "core/version.h"

namespace {

using skein::Subcommand;

// Sorted as a user meets them.
const std::vector<Subcommand> kSubcommands = {
    {"demo", "reconstructs a synthetic place, to see all of it at work", skein::RunScript},
    {"reconstruct", "folders of photos in, a model out", skein::RunScript},
    {"launch", "runs the services of a session, until Ctrl-C", skein::RunScript},
    {"agent", "publishes the photos of a folder to a session", skein::RunAgent},
    {"status", "stages, photos, maps and failures of a session, live", skein::RunStatus},
    {"advise", "how complete each place is, and what to photograph next, live", skein::RunAdvise},
    {"demand", "how many more mappers a session could use (for skein launch)", skein::RunDemand},
    {"view", "a session folder in a browser, without services", skein::RunView},
    {"finish", "finishes a session: final models and report", skein::RunFinish},
    {"invite", "a link and a QR code with which another host or person takes part",
     skein::RunInvite},
    {"scale", "workers come and go with a session's backlog, by Slurm or on this host",
     skein::RunScale},
    {"revoke", "takes an invitation back", skein::RunRevoke},
    {"probe", "does an LCM URL carry messages on this host?", skein::RunProbe},
    {"sim", "simulated agents photograph a synthetic place with exact poses", skein::RunSim},
    {"export", "models, features and matches for other programs; pictures", skein::RunExport},
    {"admit", "may services open this session folder? (for skein launch)", skein::RunAdmit},
    {"launched", "notes in a session folder where it runs (for skein launch)", skein::RunLaunched},
    {"check", "is a session folder whole? what is damaged, and what becomes of it",
     skein::RunCheck},
    {"repair", "makes a damaged session folder whole", skein::RunRepair},
    {"clone", "copies a session under an id of its own", skein::RunClone},
    {"config", "every service's options with their defaults, as a file for --config",
     skein::RunConfig},
    {"evaluate", "a model's camera poses against a ground truth", skein::RunEvaluate},
};

void PrintUsage(std::ostream& out) {
  out << "Usage: skein SUBCOMMAND [options]      (skein SUBCOMMAND --help tells its options)\n\n";
  for (const Subcommand& subcommand : kSubcommands) {
    out << "  " << subcommand.name << std::string(12 - std::string(subcommand.name).size(), ' ')
        << subcommand.help << "\n";
  }
  out << "\n  --help      this text\n  --version   version and commit\n"
      << "\nExit codes: 0 done, 1 error, 2 bad usage.\n";
}

int RunSubcommand(const Subcommand& subcommand, int argc, char** argv) {
  try {
    return subcommand.run(argc, argv);
  } catch (const std::exception& e) {
    std::cerr << "skein " << subcommand.name << ": " << skein::OneLine(e.what()) << std::endl;
    return skein::kExitError;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  if (first == "--help" || first == "-h") {
    PrintUsage(std::cout);
    return skein::kExitOk;
  }
  if (first == "--version") {
    std::cout << "skein " << skein::VersionWithCommit() << std::endl;
    return skein::kExitOk;
  }
  for (const Subcommand& subcommand : kSubcommands) {
    if (first == subcommand.name) return RunSubcommand(subcommand, argc - 1, argv + 1);
  }
  std::cerr << (first.empty() ? "skein: say which subcommand\n"
                              : "skein: there is no subcommand '" + first + "'\n");
  PrintUsage(std::cerr);
  return skein::kExitUsage;
}
