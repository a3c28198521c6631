#include "transport/invitation.h"

#include <gtest/gtest.h>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::invitation_test {

constexpr char kSession[] = "0123456789abcdef";

Invitation MakeInvitation(const std::string& url) {
  const SigningKey root = SigningKey::Generate();
  return {ParseLcmUrl(url),
          {kSession, root.public_key()},
          IssueCredential(root, kSession, Role::kAgent, "alice", 0)};
}

TEST(Invitation, ComesBackFromItsLink) {
  for (const char* url :
       {"tcpq://10.77.0.1:7700", "tcpqs://10.77.0.1:7700?pin=AAECAwQFBgcICQoLDA0ODw",
        "udpm://239.255.76.67:7667?ttl=3"}) {
    const Invitation made = MakeInvitation(url);
    const Result<Invitation> read = ReadInvitation(ToLink(made));
    ASSERT_TRUE(read.ok()) << read.error();
    EXPECT_EQ(read->url.ToString(),
              url + std::string(made.url.provider == "udpm" ? "&recv_buf_size=4194304" : ""));
    EXPECT_EQ(read->trust.session_id, kSession);
    EXPECT_EQ(read->trust.root, made.trust.root);
    EXPECT_EQ(read->credential.certificate.name, "alice");
    EXPECT_EQ(read->credential.key.public_key(), made.credential.key.public_key());
  }
}

TEST(Invitation, MayStandInAFile) {
  const TestFolder folder;
  const std::string path = (folder / "invitation").string();
  const std::string text = ToLink(MakeInvitation("tcpq://10.77.0.1:7700")) + "\n";
  ASSERT_TRUE(WriteFileAtomic(path, text.data(), text.size()).ok());
  EXPECT_TRUE(ReadInvitation("@" + path).ok());
  EXPECT_FALSE(ReadInvitation("@" + path + "x").ok());
}

TEST(Invitation, SaysThatItIsDamaged) {
  const std::string link = ToLink(MakeInvitation("tcpq://10.77.0.1:7700"));
  EXPECT_FALSE(ReadInvitation("").ok());
  EXPECT_FALSE(ReadInvitation("tcpq://10.77.0.1:7700").ok());
  const std::string encrypted =
      ToLink(MakeInvitation("tcpqs://10.77.0.1:7700?pin=AAECAwQFBgcICQoLDA0ODw"));
  for (const std::string& whole : {link, encrypted}) {
    for (size_t size = 0; size < whole.size(); ++size) {
      EXPECT_FALSE(ReadInvitation(whole.substr(0, size)).ok()) << size;
    }
  }
  EXPECT_FALSE(ReadInvitation("skein://" + std::string(1'000'000, 'a')).ok());
  std::string another = link;
  another.replace(another.find("alice"), 5, "alicf");
  EXPECT_FALSE(ReadInvitation(another).ok());
  another = link;
  another.replace(another.find(kSession), 1, "1");
  EXPECT_FALSE(ReadInvitation(another).ok());
}

TEST(Invitation, RefusesAHostThatIsNone) {
  const std::string link = ToLink(MakeInvitation("tcpq://10.77.0.1"));
  const auto with_host = [&](const std::string& host) {
    return "skein://" + host + link.substr(link.find("/tcpq/"));
  };
  EXPECT_TRUE(ReadInvitation(with_host("10.77.0.1")).ok());
  EXPECT_TRUE(ReadInvitation(with_host(std::string(253, 'a') + ":7700")).ok());
  for (const std::string& host : {std::string(), std::string("a\x1B"), std::string("a\0b", 3),
                                  std::string("a b"), std::string(1600, 'a')}) {
    EXPECT_FALSE(ReadInvitation(with_host(host)).ok());
  }
}

TEST(Invitation, TakesNamesThatMayStandInALink) {
  for (const char* name : {"a", "host-b_2", "123456789012345678901234"}) {
    EXPECT_TRUE(IsInvitedName(name)) << name;
  }
  for (const char* name : {"", "a.b", "a b", "a/b", "\xC3\xA9", "1234567890123456789012345"}) {
    EXPECT_FALSE(IsInvitedName(name)) << name;
  }
}

TEST(LcmUrl, HasAPinWhereItIsEncrypted) {
  const std::string url = "tcpqs://10.77.0.1:7700?pin=AAECAwQFBgcICQoLDA0ODw";
  EXPECT_EQ(ParseLcmUrl(url).ToString(), url);
  EXPECT_EQ(ParseLcmUrl(url).Bulk().ToString(),
            "tcpqs://10.77.0.1:7701?pin=AAECAwQFBgcICQoLDA0ODw");
  EXPECT_EQ(ParseLcmUrl("tcpqs://").ToString(), "tcpqs://127.0.0.1:7700");
  for (const char* wrong :
       {"tcpqs://host?pin=", "tcpqs://host?pin=AAECAwQFBgcICQoLDA0O",
        "tcpqs://host?pin=AAECAwQFBgcICQoLDA0OD+", "tcpq://host?pin=AAECAwQFBgcICQoLDA0ODw"}) {
    EXPECT_THROW(ParseLcmUrl(wrong), std::invalid_argument) << wrong;
  }
}

TEST(LcmUrl, TellsWhetherItLeavesTheHost) {
  for (const char* url :
       {"udpm://239.255.76.67:7667?ttl=0", "tcpq://127.0.0.1:7700", "tcpqs://127.0.0.1:7700",
        "tcpqs://127.1.2.3:7700", "tcpq://localhost:7700", "memq://"}) {
    EXPECT_FALSE(ParseLcmUrl(url).leaves_host()) << url;
  }
  for (const char* url : {"udpm://239.255.76.67:7667?ttl=1", "tcpq://10.77.0.1:7700",
                          "tcpqs://host:7700", "tcpq://host:7700", "tcpq://0.0.0.0:7700",
                          "tcpq://127.0.0.1.example.org:7700", "tcpq://127.example.org:7700"}) {
    EXPECT_TRUE(ParseLcmUrl(url).leaves_host()) << url;
  }
}

}  // namespace skein::invitation_test
