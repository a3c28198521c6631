#include "role_matrix/attacks.h"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "auth/revocations.h"
#include "core/clock.h"
#include "transport/invitation.h"

namespace skein {
namespace {

// All of it is said as a worker's advice, which a worker may give.
class Attacks {
 public:
  Attacks(Trial* trial, const Session& session, const SessionTrust& trust)
      : trial_(trial),
        session_(session),
        trust_(trust),
        mouth_(trial->Connect()),
        worker_(Invite("steady")),
        seal_(SealOf(worker_)) {}

  // Whether all went as it must.
  bool Run() {
    Repeat();
    Alter();
    ComeLate();
    ForgeCertificates();
    ComeFromElsewhere();
    Expire();
    Revoke();
    return is_right_;
  }

 private:
  SessionAccess Invite(const std::string& name, int64_t expires_s = 0,
                       Role role = Role::kWorker) const {
    return Need(
        IssueInvitation(session_.paths.Keys().string(), trust_.session_id, role, name, expires_s));
  }
  SessionAccess With(const SigningKey& key, const Certificate& certificate) const {
    return {trust_, {key, certificate}, {}};
  }

  // A message as no other is.
  Sent Advice(MessageSeal* seal, const std::string& name) {
    advice_t advice{};
    advice.session_id = trust_.session_id;
    advice.author = name;
    advice.submap_id = ++num_made_;
    return {false, kAdviceChannel.name, seal->Seal(kAdviceChannel.name, Encode(advice))};
  }
  Sent Advice() { return Advice(&seal_, worker_.credential.certificate.name); }
  std::vector<Sent> Advices(int count) {
    std::vector<Sent> messages;
    for (int i = 0; i < count; ++i) messages.push_back(Advice());
    return messages;
  }
  Sent AdviceOf(const SessionAccess& access) {
    MessageSeal seal = SealOf(access);
    return Advice(&seal, access.credential.certificate.name);
  }

  void Expect(bool heard, const char* what, const std::vector<Sent>& messages) {
    ExpectOver(mouth_.get(), heard, what, messages);
  }
  void ExpectOver(Mouth* mouth, bool heard, const char* what, const std::vector<Sent>& messages) {
    const std::vector<bool> got = trial_->Say(mouth, messages);
    const auto count = std::count(got.begin(), got.end(), true);
    const bool is_right = count == (heard ? static_cast<std::ptrdiff_t>(messages.size()) : 0);
    is_right_ = is_right_ && is_right;
    std::printf("%s\t%zu\t%td%s\n", what, messages.size(), count, is_right ? "" : "\tWRONG");
  }

  void Repeat() {
    const Sent message = Advice();
    Expect(true, "signed by a worker", {message});
    Expect(false, "the same again", {message});
    const auto stranger = trial_->Connect();
    ExpectOver(stranger.get(), false, "the same again, by another connection", {message});
  }

  void Alter() {
    const Sent message = Advice();
    std::vector<Sent> altered(message.bytes.size(), message);
    for (size_t i = 0; i < altered.size(); ++i) {
      altered[i].bytes[i] ^= static_cast<uint8_t>(1u << (i % 8));
    }
    const auto trailer =
        altered.begin() + static_cast<std::ptrdiff_t>(SizeWithoutTrailer(message.bytes));
    Expect(false, "one bit of the message altered", {altered.begin(), trailer});
    Expect(false, "one bit of the trailer altered", {trailer, altered.end()});
    Expect(false, "its trailer taken away",
           {{false, message.channel, WithoutTrailer(message.bytes)}});
    Expect(false, "on another channel than it was signed for",
           {{false, kGuidanceChannel.name, message.bytes}});
    Expect(true, "the message itself after these", {message});
  }

  void ComeLate() {
    constexpr int kWindow = static_cast<int>(ReplayWindow::kSize);
    const Sent late = Advice();
    Expect(true, "newer ones, fewer than the window", Advices(kWindow - 1));
    Expect(true, "an older one behind them", {late});
    const Sent too_late = Advice();
    Expect(true, "newer ones, two windows", Advices(2 * kWindow));
    Expect(false, "an older one behind them", {too_late});
  }

  void ForgeCertificates() {
    const Credential& own = worker_.credential;
    Certificate renamed = own.certificate;
    renamed.name = "guide";
    Expect(false, "another name in the own certificate", {AdviceOf(With(own.key, renamed))});
    const Credential viewer = Invite("curious", 0, Role::kViewer).credential;
    Certificate raised = viewer.certificate;
    raised.role = Role::kWorker;
    Expect(false, "a higher role in the own certificate", {AdviceOf(With(viewer.key, raised))});
    Expect(false, "another's certificate, signed by an own key",
           {AdviceOf(With(SigningKey::Generate(), own.certificate))});
  }

  void ComeFromElsewhere() {
    const SigningKey root = SigningKey::Generate();
    const std::string other_id = trust_.session_id == kOtherId ? kYetAnotherId : kOtherId;
    for (const std::string& id : {trust_.session_id, other_id}) {
      const Credential credential = IssueCredential(root, id, Role::kWorker, "steady", 0);
      Expect(false,
             id == other_id ? "another session's credential"
                            : "another root's credential for this session",
             {AdviceOf({{id, root.public_key()}, credential, {}})});
    }
    Expect(false, "this session's credential, signed for another session",
           {AdviceOf({{other_id, trust_.root}, worker_.credential, {}})});
  }

  void Expire() {
    const int64_t expires_s = NowUs() / 1'000'000 + kShortLifeS;
    const SessionAccess access = Invite("short-lived", expires_s);
    Expect(true, "before its certificate expires", {AdviceOf(access)});
    while (NowUs() / 1'000'000 < expires_s) trial_->loop().RunUntil([] { return false; }, 0.1);
    Expect(false, "after its certificate expires", {AdviceOf(access)});
    Certificate prolonged = access.credential.certificate;
    prolonged.expires_s = 0;
    Expect(false, "with a later expiry in it", {AdviceOf(With(access.credential.key, prolonged))});
  }

  // Who checks looks at the list once a second.
  void Revoke() {
    const SessionAccess access = Invite("lost");
    Expect(true, "before it is revoked", {AdviceOf(access)});
    const Status revoked = RevokeName(session_.paths.Keys().string(), "lost");
    if (!revoked.ok()) throw std::runtime_error(revoked.error());
    const double deadline_s = trial_->loop().now_s() + kRevokedWithinS;
    while (trial_->Say(mouth_.get(), {AdviceOf(access)}).front()) {
      if (trial_->loop().now_s() > deadline_s) break;
      trial_->loop().RunUntil([] { return false; }, 0.1);
    }
    Expect(false, "after it is revoked", {AdviceOf(access), AdviceOf(access)});
  }

  static constexpr char kOtherId[] = "0123456789abcdef", kYetAnotherId[] = "fedcba9876543210";
  static constexpr int64_t kShortLifeS = 5;
  static constexpr double kRevokedWithinS = 10;

  Trial* const trial_;
  const Session session_;
  const SessionTrust trust_;
  const std::unique_ptr<Mouth> mouth_;
  const SessionAccess worker_;
  MessageSeal seal_;
  int64_t num_made_ = 0;
  bool is_right_ = true;
};

}  // namespace

bool RunAttacks(Trial* trial, const Session& session, const SessionTrust& trust) {
  return Attacks(trial, session, trust).Run();
}

}  // namespace skein
