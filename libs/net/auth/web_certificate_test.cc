#include "auth/web_certificate.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>

#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::web_certificate_test {

constexpr int64_t kNowS = 1'800'000'000;
constexpr int64_t kDayS = 86'400;

class WebCertificateTest : public testing::Test {
 protected:
  WebCertificate Open(const std::vector<std::string>& names, int64_t now_s = kNowS) {
    const auto opened = OpenWebCertificate(dir_, names, now_s);
    EXPECT_TRUE(opened.ok()) << opened.error();
    return opened.ok() ? *opened : WebCertificate();
  }
  // What the openssl command finds in `name` of the folder.
  bool Verifies(const WebCertificate& certificate, const std::string& more) {
    const std::string leaf = (folder_ / "leaf.pem").string(), ca = (folder_ / "ca.der").string();
    EXPECT_TRUE(
        WriteFileAtomic(leaf, certificate.chain_pem.data(), certificate.chain_pem.size()).ok());
    EXPECT_TRUE(WriteFileAtomic(ca, certificate.issuer_der).ok());
    const std::string command = "openssl x509 -inform der -in " + ca + " -out " + ca +
                                ".pem 2>/dev/null && openssl verify -attime " +
                                std::to_string(kNowS) + " -purpose sslserver -CAfile " + ca +
                                ".pem " + more + " " + leaf + " >/dev/null 2>&1";
    return std::system(command.c_str()) == 0;
  }

  TestFolder folder_;
  const std::string dir_ = (folder_ / "keys").string();
};

TEST_F(WebCertificateTest, HoldsForItsNamesUnderItsIssuer) {
  const WebCertificate certificate = Open({"10.77.0.1", "field-laptop.local", "fd00::1"});
  EXPECT_TRUE(Verifies(certificate, "-verify_ip 10.77.0.1"));
  EXPECT_TRUE(Verifies(certificate, "-verify_ip fd00::1"));
  EXPECT_TRUE(Verifies(certificate, "-verify_hostname field-laptop.local"));
  EXPECT_FALSE(Verifies(certificate, "-verify_ip 10.77.0.2"));
  EXPECT_FALSE(Verifies(certificate, "-verify_hostname example.org"));
  EXPECT_EQ(certificate.fingerprint.size(), 32u * 3 - 1);
}

TEST_F(WebCertificateTest, StaysWhileItHolds) {
  const WebCertificate first = Open({"10.77.0.1", "laptop.local"});
  EXPECT_EQ(Open({"10.77.0.1"}).fingerprint, first.fingerprint);
  EXPECT_EQ(*ReadWebFingerprint(dir_), first.fingerprint);
  EXPECT_EQ(Open({"laptop.local"}, kNowS + 300 * kDayS).key_pem, first.key_pem);
  struct stat info {};
  ASSERT_EQ(::stat((dir_ + "/web.pem").c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
}

TEST_F(WebCertificateTest, IsMadeAnewForAnotherNameOrBeforeItEnds) {
  const std::string first = Open({"10.77.0.1"}).fingerprint;
  const std::string second = Open({"10.77.0.9"}).fingerprint;
  EXPECT_NE(second, first);
  EXPECT_NE(Open({"10.77.0.9"}, kNowS + 380 * kDayS).fingerprint, second);
}

TEST_F(WebCertificateTest, RefusesWhatIsNoName) {
  for (const char* name : {"", "a,DNS:example.org", "a:b", "a\nb"}) {
    EXPECT_THROW(static_cast<void>(OpenWebCertificate(dir_, {name}, kNowS)), std::invalid_argument)
        << name;
  }
}

TEST_F(WebCertificateTest, SaysThatItIsDamaged) {
  Open({"10.77.0.1"});
  const std::string path = dir_ + "/web.pem";
  const Bytes whole = *ReadFile(path);
  ASSERT_TRUE(WriteFileAtomic(path, whole.data(), whole.size() / 2).ok());
  const auto opened = OpenWebCertificate(dir_, {"10.77.0.1"}, kNowS);
  EXPECT_EQ(opened.code(), StatusCode::kDataLoss);
  EXPECT_NE(opened.error().find("delete it"), std::string::npos);
}

}  // namespace skein::web_certificate_test
