#include "auth/relay_certificate.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::relay_certificate_test {

class RelayCertificateTest : public testing::Test {
 protected:
  std::string PemPath() const { return dir_ + "/relay.pem"; }
  void Write(const std::string& text) {
    ASSERT_TRUE(WriteFileAtomic(PemPath(), text.data(), text.size()).ok());
  }

  TestFolder folder_;
  const std::string dir_ = (folder_ / "keys").string();
};

TEST_F(RelayCertificateTest, IsMadeOnceAndForItsOwnerAlone) {
  const auto made = OpenRelayCertificate(dir_);
  ASSERT_TRUE(made.ok()) << made.error();
  struct stat info {};
  ASSERT_EQ(::stat(PemPath().c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  const auto again = OpenRelayCertificate(dir_);
  ASSERT_TRUE(again.ok()) << again.error();
  EXPECT_EQ(again->pem, made->pem);
  EXPECT_EQ(again->pin, made->pin);
  EXPECT_TRUE(IsCertificatePin(made->pin));
  EXPECT_EQ(made->pin.size(), 22u);
  EXPECT_EQ(*ReadRelayPin(dir_), made->pin);
}

TEST_F(RelayCertificateTest, IsAnotherInAnotherSession) {
  const TestFolder other;
  EXPECT_NE(OpenRelayCertificate(dir_)->pin, OpenRelayCertificate((other / "keys").string())->pin);
}

TEST_F(RelayCertificateTest, AClientOfTheHostMakesNone) {
  EXPECT_EQ(ReadRelayPin(dir_).code(), StatusCode::kNotFound);
  EXPECT_NE(ReadRelayPin(dir_).error().find("start the session"), std::string::npos);
}

TEST_F(RelayCertificateTest, SaysThatItIsDamaged) {
  const std::string pem = OpenRelayCertificate(dir_)->pem;
  const TestFolder other;
  const std::string others = OpenRelayCertificate((other / "keys").string())->pem;
  const size_t key = pem.find("-----BEGIN PRIVATE KEY");
  ASSERT_NE(key, std::string::npos);
  for (const std::string& text :
       {std::string(), std::string("no PEM"), pem.substr(0, key), pem.substr(0, pem.size() / 2),
        pem.substr(0, key) + others.substr(others.find("-----BEGIN PRIVATE KEY"))}) {
    Write(text);
    EXPECT_EQ(OpenRelayCertificate(dir_).code(), StatusCode::kDataLoss);
    EXPECT_FALSE(ReadRelayPin(dir_).ok());
  }
  EXPECT_NE(OpenRelayCertificate(dir_).error().find("delete it"), std::string::npos);
}

}  // namespace skein::relay_certificate_test
