#include "auth/web_certificate.h"

#include <openssl/ec.h>
#include <openssl/pem.h>
#include <openssl/sha.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdio>
#include <stdexcept>

#include "auth/keys_file.h"
#include "auth/openssl_handles.h"
#include "auth/session_keys.h"
#include "core/file.h"

namespace skein {
namespace {

constexpr int64_t kDayS = 86'400;
constexpr int64_t kRenewBeforeS = 30 * kDayS;

std::string WebPemPath(const std::string& dir) { return dir + "/web.pem"; }

struct MadeKeyPair {
  KeyPtr key;
  CertificatePtr certificate;
};

void AddExtension(X509* certificate, int nid, const std::string& value) {
  const ExtensionPtr extension(::X509V3_EXT_conf_nid(nullptr, nullptr, nid, value.c_str()));
  if (!extension) throw std::invalid_argument("no name for a certificate: " + value);
  Need(::X509_add_ext(certificate, extension.get(), -1) == 1);
}

void SetName(X509_NAME* name, const std::string& text) {
  Need(::X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(text.c_str()), -1, -1,
                                    0) == 1);
}

// Not signed yet.
MadeKeyPair BeginCertificate(const std::string& common_name, int64_t now_s) {
  MadeKeyPair made{KeyPtr(::EVP_EC_gen("P-256")), CertificatePtr(::X509_new())};
  Need(made.key && made.certificate);
  X509* certificate = made.certificate.get();
  SetSerialNumber(certificate);
  Need(::X509_set_version(certificate, 2) == 1);  // v3
  Need(::ASN1_TIME_set(::X509_getm_notBefore(certificate), now_s - kDayS) != nullptr);
  Need(::ASN1_TIME_set(::X509_getm_notAfter(certificate),
                       now_s + (kWebCertificateDays - 1) * kDayS) != nullptr);
  SetName(::X509_get_subject_name(certificate), common_name);
  Need(::X509_set_pubkey(certificate, made.key.get()) == 1);
  return made;
}

bool IsAddress(const std::string& name) {
  ASN1_OCTET_STRING* address = ::a2i_IPADDRESS(name.c_str());
  ::ASN1_OCTET_STRING_free(address);
  return address != nullptr;
}

std::string AlternativeNames(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    if (name.empty() || name.find_first_of(",:\n") != std::string::npos) {
      if (!IsAddress(name)) throw std::invalid_argument("no host's name: \"" + name + "\"");
    }
    text += (text.empty() ? "" : ",") + std::string(IsAddress(name) ? "IP:" : "DNS:") + name;
  }
  return text;
}

std::string PemOf(X509* certificate) {
  const BioPtr out(::BIO_new(::BIO_s_mem()));
  Need(out && ::PEM_write_bio_X509(out.get(), certificate) == 1);
  return TextOf(out.get());
}

std::string PemOf(EVP_PKEY* key) {
  const BioPtr out(::BIO_new(::BIO_s_mem()));
  Need(out &&
       ::PEM_write_bio_PrivateKey(out.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1);
  return TextOf(out.get());
}

std::string Fingerprint(const Bytes& der) {
  uint8_t hash[SHA256_DIGEST_LENGTH];
  ::SHA256(der.data(), der.size(), hash);
  std::string text;
  for (const uint8_t byte : hash) {
    char digits[4];
    std::snprintf(digits, sizeof(digits), "%02X", byte);
    text += (text.empty() ? "" : ":") + std::string(digits);
  }
  return text;
}

WebCertificate Assembled(X509* certificate, EVP_PKEY* key, X509* issuer) {
  const Bytes der = DerOf(issuer);
  return {PemOf(certificate) + PemOf(issuer), PemOf(key), der, Fingerprint(der)};
}

Result<WebCertificate> CreateWebCertificate(const std::string& dir,
                                            const std::vector<std::string>& names, int64_t now_s) {
  const std::string alternative_names = AlternativeNames(names);
  const MadeKeyPair issuer = BeginCertificate("Skein session at " + names.front(), now_s);
  X509_NAME* issuer_name = ::X509_get_subject_name(issuer.certificate.get());
  Need(::X509_set_issuer_name(issuer.certificate.get(), issuer_name) == 1);
  AddExtension(issuer.certificate.get(), NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  AddExtension(issuer.certificate.get(), NID_key_usage, "critical,keyCertSign");
  Need(::X509_sign(issuer.certificate.get(), issuer.key.get(), ::EVP_sha256()) > 0);

  const MadeKeyPair made = BeginCertificate(names.front(), now_s);
  X509* certificate = made.certificate.get();
  Need(::X509_set_issuer_name(certificate, issuer_name) == 1);
  AddExtension(certificate, NID_basic_constraints, "critical,CA:FALSE");
  AddExtension(certificate, NID_key_usage, "critical,digitalSignature");
  AddExtension(certificate, NID_ext_key_usage, "serverAuth");
  AddExtension(certificate, NID_subject_alt_name, alternative_names);
  Need(::X509_sign(certificate, issuer.key.get(), ::EVP_sha256()) > 0);

  WebCertificate whole = Assembled(certificate, made.key.get(), issuer.certificate.get());
  const std::string text = PemOf(certificate) + whole.key_pem + PemOf(issuer.certificate.get());
  if (Status status = WriteSecretFile(WebPemPath(dir), text.data(), text.size()); !status) {
    return status;
  }
  return whole;
}

bool HoldsFor(X509* certificate, const std::vector<std::string>& names, int64_t now_s) {
  time_t soon = static_cast<time_t>(now_s + kRenewBeforeS);
  if (::X509_cmp_time(::X509_get0_notAfter(certificate), &soon) <= 0) return false;
  return std::all_of(names.begin(), names.end(), [&](const std::string& name) {
    return IsAddress(name) ? ::X509_check_ip_asc(certificate, name.c_str(), 0) == 1
                           : ::X509_check_host(certificate, name.c_str(), name.size(),
                                               X509_CHECK_FLAG_NEVER_CHECK_SUBJECT, nullptr) == 1;
  });
}

struct StoredWebCertificate {
  CertificatePtr certificate;
  KeyPtr key;
  CertificatePtr issuer;
};

// Each of its parts belongs to the next, so that a changed letter is found.
Result<StoredWebCertificate> ReadWebCertificate(const std::string& dir) {
  struct stat info {};
  if (::stat(WebPemPath(dir).c_str(), &info) != 0) return NotFound(WebPemPath(dir) + " is missing");
  const Result<Bytes> bytes = ReadSecretFile(WebPemPath(dir));
  if (!bytes.ok()) return bytes.status();
  const BioPtr in(::BIO_new_mem_buf(bytes->data(), static_cast<int>(bytes->size())));
  Need(in != nullptr);
  StoredWebCertificate stored;
  stored.certificate.reset(::PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  if (stored.certificate) {
    stored.key.reset(::PEM_read_bio_PrivateKey(in.get(), nullptr, nullptr, nullptr));
  }
  if (stored.key) stored.issuer.reset(::PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  X509* issuer = stored.issuer.get();
  if (issuer == nullptr || !IsKeyPair(stored.key.get()) ||
      ::X509_check_private_key(stored.certificate.get(), stored.key.get()) != 1 ||
      ::X509_verify(stored.certificate.get(), ::X509_get0_pubkey(issuer)) != 1 ||
      ::X509_verify(issuer, ::X509_get0_pubkey(issuer)) != 1) {
    return DataLoss(WebPemPath(dir) +
                    " is damaged; restore it, or delete it for a new one: phones that installed "
                    "the old one install the new one then");
  }
  return stored;
}

}  // namespace

Result<WebCertificate> OpenWebCertificate(const std::string& dir,
                                          const std::vector<std::string>& names, int64_t now_s) {
  if (names.empty()) throw std::invalid_argument("a certificate is for one name or more");
  if (Status status = MakeKeysFolder(dir); !status) return status;
  const FolderLock lock(dir);
  const Result<StoredWebCertificate> stored = ReadWebCertificate(dir);
  if (!stored.ok() && stored.code() != StatusCode::kNotFound) return stored.status();
  if (!stored.ok() || !HoldsFor(stored->certificate.get(), names, now_s)) {
    return CreateWebCertificate(dir, names, now_s);
  }
  return Assembled(stored->certificate.get(), stored->key.get(), stored->issuer.get());
}

Result<std::string> ReadWebFingerprint(const std::string& dir) {
  const Result<StoredWebCertificate> stored = ReadWebCertificate(dir);
  if (!stored.ok()) return stored.status();
  return Fingerprint(DerOf(stored->issuer.get()));
}

Status CheckWebCertificate(const std::string& dir) { return ReadWebCertificate(dir).status(); }

}  // namespace skein
