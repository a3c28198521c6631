#include "auth/revocations.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <utility>
#include <vector>

#include "auth/session_keys.h"
#include "auth/web_pass.h"
#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::revocations_test {

constexpr char kSession[] = "0123456789abcdef";

class RevocationsTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(OpenSessionKeys(dir_, kSession, Role::kWorker, "mapper-1").ok());
  }
  Status Invite(const std::string& name) {
    return IssueInvitation(dir_, kSession, Role::kAgent, name, 0).status();
  }
  void Damage(const std::string& file) {
    Bytes bytes = *ReadFile(dir_ + "/" + file);
    bytes[bytes.size() / 2] ^= 1;
    ASSERT_TRUE(WriteFileAtomic(dir_ + "/" + file, bytes).ok());
  }

  TestFolder folder_;
  const std::string dir_ = (folder_ / "keys").string();
};

TEST_F(RevocationsTest, ARevokedNameStaysRevoked) {
  EXPECT_TRUE(ReadRevokedNames(dir_)->empty());
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  ASSERT_TRUE(RevokeName(dir_, "bob").ok());
  EXPECT_EQ(*ReadRevokedNames(dir_), (RevokedNames{"alice", "bob"}));
  EXPECT_TRUE(Invite("carol").ok());
  EXPECT_NE(Invite("alice").error().find("was revoked"), std::string::npos);
}

TEST_F(RevocationsTest, OfThisHostsProcessesNoneCanBeRevoked) {
  EXPECT_NE(RevokeName(dir_, "mapper-1").error().find("process of this host"), std::string::npos);
}

// Else two keys would have one name, and the invited one could not be revoked.
TEST_F(RevocationsTest, NobodyIsInvitedByTheNameOfAProcessOfThisHost) {
  EXPECT_NE(Invite("mapper-1").error().find("process of this host"), std::string::npos);
  EXPECT_NE(IssueWebPass(dir_, kSession, {Role::kViewer, "mapper-1", 0})
                .status()
                .error()
                .find("process of this host"),
            std::string::npos);
  EXPECT_EQ(ReadInvitedNames(dir_)->count("mapper-1"), 0u);
}

TEST_F(RevocationsTest, WhoWasInvitedCanBeRevokedAlsoWhereAProcessTookTheName) {
  ASSERT_TRUE(Invite("alice").ok());
  ASSERT_TRUE(OpenSessionKeys(dir_, kSession, Role::kAgent, "alice").ok());
  EXPECT_TRUE(RevokeName(dir_, "alice").ok());
  EXPECT_EQ(ReadRevokedNames(dir_)->count("alice"), 1u);
}

TEST_F(RevocationsTest, RecordsWhoWasInvited) {
  EXPECT_TRUE(ReadInvitedNames(dir_)->empty());
  ASSERT_TRUE(Invite("alice").ok());
  ASSERT_TRUE(IssueWebPass(dir_, kSession, {Role::kViewer, "bob", 0}).ok());
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  EXPECT_EQ(*ReadInvitedNames(dir_), (InvitedNames{"alice", "bob"}));
}

TEST_F(RevocationsTest, ADamagedRecordOfTheInvitedKeepsNobodyFromBeingInvitedOrRevoked) {
  ASSERT_TRUE(Invite("alice").ok());
  Damage("invited");
  EXPECT_FALSE(ReadInvitedNames(dir_).ok());
  EXPECT_TRUE(RevokeName(dir_, "alice").ok());
  EXPECT_TRUE(Invite("bob").ok());
  EXPECT_EQ(*ReadInvitedNames(dir_), InvitedNames{"bob"});
}

TEST_F(RevocationsTest, ARunningProcessHearsOfThemWithinASecond) {
  double now_s = 100;
  Revocations revocations(dir_, [&now_s] { return now_s; });
  EXPECT_FALSE(revocations("alice"));
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  now_s += 1;
  EXPECT_TRUE(revocations("alice"));
  EXPECT_FALSE(revocations("bob"));
}

// A pipe that nobody writes to stands for a disk that does not answer.
TEST_F(RevocationsTest, ADiskThatHangsHoldsUpNobodyWhoAsks) {
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  std::vector<std::function<void()>> jobs;  // that the disk holds up
  WatchedRevocations revocations(
      dir_, [&jobs](std::function<void()> job) { jobs.push_back(std::move(job)); });
  EXPECT_TRUE(revocations("alice"));
  std::filesystem::remove(dir_ + "/revoked");
  ASSERT_EQ(mkfifo((dir_ + "/revoked").c_str(), 0600), 0);
  revocations.Look();
  revocations.Look();
  ASSERT_EQ(jobs.size(), 1u) << "one look at a time";
  EXPECT_TRUE(revocations("alice")) << "what was known stays";
  EXPECT_FALSE(revocations("bob"));
  jobs.back()();
  EXPECT_TRUE(revocations("alice")) << "a FIFO is no list";
  std::filesystem::remove(dir_ + "/revoked");
  ASSERT_TRUE(RevokeName(dir_, "bob").ok());
  revocations.Look();
  ASSERT_EQ(jobs.size(), 2u) << "it is looked at again";
  jobs.back()();
  EXPECT_TRUE(revocations("bob"));
}

TEST_F(RevocationsTest, WhoIsWatchedIsKnownAfterTheNextLook) {
  WatchedRevocations revocations(dir_, [](const std::function<void()>& job) { job(); });
  const WatchedRevocations copy = revocations;
  EXPECT_FALSE(copy("alice"));
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  revocations.Look();
  EXPECT_TRUE(copy("alice"));
  EXPECT_FALSE(copy("bob"));
}

TEST_F(RevocationsTest, ADamagedListRevokesNobodyLessAndInvitesNobody) {
  ASSERT_TRUE(RevokeName(dir_, "alice").ok());
  double now_s = 100;
  Revocations revocations(dir_, [&now_s] { return now_s; });
  ASSERT_TRUE(revocations("alice"));
  Damage("revoked");
  now_s += 1;
  EXPECT_TRUE(revocations("alice"));
  EXPECT_NE(Invite("carol").error().find("damaged"), std::string::npos);
  EXPECT_FALSE(OpenSessionKeys(dir_, kSession, Role::kWorker, "mapper-1").ok());
  EXPECT_FALSE(RevokeName(dir_, "bob").ok());
}

}  // namespace skein::revocations_test
