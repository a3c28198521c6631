#include "auth/certificate.h"

#include <gtest/gtest.h>

namespace skein::certificate_test {

constexpr char kSession[] = "0123456789abcdef";

class CertificateTest : public testing::Test {
 protected:
  const SigningKey root_ = SigningKey::Generate();
  const SessionTrust trust_{kSession, root_.public_key()};
  Certificate certificate_ =
      IssueCredential(root_, kSession, Role::kAgent, "alice", 100).certificate;
};

TEST_F(CertificateTest, SurvivesEncoding) {
  ByteWriter out;
  AppendCertificate(certificate_, &out);
  ByteReader in(out.bytes());
  Certificate read;
  ASSERT_TRUE(ReadCertificate(&in, &read));
  EXPECT_EQ(in.remaining(), 0u);
  EXPECT_EQ(read.role, Role::kAgent);
  EXPECT_EQ(read.name, "alice");
  EXPECT_EQ(read.expires_s, 100);
  EXPECT_TRUE(IsGenuine(read, trust_));
}

TEST_F(CertificateTest, IsNotReadWhereItIsCutOrHasNoRole) {
  ByteWriter out;
  AppendCertificate(certificate_, &out);
  for (size_t size = 0; size < out.size(); ++size) {
    ByteReader in(out.bytes().data(), size);
    Certificate read;
    EXPECT_FALSE(ReadCertificate(&in, &read)) << size;
  }
  for (const uint8_t role : {0, 7, 255}) {
    Bytes bytes = out.bytes();
    bytes[0] = role;
    ByteReader in(bytes);
    Certificate read;
    EXPECT_FALSE(ReadCertificate(&in, &read));
  }
}

TEST_F(CertificateTest, HoldsForItsRootSessionAndClaimsAlone) {
  EXPECT_TRUE(IsGenuine(certificate_, trust_));
  EXPECT_FALSE(IsGenuine(certificate_, {"0123456789abcdee", root_.public_key()}));
  EXPECT_FALSE(IsGenuine(certificate_, {kSession, SigningKey::Generate().public_key()}));
  Certificate altered = certificate_;
  altered.role = Role::kOperator;
  EXPECT_FALSE(IsGenuine(altered, trust_));
  altered = certificate_;
  altered.name = "alicf";
  EXPECT_FALSE(IsGenuine(altered, trust_));
  altered = certificate_;
  altered.expires_s = 0;
  EXPECT_FALSE(IsGenuine(altered, trust_));
  altered = certificate_;
  altered.public_key = SigningKey::Generate().public_key();
  EXPECT_FALSE(IsGenuine(altered, trust_));
}

TEST_F(CertificateTest, Expires) {
  EXPECT_FALSE(IsExpired(certificate_, 99));
  EXPECT_TRUE(IsExpired(certificate_, 100));
  certificate_.expires_s = 0;
  EXPECT_FALSE(IsExpired(certificate_, 1'000'000'000));
}

TEST_F(CertificateTest, RefusesNamesThatDoNotFit) {
  for (const std::string& name : {std::string(), std::string(65, 'x')}) {
    EXPECT_THROW(IssueCredential(root_, kSession, Role::kAgent, name, 0), std::invalid_argument);
  }
}

TEST(Role, HasItsName) {
  for (const Role role :
       {Role::kIngest, Role::kWorker, Role::kAgent, Role::kOperator, Role::kViewer}) {
    EXPECT_EQ(RoleFromName(RoleName(role)), role);
  }
  EXPECT_EQ(RoleFromName("root"), std::nullopt);
}

TEST(Base64Url, ComesBackAndRefusesWhatIsNone) {
  for (size_t size = 0; size < 5; ++size) {
    const Bytes bytes(size, 0xfb);
    EXPECT_EQ(FromBase64Url(ToBase64Url(bytes)), bytes);
  }
  for (const char* text : {"a", "+/+/", "ab=", "a b", "\xC3\xA9"}) {
    EXPECT_EQ(FromBase64Url(text), std::nullopt) << text;
  }
}

}  // namespace skein::certificate_test
