// role_matrix table|names|attacks relay|receiver require|warn URL SESSION LINK...
//
// Says in each role what it may and what it may not say, and tells what was heard. SESSION is the
// session's folder; each LINK is an invitation. Ingest, the web server and who signs nothing come
// beside them.
//
//   table    each role speaks in its own name on each channel; prints channel by role
//   names    the same in another's name
//   attacks  messages again, late, altered, of other roots, expired, revoked; a table of them.
//   Fails
//            where one was heard that must not be, or the other way round.
//
// relay: who listens takes all that comes, so the relay alone refuses. receiver: who listens is a
// Bus of the session, which refuses by itself; nobody else may speak on that URL then.
//
// The last line is "sent N, heard N, refused N". Exit codes: 0, 1 for a failure, 2 for bad usage.
#include <cstdio>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "auth/session_keys.h"
#include "core/log.h"
#include "ledger/session_folder.h"
#include "role_matrix/attacks.h"
#include "role_matrix/messages.h"
#include "role_matrix/trial.h"
#include "transport/invitation.h"

namespace skein {
namespace {

// A column of the table.
struct Speaking {
  std::string role;
  Name name;
  std::optional<MessageSeal> seal;  // none: it signs nothing
};

Speaking SpeakingAs(const SessionAccess& access) {
  const Certificate& certificate = access.credential.certificate;
  const bool is_agent = certificate.role == Role::kAgent;
  return {RoleName(certificate.role),
          {certificate.name, is_agent ? AgentInstance(certificate.name) : certificate.name},
          SealOf(access)};
}

// Each role on each channel; `as`: in that name, else in its own.
void PrintTable(Trial* trial, std::vector<Speaking> roles, const std::optional<Name>& as) {
  const std::vector<Row> rows = AllRows();
  std::vector<std::string> lines = {"channel"};
  for (const Row& row : rows) lines.push_back(row.label);
  for (Speaking& role : roles) {
    std::vector<Sent> messages;
    for (const Row& row : rows) {
      const Bytes message = row.message(trial->session_id(), as.value_or(role.name));
      messages.push_back(
          {row.bulk, row.channel, role.seal ? role.seal->Seal(row.channel, message) : message});
    }
    const auto mouth = trial->Connect();
    const std::vector<bool> heard = trial->Say(mouth.get(), messages);
    lines.front() += "\t" + role.role;
    for (size_t i = 0; i < rows.size(); ++i) lines[i + 1] += heard[i] ? "\tyes" : "\tno";
  }
  for (const std::string& line : lines) std::printf("%s\n", line.c_str());
}

struct Options {
  std::string what;
  bool at_relay = false;
  bool takes_unsigned = false;
  LcmUrl url;
  std::string session_dir;
  std::vector<std::string> links;
};

std::optional<Options> ParseArguments(int argc, char** argv) {
  if (argc < 6) return std::nullopt;
  const std::string what = argv[1], where = argv[2], auth = argv[3];
  if (what != "table" && what != "names" && what != "attacks") return std::nullopt;
  if (where != "relay" && where != "receiver") return std::nullopt;
  if (auth != "require" && auth != "warn") return std::nullopt;
  return Options{what,    where == "relay",       auth == "warn", ParseLcmUrl(argv[4]),
                 argv[5], {argv + 6, argv + argc}};
}

std::vector<Speaking> AllRoles(const Options& options,
                               const std::function<SessionAccess(Role, const char*)>& own) {
  std::vector<Speaking> roles;
  for (const std::string& link : options.links) {
    const Invitation invitation = Need(ReadInvitation(link));
    roles.push_back(SpeakingAs({invitation.trust, invitation.credential, {}}));
  }
  roles.push_back(SpeakingAs(own(Role::kIngest, "ingest")));
  roles.push_back(SpeakingAs(own(Role::kWeb, "web")));
  roles.push_back({"unsigned", {"nobody", AgentInstance("nobody")}, std::nullopt});
  return roles;
}

int Run(const Options& options) {
  PollLoop loop;
  const Session session = Need(OpenOrCreateSession(options.session_dir));
  const std::string keys_dir = session.paths.Keys().string();
  const auto own = [&](Role role, const char* name) {
    return Need(OpenSessionKeys(keys_dir, session.session_id, role, name));
  };
  const SessionAccess listener = own(Role::kViewer, "listener");
  std::unique_ptr<Ear> ear;
  ReceiverEar* receiver = nullptr;
  if (options.at_relay) {
    ear = std::make_unique<RawEar>(loop, options.url);
  } else {
    ear = std::make_unique<ReceiverEar>(loop, options.url, listener, keys_dir,
                                        options.takes_unsigned);
    receiver = static_cast<ReceiverEar*>(ear.get());
  }
  Trial trial(loop, options.url, ear.get(), own(Role::kViewer, "marker"));
  bool is_right = true;
  if (options.what == "attacks") {
    is_right = RunAttacks(&trial, session, listener.trust);
  } else {
    std::optional<Name> as;
    if (options.what == "names") as = Name{"somebody", "somebody"};
    PrintTable(&trial, AllRoles(options, own), as);
  }
  const int64_t num_refused = trial.num_sent() - trial.num_heard();
  if (receiver != nullptr && receiver->num_refused() != num_refused) {
    throw std::runtime_error("refused " + std::to_string(num_refused) + ", counted " +
                             std::to_string(receiver->num_refused()));
  }
  std::printf("sent %ld, heard %ld, refused %ld\n", trial.num_sent(), trial.num_heard(),
              num_refused);
  return is_right ? 0 : 1;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  skein::InitLog("role_matrix", false);
  try {
    const auto options = skein::ParseArguments(argc, argv);
    if (options) return skein::Run(*options);
    std::fprintf(stderr,
                 "usage: role_matrix table|names|attacks relay|receiver require|warn URL SESSION "
                 "LINK...\n");
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "role_matrix: %s\n", error.what());
    return 1;
  }
}
