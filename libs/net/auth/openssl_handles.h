// Owners of OpenSSL's objects. Private to this library.
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/x509.h>

#include <memory>
#include <new>
#include <string>

#include "core/bytes.h"

namespace skein {

struct FreeOpenSsl {
  void operator()(EVP_PKEY* key) const { ::EVP_PKEY_free(key); }
  void operator()(X509* certificate) const { ::X509_free(certificate); }
  void operator()(X509_EXTENSION* extension) const { ::X509_EXTENSION_free(extension); }
  void operator()(BIO* bio) const { ::BIO_free(bio); }
};
using KeyPtr = std::unique_ptr<EVP_PKEY, FreeOpenSsl>;
using CertificatePtr = std::unique_ptr<X509, FreeOpenSsl>;
using ExtensionPtr = std::unique_ptr<X509_EXTENSION, FreeOpenSsl>;
using BioPtr = std::unique_ptr<BIO, FreeOpenSsl>;

// Throws std::bad_alloc unless `done`: these calls fail only for lack of memory or random numbers.
inline void Need(bool done) {
  if (!done) throw std::bad_alloc();
}

// A random serial number, of 127 bits.
void SetSerialNumber(X509* certificate);

// The private key belongs to the public one beside it.
bool IsKeyPair(EVP_PKEY* key);

// As PEM or DER.
std::string TextOf(BIO* bio);
Bytes DerOf(X509* certificate);

}  // namespace skein
