#include "auth/session_keys.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "auth/keys_file.h"
#include "auth/relay_certificate.h"
#include "auth/revocations.h"
#include "auth/web_certificate.h"
#include "core/file.h"
#include "core/folder.h"
#include "testing/test_folder.h"

namespace skein::session_keys_test {

constexpr char kSession[] = "0123456789abcdef";
constexpr int64_t kNowS = 1'800'000'000;

class SessionKeysTest : public testing::Test {
 protected:
  SessionAccess Open(Role role, const std::string& name) {
    Result<SessionAccess> access = OpenSessionKeys(dir_, kSession, role, name);
    EXPECT_TRUE(access.ok()) << access.error();
    return *std::move(access);
  }
  static int ModeOf(const std::filesystem::path& path) {
    struct stat info {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info.st_mode & 0777;
  }

  TestFolder folder_;
  const std::string dir_ = (folder_ / "keys").string();
};

TEST_F(SessionKeysTest, MakesARootAndACredentialOfIt) {
  const SessionAccess mapper = Open(Role::kWorker, "mapper-1");
  EXPECT_EQ(mapper.trust.session_id, kSession);
  EXPECT_EQ(mapper.credential.certificate.role, Role::kWorker);
  EXPECT_EQ(mapper.credential.certificate.name, "mapper-1");
  EXPECT_TRUE(IsGenuine(mapper.credential.certificate, mapper.trust));
  EXPECT_EQ(Open(Role::kIngest, "ingest").trust.root, mapper.trust.root);
}

TEST_F(SessionKeysTest, AProcessThatComesAgainHasTheSameKey) {
  const PublicKey key = Open(Role::kWorker, "mapper-1").credential.key.public_key();
  EXPECT_EQ(Open(Role::kWorker, "mapper-1").credential.key.public_key(), key);
  EXPECT_NE(Open(Role::kWorker, "mapper-2").credential.key.public_key(), key);
  EXPECT_NE(Open(Role::kAgent, "mapper-1").credential.key.public_key(), key);
}

TEST_F(SessionKeysTest, NobodyElseMayReadThem) {
  Open(Role::kWorker, "mapper-1");
  ASSERT_TRUE(SaveCounters(dir_, {}).ok());
  EXPECT_EQ(ModeOf(dir_), 0700);
  int num_files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dir_)) {
    EXPECT_EQ(ModeOf(entry.path()), 0600) << entry.path();
    ++num_files;
  }
  EXPECT_EQ(num_files, 4);
}

TEST_F(SessionKeysTest, EveryFlippedBitIsFound) {
  const SignerCounters counters = {{Open(Role::kIngest, "ingest").credential.key.public_key(), 7}};
  ASSERT_TRUE(SaveCounters(dir_, counters).ok());
  ASSERT_TRUE(RecordInvitation(dir_, "alice").ok());
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  ASSERT_TRUE(OpenRelayCertificate(dir_).ok());
  const std::string fingerprint = OpenWebCertificate(dir_, {"laptop"}, kNowS)->fingerprint;
  const std::string pin = *ReadRelayPin(dir_);
  ASSERT_TRUE(CheckSessionKeys(dir_, kSession).empty());
  for (const std::filesystem::path& file : FilesUnder(dir_)) {
    const Bytes whole = *ReadFile(file.string());
    for (size_t i = 0; i < whole.size(); ++i) {
      Bytes damaged = whole;
      damaged[i] ^= static_cast<uint8_t>(1 << i % 8);
      ASSERT_TRUE(WriteSecretFile(file.string(), damaged.data(), damaged.size()).ok());
      if (!CheckSessionKeys(dir_, kSession).empty()) continue;
      EXPECT_EQ(file.extension(), ".pem") << file << " at " << i;
      EXPECT_EQ(*ReadRelayPin(dir_), pin) << file << " at " << i;
      EXPECT_EQ(OpenWebCertificate(dir_, {"laptop"}, kNowS)->fingerprint, fingerprint)
          << file << " at " << i;
    }
    ASSERT_TRUE(WriteSecretFile(file.string(), whole.data(), whole.size()).ok());
  }
}

TEST_F(SessionKeysTest, ADamagedRootIsAnErrorThatSaysWhatToDo) {
  Open(Role::kWorker, "mapper-1");
  const Bytes whole = *ReadFile(dir_ + "/root.key");
  for (size_t i = 0; i < whole.size(); ++i) {
    Bytes damaged = whole;
    damaged[i] ^= 1;
    ASSERT_TRUE(WriteFileAtomic(dir_ + "/root.key", damaged).ok());
    const Result<SessionAccess> access = OpenSessionKeys(dir_, kSession, Role::kWorker, "mapper-1");
    ASSERT_FALSE(access.ok()) << "byte " << i;
    EXPECT_NE(access.error().find("delete the folder"), std::string::npos) << access.error();
  }
}

TEST_F(SessionKeysTest, ACredentialThatDoesNotHoldIsMadeAnew) {
  const PublicKey key = Open(Role::kWorker, "mapper-1").credential.key.public_key();
  std::filesystem::remove(dir_ + "/root.key");
  const SessionAccess anew = Open(Role::kWorker, "mapper-1");
  EXPECT_NE(anew.credential.key.public_key(), key);
  EXPECT_TRUE(IsGenuine(anew.credential.certificate, anew.trust));
}

// A folder stands where the file would.
TEST_F(SessionKeysTest, ACredentialThatCannotBeKeptServesAllTheSame) {
  Open(Role::kWorker, "mapper-1");
  for (const auto& entry : std::filesystem::directory_iterator(dir_)) {
    if (entry.path().extension() != ".credential") continue;
    const std::filesystem::path path(entry.path().string());
    std::filesystem::remove(path);
    std::filesystem::create_directories(path / "in the way");
    break;
  }
  const SessionAccess access = Open(Role::kWorker, "mapper-1");
  EXPECT_TRUE(IsGenuine(access.credential.certificate, access.trust));
}

TEST_F(SessionKeysTest, RemembersCounters) {
  const PublicKey key = Open(Role::kWorker, "mapper-1").credential.key.public_key();
  ASSERT_TRUE(SaveCounters(dir_, {{key, 7}}).ok());
  EXPECT_EQ(Open(Role::kIngest, "ingest").used, (SignerCounters{{key, 7}}));
  ASSERT_TRUE(WriteFileAtomic(dir_ + "/counters", "nonsense", 8).ok());
  EXPECT_TRUE(Open(Role::kIngest, "ingest").used.empty());
}

TEST_F(SessionKeysTest, AnInvitationIsOfTheRootAndKeptNowhere) {
  const Result<SessionAccess> alice = IssueInvitation(dir_, kSession, Role::kAgent, "alice", 100);
  ASSERT_TRUE(alice.ok()) << alice.error();
  EXPECT_TRUE(IsGenuine(alice->credential.certificate, Open(Role::kIngest, "ingest").trust));
  EXPECT_EQ(alice->credential.certificate.expires_s, 100);
  EXPECT_NE(Open(Role::kAgent, "alice").credential.key.public_key(),
            alice->credential.key.public_key());
}

TEST_F(SessionKeysTest, ACredentialOfAnotherKeyIsRefused) {
  Credential credential = Open(Role::kWorker, "mapper-1").credential;
  EXPECT_TRUE(DecodeCredential(EncodeCredential(credential)).ok());
  credential.key = SigningKey::Generate();
  EXPECT_FALSE(DecodeCredential(EncodeCredential(credential)).ok());
  EXPECT_FALSE(DecodeCredential({}).ok());
}

}  // namespace skein::session_keys_test
