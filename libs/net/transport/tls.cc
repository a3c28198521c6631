#include "transport/tls.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <new>
#include <stdexcept>
#include <utility>

namespace skein {
namespace {

constexpr char kNoTls[] =
    "it does not speak TLS 1.3; a relay of a tcpqs:// URL and its clients do, those of tcpq:// do "
    "not";

// "tls-exporter" of RFC 9266.
constexpr char kBindingLabel[] = "EXPORTER-Channel-Binding";
constexpr size_t kBindingBytes = 32;

class TlsStream : public Stream {
 public:
  TlsStream(int fd, SSL_CTX* context, std::string pin)
      : Stream(fd), ssl_(::SSL_new(context)), pin_(std::move(pin)) {
    if (!ssl_ || ::SSL_set_fd(ssl_.get(), fd) != 1) throw std::bad_alloc();
    SSL_set_app_data(ssl_.get(), this);
    if (pin_.empty()) {
      ::SSL_set_accept_state(ssl_.get());
    } else {
      ::SSL_set_connect_state(ssl_.get());
    }
  }

  Moved Receive(uint8_t* buffer, size_t size) override {
    ::ERR_clear_error();
    size_t got = 0;
    const int done = ::SSL_read_ex(ssl_.get(), buffer, size, &got);
    return Outcome(done, got, &receiving_waits_for_room_);
  }

  Moved Send(const uint8_t* data, size_t size) override {
    ::ERR_clear_error();
    size_t sent = 0;
    const int done = ::SSL_write_ex(ssl_.get(), data, size, &sent);
    return Outcome(done, sent, &sending_waits_for_room_);
  }

  bool WaitsForRoom(bool has_output) const override {
    return receiving_waits_for_room_ || (has_output && sending_waits_for_room_);
  }

  std::optional<Bytes> Binding() const override {
    if (!::SSL_is_init_finished(ssl_.get())) return std::nullopt;
    Bytes binding(kBindingBytes);
    if (::SSL_export_keying_material(ssl_.get(), binding.data(), binding.size(), kBindingLabel,
                                     sizeof(kBindingLabel) - 1, nullptr, 0, 0) != 1) {
      return std::nullopt;
    }
    return binding;
  }

  // OpenSSL's callback in place of its own verification.
  static int VerifyPin(X509_STORE_CTX* store, void*) {
    const void* ssl = ::X509_STORE_CTX_get_ex_data(store, ::SSL_get_ex_data_X509_STORE_CTX_idx());
    auto* self = static_cast<TlsStream*>(SSL_get_app_data(static_cast<const SSL*>(ssl)));
    return self->HasPin(::X509_STORE_CTX_get0_cert(store)) ? 1 : 0;
  }

 private:
  struct Free {
    void operator()(SSL* ssl) const { ::SSL_free(ssl); }
  };

  bool HasPin(X509* certificate) {
    uint8_t* der = nullptr;
    const int size = certificate == nullptr ? -1 : ::i2d_X509(certificate, &der);
    if (size < 0) return false;
    const std::string shown = CertificatePin(Bytes(der, der + size));
    ::OPENSSL_free(der);
    if (shown == pin_) return true;
    refused_pin_ = shown;
    return false;
  }

  Moved Outcome(int done, size_t bytes, bool* waits_for_room) {
    const int saved_errno = errno;
    *waits_for_room = false;
    if (done == 1) return {bytes, false};
    switch (::SSL_get_error(ssl_.get(), done)) {
      case SSL_ERROR_WANT_READ:
        return {};
      case SSL_ERROR_WANT_WRITE:
        *waits_for_room = true;
        return {};
      case SSL_ERROR_ZERO_RETURN:
        return Over("it hung up");
      case SSL_ERROR_SYSCALL:
        return Over(saved_errno != 0 ? std::strerror(saved_errno) : "it hung up");
      default:
        return Over(Failure(), true);
    }
  }

  std::string Failure() const {
    if (!refused_pin_.empty()) {
      return "its certificate has the fingerprint " + refused_pin_ + ", not " + pin_ +
             ": it is another session's relay, or someone stands between; ask for a new invitation";
    }
    const unsigned long code = ::ERR_peek_error();
    const int reason = ERR_GET_REASON(code);
    if (reason == SSL_R_WRONG_VERSION_NUMBER || reason == SSL_R_HTTP_REQUEST ||
        reason == SSL_R_UNSUPPORTED_PROTOCOL) {
      return kNoTls;
    }
    const char* text = ::ERR_reason_error_string(code);
    return std::string("TLS: ") + (text != nullptr ? text : "unknown failure");
  }

  const std::unique_ptr<SSL, Free> ssl_;
  const std::string pin_;
  std::string refused_pin_;
  bool receiving_waits_for_room_ = false;
  bool sending_waits_for_room_ = false;
};

std::shared_ptr<SSL_CTX> MakeContext(const SSL_METHOD* method) {
  std::signal(SIGPIPE, SIG_IGN);  // OpenSSL writes without MSG_NOSIGNAL
  std::shared_ptr<SSL_CTX> context(::SSL_CTX_new(method), ::SSL_CTX_free);
  if (!context || SSL_CTX_set_min_proto_version(context.get(), TLS1_3_VERSION) != 1) {
    throw std::bad_alloc();
  }
  SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE |
                                      SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                      SSL_MODE_RELEASE_BUFFERS);
  // Frames have lengths: an end in mid-message is noticed without TLS.
  ::SSL_CTX_set_options(context.get(), SSL_OP_IGNORE_UNEXPECTED_EOF | SSL_OP_NO_TICKET);
  SSL_CTX_set_session_cache_mode(context.get(), SSL_SESS_CACHE_OFF);
  ::SSL_CTX_set_num_tickets(context.get(), 0);
  return context;
}

struct FreePem {
  void operator()(BIO* bio) const { ::BIO_free(bio); }
  void operator()(X509* certificate) const { ::X509_free(certificate); }
  void operator()(EVP_PKEY* key) const { ::EVP_PKEY_free(key); }
};

bool UseCertificate(SSL_CTX* context, const std::string& pem) {
  const std::unique_ptr<BIO, FreePem> in(
      ::BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())));
  if (!in) return false;
  const std::unique_ptr<X509, FreePem> certificate(
      ::PEM_read_bio_X509(in.get(), nullptr, nullptr, nullptr));
  const std::unique_ptr<EVP_PKEY, FreePem> key(
      ::PEM_read_bio_PrivateKey(in.get(), nullptr, nullptr, nullptr));
  return certificate && key && ::SSL_CTX_use_certificate(context, certificate.get()) == 1 &&
         ::SSL_CTX_use_PrivateKey(context, key.get()) == 1;
}

}  // namespace

TlsContext::TlsContext(std::shared_ptr<ssl_ctx_st> context, std::string pin)
    : context_(std::move(context)), pin_(std::move(pin)) {}

TlsContext TlsContext::ForRelay(const RelayCertificate& certificate) {
  auto context = MakeContext(::TLS_server_method());
  if (!UseCertificate(context.get(), certificate.pem)) {
    throw std::invalid_argument("the relay's certificate is of no use to TLS");
  }
  return {std::move(context), ""};
}

TlsContext TlsContext::ForClient(std::string pin) {
  if (!IsCertificatePin(pin)) {
    throw std::invalid_argument("\"" + pin + "\" is no fingerprint of a relay's certificate");
  }
  auto context = MakeContext(::TLS_client_method());
  ::SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  ::SSL_CTX_set_cert_verify_callback(context.get(), TlsStream::VerifyPin, nullptr);
  return {std::move(context), std::move(pin)};
}

std::unique_ptr<Stream> TlsContext::Wrap(int fd) const {
  return std::make_unique<TlsStream>(fd, context_.get(), pin_);
}

}  // namespace skein
