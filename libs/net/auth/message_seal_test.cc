#include "auth/message_seal.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "core/clock.h"

namespace skein::message_seal_test {

constexpr char kSession[] = "0123456789abcdef";
constexpr char kChannel[] = "SKEIN_IMAGE_OFFER";
using Kind = OpenedMessage::Kind;

class MessageSealTest : public testing::Test {
 protected:
  MessageSeal Make(Role role, const std::string& name, int64_t expires_s = 0,
                   SignerCounters used = {}) {
    return MakeWith(IssueCredential(root_, kSession, role, name, expires_s), std::move(used));
  }
  MessageSeal MakeWith(Credential credential, SignerCounters used = {}) {
    return {trust_, std::move(credential), std::move(used), [this] { return now_us_; }};
  }
  void ExpectRefused(const OpenedMessage& opened, const std::string& reason) {
    EXPECT_EQ(opened.kind, Kind::kRefused);
    EXPECT_EQ(opened.reason, reason);
  }

  const SigningKey root_ = SigningKey::Generate();
  const SessionTrust trust_{kSession, root_.public_key()};
  int64_t now_us_ = 1'700'000'000'000'000;
  const Bytes message_{1, 2, 3, 4, 5, 6, 7, 8, 9, 10};
  MessageSeal receiver_ = Make(Role::kIngest, "ingest");
};

TEST_F(MessageSealTest, TellsWhoSignedWhat) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes sealed = alice.Seal(kChannel, message_);
  EXPECT_LE(sealed.size(), message_.size() + kMaxTrailerBytes);
  const OpenedMessage opened = receiver_.Open(kChannel, sealed);
  ASSERT_EQ(opened.kind, Kind::kSigned) << opened.reason;
  EXPECT_EQ(opened.size, message_.size());
  EXPECT_EQ(opened.speaker.role, Role::kAgent);
  EXPECT_EQ(opened.speaker.name, "alice");
  EXPECT_EQ(SizeWithoutTrailer(sealed), message_.size());
}

TEST_F(MessageSealTest, TheLongestNameAndAnEmptyMessageFit) {
  MessageSeal agent = Make(Role::kAgent, std::string(kMaxCertifiedName, 'x'));
  const Bytes sealed = agent.Seal(kChannel, {});
  EXPECT_EQ(sealed.size(), kMaxTrailerBytes);
  EXPECT_EQ(receiver_.Open(kChannel, sealed).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, RefusesEveryAlteredByte) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes sealed = alice.Seal(kChannel, message_);
  for (size_t i = 0; i < sealed.size(); ++i) {
    Bytes altered = sealed;
    altered[i] ^= 1;
    const OpenedMessage opened = receiver_.Open(kChannel, altered);
    EXPECT_NE(opened.kind, Kind::kSigned) << "byte " << i;
  }
  EXPECT_EQ(receiver_.Open(kChannel, sealed).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, RefusesEveryTruncation) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes sealed = alice.Seal(kChannel, message_);
  for (size_t size = 0; size < sealed.size(); ++size) {
    const Bytes cut(sealed.begin(), sealed.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_NE(receiver_.Open(kChannel, cut).kind, Kind::kSigned) << size;
  }
}

TEST_F(MessageSealTest, AMessageWithoutTrailerIsUnsigned) {
  const OpenedMessage opened = receiver_.Open(kChannel, message_);
  EXPECT_EQ(opened.kind, Kind::kUnsigned);
  EXPECT_EQ(opened.size, message_.size());
  EXPECT_EQ(receiver_.Open(kChannel, {}).kind, Kind::kUnsigned);
}

TEST_F(MessageSealTest, RefusesARepetition) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes sealed = alice.Seal(kChannel, message_);
  EXPECT_EQ(receiver_.Open(kChannel, sealed).kind, Kind::kSigned);
  ExpectRefused(receiver_.Open(kChannel, sealed), "it came before");
}

TEST_F(MessageSealTest, TakesMessagesInAnotherOrder) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes first = alice.Seal(kChannel, message_);
  const Bytes second = alice.Seal(kChannel, message_);
  EXPECT_EQ(receiver_.Open(kChannel, second).kind, Kind::kSigned);
  EXPECT_EQ(receiver_.Open(kChannel, first).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, ChunksThatOvertakeRefuseNoOtherMessage) {
  MessageSeal ingest = Make(Role::kIngest, "ingest");
  const Bytes fact = ingest.Seal("SKEIN_IMAGE", message_);
  for (size_t i = 0; i < 2 * ReplayWindow::kSize; ++i) {
    const Bytes chunk = ingest.Seal("SKEIN_BLOB_CHUNK_X", message_);
    ASSERT_EQ(receiver_.Open("SKEIN_BLOB_CHUNK_X", chunk).kind, Kind::kSigned);
  }
  EXPECT_EQ(receiver_.Open("SKEIN_IMAGE", fact).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, RefusesAnotherChannel) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  ExpectRefused(receiver_.Open("SKEIN_COMMAND", alice.Seal(kChannel, message_)),
                "its signature does not fit");
}

TEST_F(MessageSealTest, RefusesAnExpiredCertificate) {
  MessageSeal alice = Make(Role::kAgent, "alice", now_us_ / 1'000'000 + 10);
  EXPECT_EQ(receiver_.Open(kChannel, alice.Seal(kChannel, message_)).kind, Kind::kSigned);
  now_us_ += 10'000'000;
  ExpectRefused(receiver_.Open(kChannel, alice.Seal(kChannel, message_)),
                "its certificate has expired");
}

TEST_F(MessageSealTest, RefusesARevokedName) {
  std::string revoked;
  receiver_.SetRevoked([&revoked](const std::string& name) { return name == revoked; });
  MessageSeal alice = Make(Role::kAgent, "alice");
  EXPECT_EQ(receiver_.Open(kChannel, alice.Seal(kChannel, message_)).kind, Kind::kSigned);
  revoked = "alice";
  ExpectRefused(receiver_.Open(kChannel, alice.Seal(kChannel, message_)),
                "its invitation was revoked");
}

TEST_F(MessageSealTest, RefusesAForeignRoot) {
  const SigningKey foreign = SigningKey::Generate();
  MessageSeal mallory = MakeWith(IssueCredential(foreign, kSession, Role::kIngest, "ingest", 0));
  ExpectRefused(receiver_.Open(kChannel, mallory.Seal(kChannel, message_)),
                "its certificate is not of this session's root key");
}

TEST_F(MessageSealTest, ACertificateOfAnotherSessionsIdDoesNotHold) {
  MessageSeal alice =
      MakeWith(IssueCredential(root_, "fedcba9876543210", Role::kAgent, "alice", 0));
  EXPECT_EQ(receiver_.Open(kChannel, alice.Seal(kChannel, message_)).kind, Kind::kRefused);
}

TEST_F(MessageSealTest, TellsMessagesOfOtherSessionsApart) {
  const std::string other = "fedcba9876543210";
  MessageSeal alice({other, root_.public_key()},
                    IssueCredential(root_, other, Role::kAgent, "alice", 0), {},
                    [this] { return now_us_; });
  EXPECT_EQ(receiver_.Open(kChannel, alice.Seal(kChannel, message_)).kind, Kind::kOtherSession);
}

// Alice's certificate with a key of one's own.
TEST_F(MessageSealTest, AStolenCertificateIsOfNoUse) {
  const Credential alice = IssueCredential(root_, kSession, Role::kAgent, "alice", 0);
  MessageSeal thief = MakeWith({SigningKey::Generate(), alice.certificate});
  ExpectRefused(receiver_.Open(kChannel, thief.Seal(kChannel, message_)),
                "its signature does not fit");
}

TEST_F(MessageSealTest, ARestartedReceiverRefusesWhatItSawBefore) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  const Bytes before = alice.Seal(kChannel, message_);
  EXPECT_EQ(receiver_.Open(kChannel, before).kind, Kind::kSigned);
  MessageSeal restarted = Make(Role::kIngest, "ingest", 0, receiver_.Counters());
  ExpectRefused(restarted.Open(kChannel, before), "it came before");
  EXPECT_EQ(restarted.Open(kChannel, alice.Seal(kChannel, message_)).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, ARestartedSignerGoesOnThoughItsClockWasSetBack) {
  const Credential credential = IssueCredential(root_, kSession, Role::kWorker, "mapper-1", 0);
  MessageSeal before = MakeWith(credential);
  for (size_t i = 0; i < 2 * ReplayWindow::kSize; ++i) {
    receiver_.Open(kChannel, before.Seal(kChannel, message_));
  }
  now_us_ -= 3'600'000'000;
  MessageSeal after = MakeWith(credential, receiver_.Counters());
  EXPECT_EQ(receiver_.Open(kChannel, after.Seal(kChannel, message_)).kind, Kind::kSigned);
}

TEST_F(MessageSealTest, ProcessesThatShareAKeyAreBothHeard) {
  const Credential credential = IssueCredential(root_, kSession, Role::kViewer, "status", 0);
  MessageSeal one = MakeWith(credential), other = MakeWith(credential);
  for (int i = 0; i < 100; ++i) {
    now_us_ += 50;
    EXPECT_EQ(receiver_.Open(kChannel, one.Seal(kChannel, message_)).kind, Kind::kSigned);
    now_us_ += 50;
    EXPECT_EQ(receiver_.Open(kChannel, other.Seal(kChannel, message_)).kind, Kind::kSigned);
  }
}

// By chance two of them may have one counter: six do less often than once in a million runs.
TEST_F(MessageSealTest, ProcessesThatShareAKeyAreHeardInOneMicrosecond) {
  constexpr int kNum = 20, kMostTwice = 5;
  const Credential credential = IssueCredential(root_, kSession, Role::kWorker, "workers", 0);
  int num_heard = 0;
  for (int i = 0; i < kNum; ++i) {
    const OpenedMessage opened =
        receiver_.Open(kChannel, MakeWith(credential).Seal(kChannel, message_));
    num_heard += opened.kind == Kind::kSigned ? 1 : 0;
  }
  EXPECT_GE(num_heard, kNum - kMostTwice);
}

TEST_F(MessageSealTest, NeedsTheIdOfASession) {
  const Credential credential = IssueCredential(root_, "x", Role::kAgent, "alice", 0);
  EXPECT_THROW(MessageSeal({"x", root_.public_key()}, credential, {}, NowUs),
               std::invalid_argument);
}

// The cost, in the test's output: a heartbeat's size, and a blob chunk's.
TEST_F(MessageSealTest, CostOfSealingAndOpening) {
  MessageSeal alice = Make(Role::kAgent, "alice");
  for (const size_t size : {size_t{200}, size_t{24} << 10}) {
    constexpr int kTimes = 500;
    const Bytes message(size, 7);
    std::vector<Bytes> sealed;
    const double start_s = ThreadCpuS();
    for (int i = 0; i < kTimes; ++i) sealed.push_back(alice.Seal(kChannel, message));
    const double sealed_s = ThreadCpuS();
    for (const Bytes& each : sealed) {
      ASSERT_EQ(receiver_.Open(kChannel, each).kind, Kind::kSigned);
    }
    std::printf("%zu bytes: %.0f us to seal, %.0f us to open\n", size,
                1e6 * (sealed_s - start_s) / kTimes, 1e6 * (ThreadCpuS() - sealed_s) / kTimes);
  }
}

}  // namespace skein::message_seal_test
