// flooder URL [LINK]: a hostile client at full speed, until it is killed. Without LINK it says
// again, with one bit altered, a signed message that it hears: each costs who checks it a
// signature. With LINK it says heartbeats of its own, which everybody takes. Prints "ready flooder"
// when it begins.
#include <cstdio>
#include <memory>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/log.h"
#include "transport/bus.h"
#include "transport/invitation.h"

namespace skein {
namespace {

constexpr double kPeriodS = 0.001;

class Flooder {
 public:
  Flooder(PollLoop& loop, const std::string& url)
      : link_(MakeLink(ParseLcmUrl(url), loop, [this](const std::string&, const Bytes& message) {
          if (overheard_.empty() && SizeWithoutTrailer(message) < message.size()) Keep(message);
        })) {
    loop.AddTimer(kPeriodS, [this] { Flood(); });
  }

  void ListenFirst() { link_->Subscribe(kHeartbeatChannel.name); }
  void SignAs(const Invitation& invitation) {
    const std::string& name = invitation.credential.certificate.name;
    heartbeat_.session_id = invitation.trust.session_id;
    heartbeat_.instance =
        invitation.credential.certificate.role == Role::kAgent ? AgentInstance(name) : name;
    seal_.emplace(invitation.trust, invitation.credential, SignerCounters(), NowUs);
    Begin();
  }

 private:
  void Keep(const Bytes& message) {
    overheard_ = message;
    overheard_.front() ^= 1;
    link_->Unsubscribe(kHeartbeatChannel.name);
    Begin();
  }
  void Begin() {
    std::printf("ready flooder\n");
    std::fflush(stdout);
  }

  // As much as the connection takes.
  void Flood() {
    if (!seal_ && overheard_.empty()) return;
    for (bool goes = true; goes;) {
      const Bytes message = seal_ ? OwnMessage() : overheard_;
      goes = link_->Publish(kHeartbeatChannel.name, message.data(), message.size());
    }
  }
  Bytes OwnMessage() {
    Bytes bytes(heartbeat_.getEncodedSize());
    heartbeat_.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return seal_->Seal(kHeartbeatChannel.name, bytes);
  }

  const std::unique_ptr<Link> link_;
  std::optional<MessageSeal> seal_;
  heartbeat_t heartbeat_{};
  Bytes overheard_;  // and altered
};

int Run(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: flooder URL [LINK]\n");
    return 2;
  }
  InitLog("flooder", false);
  PollLoop loop;
  Flooder flooder(loop, argv[1]);
  if (argc > 2) {
    const Result<Invitation> invitation = ReadInvitation(argv[2]);
    if (!invitation.ok()) {
      std::fprintf(stderr, "flooder: %s\n", invitation.error().c_str());
      return 2;
    }
    flooder.SignAs(*invitation);
  } else {
    flooder.ListenFirst();
  }
  loop.Run();
  return 0;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) { return skein::Run(argc, argv); }
