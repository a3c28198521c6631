#include "web/visitors.h"

#include <arpa/inet.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "auth/session_keys.h"
#include "auth/web_pass.h"
#include "core/clock.h"
#include "core/process.h"
#include "invite/browser_link.h"
#include "ledger/session_folder.h"

namespace skein {
namespace {

// Phones keep several connections each.
constexpr int kMaxPublicConnections = 256;

// An address is listened on alone; a name may have several.
std::string AddressToListenOn(const std::string& host) {
  in_addr v4{};
  in6_addr v6{};
  const bool is_address =
      ::inet_pton(AF_INET, host.c_str(), &v4) == 1 || ::inet_pton(AF_INET6, host.c_str(), &v6) == 1;
  return is_address ? host : "0.0.0.0";
}

}  // namespace

Status CheckVisitors(const NodeOptions& options) {
  if (options.session_dir.empty()) {
    return InvalidArgument(
        "--public-host lets in who has an invitation, and these are the session folder's: give "
        "--session DIR, on its host");
  }
  if (options.auth == "off") {
    return InvalidArgument(
        "--public-host lets in who has an invitation, and with --auth off there are none: leave "
        "one of the two out");
  }
  return Status::Ok();
}

Visitors::Visitors(std::string keys_dir, SessionTrust trust,
                   std::optional<WebCertificate> certificate, const WebOptions& options,
                   WatchedRevocations::RunJob run_job)
    : keys_dir_(std::move(keys_dir)),
      trust_(std::move(trust)),
      certificate_(std::move(certificate)),
      host_(options.public_host),
      public_port_(options.public_port),
      plain_port_(options.plain_port),
      revocations_(keys_dir_, std::move(run_job)) {
  if (!certificate_) return;
  addresses_.secure = "https://" + HostInUrl(host_) + ":" + std::to_string(public_port_);
  if (plain_port_ != 0) {
    addresses_.plain = "http://" + HostInUrl(host_) + ":" + std::to_string(plain_port_);
  }
  addresses_.fingerprint = certificate_->fingerprint;
  addresses_.certificate_der = certificate_->issuer_der;
}

void Visitors::LetIn(WebServerOptions* server) const {
  server->access = PassAccess{host_, {}, trust_, revocations_};
  if (!certificate_) return;
  const std::string address = AddressToListenOn(host_);
  server->access->doors.push_back({address, public_port_, certificate_});
  if (plain_port_ != 0) server->access->doors.push_back({address, plain_port_, std::nullopt});
  server->max_connections = std::max(server->max_connections, kMaxPublicConnections);
}

Result<WebInvitation> Visitors::Invite(Role role, const std::string& name,
                                       int64_t expires_s) const {
  WebInvitation invitation;
  invitation.name =
      name.empty() ? std::string(RoleName(role)) + "-" + std::to_string(RandomU64() % 1'000'000)
                   : name;
  const Result<std::string> pass =
      IssueWebPass(keys_dir_, trust_.session_id, {role, invitation.name, expires_s});
  if (!pass.ok()) return pass.status();
  invitation.secure_link = BrowserLink(addresses_.secure, role, *pass);
  if (!addresses_.plain.empty()) {
    invitation.plain_link = BrowserLink(addresses_.plain, role, *pass);
  }
  return invitation;
}

Visitors OpenVisitors(const Node& node, const WebOptions& options,
                      WatchedRevocations::RunJob run_job) {
  const std::string keys = SessionPaths{node.options().session_dir}.Keys().string();
  const Result<SessionAccess> access =
      OpenSessionKeys(keys, node.session_id(), Role::kWeb, node.options().signer.certified_name);
  if (!access.ok()) throw std::runtime_error(access.error());
  if (!options.is_public()) {
    return {keys, access->trust, std::nullopt, options, std::move(run_job)};
  }
  try {
    const Result<WebCertificate> certificate =
        OpenWebCertificate(keys, {options.public_host}, NowUs() / 1'000'000);
    if (!certificate.ok()) throw std::runtime_error(certificate.error());
    return {keys, access->trust, *certificate, options, std::move(run_job)};
  } catch (const std::invalid_argument&) {
    throw std::runtime_error("--public-host " + options.public_host +
                             ": give this host's address or name, without a port");
  }
}

}  // namespace skein
