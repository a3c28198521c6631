#include "auth/message_seal.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "core/process.h"

namespace skein {
namespace {

constexpr char kMessageDomain[] = "skein-message-1";
constexpr char kIdentifier[4] = {'S', 'K', 'N', '1'};
constexpr size_t kEndBytes = sizeof(uint16_t) + sizeof(kIdentifier);
constexpr char kChunkChannels[] = "SKEIN_BLOB_CHUNK_";
// Whoever has a certificate of the root; 32 KiB each at most.
constexpr size_t kMaxSigners = 4096;

struct Trailer {
  uint64_t session = 0;
  Certificate certificate;
  Bytes certificate_bytes;
  uint64_t counter = 0;
  size_t signed_size = 0;  // bytes of the message and of the trailer before the signature
  Signature signature{};
};

uint64_t SessionNumber(const std::string& session_id) {
  uint64_t number = 0;
  const char* end = session_id.data() + session_id.size();
  const auto read = std::from_chars(session_id.data(), end, number, 16);
  if (session_id.size() != 16 || read.ec != std::errc() || read.ptr != end) {
    throw std::invalid_argument("a session's id has 16 hexadecimal digits, not \"" + session_id +
                                "\"");
  }
  return number;
}

// False if it is no trailer of ours, or a damaged one.
bool ParseTrailer(const Bytes& message, size_t size, Trailer* trailer) {
  ByteReader in(message.data() + size, message.size() - size - kEndBytes);
  const size_t bytes = in.remaining();
  if (!in.Get(&trailer->session)) return false;
  const uint8_t* first = in.data();
  if (!ReadCertificate(&in, &trailer->certificate)) return false;
  trailer->certificate_bytes.assign(first, in.data());
  if (!in.Get(&trailer->counter)) return false;
  trailer->signed_size = size + bytes - in.remaining();
  return in.GetRaw(trailer->signature.data(), trailer->signature.size()) && in.remaining() == 0;
}

Bytes SignedBytes(const std::string& session_id, const std::string& channel, const uint8_t* data,
                  size_t size) {
  ByteWriter out;
  out.PutRaw(kMessageDomain, sizeof(kMessageDomain));
  out.PutRaw(session_id.c_str(), session_id.size() + 1);
  out.PutRaw(channel.c_str(), channel.size() + 1);
  out.PutRaw(data, size);
  return out.Take();
}

OpenedMessage Refused(const char* reason) {
  OpenedMessage opened;
  opened.reason = reason;
  return opened;
}

}  // namespace

size_t SizeWithoutTrailer(const Bytes& message) {
  if (message.size() < kEndBytes) return message.size();
  ByteReader end(message.data() + message.size() - kEndBytes, kEndBytes);
  uint16_t size = 0;
  end.Get(&size);
  const bool is_trailer = std::equal(kIdentifier, kIdentifier + sizeof(kIdentifier), end.data());
  if (!is_trailer || size < kEndBytes || size > kMaxTrailerBytes || size > message.size()) {
    return message.size();
  }
  return message.size() - size;
}

// A counter is the time in nanoseconds, and one more than the last where the clock stood or was set
// back. So several processes may use one key. Those that begin after `used` begin apart. The clock
// tells microseconds: each process has a nanosecond of its own, with a probability of 0.999.
MessageSeal::MessageSeal(SessionTrust trust, Credential credential, SignerCounters used,
                         ClockUs now_us)
    : trust_(std::move(trust)),
      credential_(std::move(credential)),
      used_(std::move(used)),
      now_us_(std::move(now_us)),
      own_ns_(RandomU64() % 1000),
      counter_(0) {
  SessionNumber(trust_.session_id);
  const auto own = used_.find(credential_.certificate.public_key);
  if (own != used_.end()) counter_ = own->second + RandomU64() % 1'000'000;
}

void MessageSeal::SetRevoked(std::function<bool(const std::string& name)> is_revoked) {
  is_revoked_ = std::move(is_revoked);
}

Bytes MessageSeal::Seal(const std::string& channel, const Bytes& message) {
  counter_ = std::max(counter_ + 1, static_cast<uint64_t>(now_us_()) * 1000 + own_ns_);
  ByteWriter out;
  out.PutRaw(message.data(), message.size());
  out.Put(SessionNumber(trust_.session_id));
  AppendCertificate(credential_.certificate, &out);
  out.Put(counter_);
  const Signature signature =
      credential_.key.Sign(SignedBytes(trust_.session_id, channel, out.bytes().data(), out.size()));
  out.PutRaw(signature.data(), signature.size());
  out.Put(static_cast<uint16_t>(out.size() + kEndBytes - message.size()));
  out.PutRaw(kIdentifier, sizeof(kIdentifier));
  return out.Take();
}

OpenedMessage MessageSeal::Open(const std::string& channel, const Bytes& message) {
  OpenedMessage opened;
  opened.size = SizeWithoutTrailer(message);
  opened.kind = OpenedMessage::Kind::kUnsigned;
  if (opened.size == message.size()) return opened;
  Trailer trailer;
  if (!ParseTrailer(message, opened.size, &trailer)) return Refused("its trailer is damaged");
  opened.kind = OpenedMessage::Kind::kOtherSession;
  if (trailer.session != SessionNumber(trust_.session_id)) return opened;
  const char* reason = "";
  Signer* signer = FindSigner(trailer.certificate, trailer.certificate_bytes, &reason);
  if (signer == nullptr) return Refused(reason);
  if (!IsSignedBy(trailer.certificate.public_key,
                  SignedBytes(trust_.session_id, channel, message.data(), trailer.signed_size),
                  trailer.signature)) {
    return Refused("its signature does not fit");
  }
  const bool is_chunk = channel.rfind(kChunkChannels, 0) == 0;
  if (!signer->windows[is_chunk ? 1 : 0].Accept(trailer.counter)) return Refused("it came before");
  opened.kind = OpenedMessage::Kind::kSigned;
  opened.speaker = {trailer.certificate.role, trailer.certificate.name};
  return opened;
}

// Null with the reason if the certificate does not hold.
MessageSeal::Signer* MessageSeal::FindSigner(const Certificate& certificate, const Bytes& bytes,
                                             const char** reason) {
  *reason = "its certificate has expired";
  if (IsExpired(certificate, now_us_() / 1'000'000)) return nullptr;
  *reason = "its invitation was revoked";
  if (is_revoked_ && is_revoked_(certificate.name)) return nullptr;
  const auto known = signers_.find(certificate.public_key);
  if (known != signers_.end() && known->second.certificate_bytes == bytes) return &known->second;
  *reason = "its certificate is not of this session's root key";
  if (!IsGenuine(certificate, trust_)) return nullptr;
  if (known == signers_.end() && signers_.size() >= kMaxSigners) ForgetExpired();
  *reason = "too many signers";
  if (known == signers_.end() && signers_.size() >= kMaxSigners) return nullptr;
  const auto [signer, is_new] = signers_.try_emplace(certificate.public_key);
  const auto used = used_.find(certificate.public_key);
  if (is_new && used != used_.end()) {
    for (ReplayWindow& window : signer->second.windows) window = ReplayWindow(used->second);
  }
  signer->second.certificate_bytes = bytes;
  signer->second.expires_s = certificate.expires_s;
  return &signer->second;
}

void MessageSeal::ForgetExpired() {
  const int64_t now_s = now_us_() / 1'000'000;
  for (auto it = signers_.begin(); it != signers_.end();) {
    const int64_t expires_s = it->second.expires_s;
    it = expires_s != 0 && now_s >= expires_s ? signers_.erase(it) : std::next(it);
  }
}

SignerCounters MessageSeal::Counters() const {
  SignerCounters counters = used_;
  for (const auto& [key, signer] : signers_) {
    uint64_t& highest = counters[key];
    for (const ReplayWindow& window : signer.windows) highest = std::max(highest, window.highest());
  }
  return counters;
}

}  // namespace skein
