#include "auth/relay_certificate.h"

#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/sha.h>
#include <openssl/x509.h>
#include <sys/stat.h>

#include "auth/keys_file.h"
#include "auth/openssl_handles.h"
#include "auth/session_keys.h"
#include "auth/signing_key.h"
#include "core/file.h"

namespace skein {
namespace {

std::string PemPath(const std::string& dir) { return dir + "/relay.pem"; }

// Clients look at its fingerprint alone: it needs no name, and ends with its file.
CertificatePtr MakeCertificate(EVP_PKEY* key) {
  CertificatePtr certificate(::X509_new());
  Need(certificate != nullptr);
  SetSerialNumber(certificate.get());
  Need(::X509_set_version(certificate.get(), 2) == 1);  // v3
  Need(::ASN1_TIME_set_string_X509(::X509_getm_notBefore(certificate.get()), "20200101000000Z") ==
       1);
  Need(::ASN1_TIME_set_string_X509(::X509_getm_notAfter(certificate.get()), "99991231235959Z") ==
       1);
  X509_NAME* name = ::X509_get_subject_name(certificate.get());
  const auto* text = reinterpret_cast<const unsigned char*>("skein-relay");
  Need(::X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_ASC, text, -1, -1, 0) == 1);
  Need(::X509_set_issuer_name(certificate.get(), name) == 1);
  Need(::X509_set_pubkey(certificate.get(), key) == 1);
  Need(::X509_sign(certificate.get(), key, ::EVP_sha256()) > 0);
  return certificate;
}

Result<RelayCertificate> Create(const std::string& dir) {
  const KeyPtr key(::EVP_EC_gen("P-256"));
  Need(key != nullptr);
  const CertificatePtr certificate = MakeCertificate(key.get());
  const BioPtr out(::BIO_new(::BIO_s_mem()));
  Need(out && ::PEM_write_bio_X509(out.get(), certificate.get()) == 1 &&
       ::PEM_write_bio_PrivateKey(out.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) ==
           1);
  RelayCertificate made{TextOf(out.get()), CertificatePin(DerOf(certificate.get()))};
  if (Status status = WriteSecretFile(PemPath(dir), made.pem.data(), made.pem.size()); !status) {
    return status;
  }
  return made;
}

Result<RelayCertificate> Read(const std::string& dir) {
  const Result<Bytes> bytes = ReadSecretFile(PemPath(dir));
  if (!bytes.ok()) return bytes.status();
  const std::string text(bytes->begin(), bytes->end());
  const BioPtr in(::BIO_new_mem_buf(text.c_str(), static_cast<int>(text.size())));
  Need(in != nullptr);
  const CertificatePtr certificate(::PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  const KeyPtr key(certificate ? ::PEM_read_bio_PrivateKey(in.get(), nullptr, nullptr, nullptr)
                               : nullptr);
  if (!key || !IsKeyPair(key.get()) ||
      ::X509_check_private_key(certificate.get(), key.get()) != 1 ||
      ::X509_verify(certificate.get(), key.get()) != 1) {
    return DataLoss(PemPath(dir) +
                    " is damaged; restore it, or delete it for a new one: invitations with the old "
                    "one's fingerprint end then");
  }
  return RelayCertificate{text, CertificatePin(DerOf(certificate.get()))};
}

bool HasCertificate(const std::string& dir) {
  struct stat info {};
  return ::stat(PemPath(dir).c_str(), &info) == 0;
}

}  // namespace

void SetSerialNumber(X509* certificate) {
  uint8_t serial[16];
  Need(::RAND_bytes(serial, sizeof(serial)) == 1);
  serial[0] &= 0x7f;
  BIGNUM* number = ::BN_bin2bn(serial, sizeof(serial), nullptr);
  ::BN_to_ASN1_INTEGER(number, ::X509_get_serialNumber(certificate));
  ::BN_free(number);
}

std::string TextOf(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  return {data, static_cast<size_t>(size)};
}

Bytes DerOf(X509* certificate) {
  const int size = ::i2d_X509(certificate, nullptr);
  Need(size > 0);
  Bytes der(static_cast<size_t>(size));
  uint8_t* at = der.data();
  ::i2d_X509(certificate, &at);
  return der;
}

bool IsKeyPair(EVP_PKEY* key) {
  const std::unique_ptr<EVP_PKEY_CTX, decltype(&::EVP_PKEY_CTX_free)> context(
      ::EVP_PKEY_CTX_new(key, nullptr), &::EVP_PKEY_CTX_free);
  return context && ::EVP_PKEY_pairwise_check(context.get()) == 1;
}

std::string CertificatePin(const Bytes& der) {
  uint8_t hash[SHA256_DIGEST_LENGTH];
  ::SHA256(der.data(), der.size(), hash);
  return ToBase64Url(Bytes(hash, hash + kPinBytes));
}

bool IsCertificatePin(const std::string& text) {
  const auto bytes = FromBase64Url(text);
  return bytes && bytes->size() == kPinBytes;
}

Result<RelayCertificate> OpenRelayCertificate(const std::string& dir) {
  if (Status status = MakeKeysFolder(dir); !status) return status;
  const FolderLock lock(dir);
  return HasCertificate(dir) ? Read(dir) : Create(dir);
}

Result<std::string> ReadRelayPin(const std::string& dir) {
  if (!HasCertificate(dir)) {
    return NotFound(PemPath(dir) +
                    " is missing: the session's relay makes it; start the session with "
                    "`skein launch --lcm-url tcpqs://HOST:7700`");
  }
  const Result<RelayCertificate> certificate = Read(dir);
  if (!certificate.ok()) return certificate.status();
  return certificate->pin;
}

}  // namespace skein
