// offer_photo LINK PHOTO: offers one photo to a session, signed, and sends its bytes. It needs what
// a program of one's own has: lcm-gen's types, LCM's library and libsodium.
//
//   g++ -std=c++17 -Ibuild/release/generated/cpp clients/examples/offer_photo.cc -llcm -lsodium
//
// LINK is printed by `skein invite --session DIR --role agent`. Exit codes: 0 the photo is stored
// or was there already, 1 it was refused or an error, 2 bad usage.
#include <sodium.h>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <iterator>
#include <lcm/lcm-cpp.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "skein/blob_chunk_t.hpp"
#include "skein/blob_request_t.hpp"
#include "skein/image_ack_t.hpp"
#include "skein/image_offer_t.hpp"

namespace {

using Bytes = std::vector<uint8_t>;

constexpr size_t kRootBytes = 32, kSeedBytes = 32, kSignatureBytes = 64;
constexpr char kIdentifier[] = "SKN1";
constexpr uint8_t kIngest = 1;  // role

// A number in little endian.
template <class T>
void Append(T number, Bytes* out) {
  for (size_t i = 0; i < sizeof(T); ++i) out->push_back(static_cast<uint8_t>(number >> (8 * i)));
}
void Append(const std::string& text, Bytes* out) {  // with its zero
  out->insert(out->end(), text.c_str(), text.c_str() + text.size() + 1);
}

// skein://HOST:PORT/PROVIDER/SESSION/ROLE/NAME/CODE
struct Invitation {
  explicit Invitation(const std::string& link) {
    std::vector<std::string> parts;
    const std::string scheme = "skein://";
    if (link.compare(0, scheme.size(), scheme) != 0) throw std::runtime_error("no skein:// link");
    for (size_t at = scheme.size(), end = 0; end != std::string::npos; at = end + 1) {
      end = link.find('/', at);
      parts.push_back(link.substr(at, end == std::string::npos ? end : end - at));
    }
    if (parts.size() != 6) throw std::runtime_error("the link is cut");
    if (parts[1] == "tcpqs") {
      throw std::runtime_error("LCM's library has no TLS: join the session with `skein agent`");
    }
    const size_t colon = parts[0].find(':');
    host = parts[0].substr(0, colon);
    port = std::stoi(parts[0].substr(colon + 1));
    provider = parts[1].substr(0, 4);
    if (provider == "udpm") ttl = parts[1].substr(5);
    session = parts[2];
    name = parts[4];
    Decode(parts[5]);
  }

  std::string Url(int port_offset) const {
    const std::string url = provider + "://" + host + ":" + std::to_string(port + port_offset);
    return provider == "udpm" ? url + "?ttl=" + ttl : url;
  }

  std::string host, provider, ttl, session, name;
  int port = 0;
  Bytes root, certificate;
  unsigned char secret[crypto_sign_SECRETKEYBYTES] = {};

 private:
  // Root's public key, seed, certificate.
  void Decode(const std::string& text) {
    Bytes code(text.size());
    size_t size = 0;
    if (sodium_base642bin(code.data(), code.size(), text.c_str(), text.size(), nullptr, &size,
                          nullptr, sodium_base64_VARIANT_URLSAFE_NO_PADDING) != 0 ||
        size < kRootBytes + kSeedBytes) {
      throw std::runtime_error("the link is damaged");
    }
    root.assign(code.begin(), code.begin() + kRootBytes);
    certificate.assign(code.begin() + kRootBytes + kSeedBytes,
                       code.begin() + static_cast<std::ptrdiff_t>(size));
    unsigned char public_key[crypto_sign_PUBLICKEYBYTES];
    crypto_sign_seed_keypair(public_key, secret, code.data() + kRootBytes);
  }
};

// "skein-message-1", session, channel, each with a zero; then the bytes up to the signature.
Bytes SignedBytes(const std::string& session, const std::string& channel, const uint8_t* data,
                  size_t size) {
  Bytes bytes;
  Append(std::string("skein-message-1"), &bytes);
  Append(session, &bytes);
  Append(channel, &bytes);
  bytes.insert(bytes.end(), data, data + size);
  return bytes;
}

class Agent {
 public:
  Agent(const Invitation& invitation, const std::string& path)
      : invitation_(invitation), main_(invitation.Url(0)), bulk_(invitation.Url(1)) {
    if (!main_.good() || !bulk_.good()) throw std::runtime_error("no LCM at " + invitation.Url(0));
    std::ifstream file(path, std::ios::binary);
    photo_.assign(std::istreambuf_iterator<char>(file), {});
    if (photo_.empty()) throw std::runtime_error("cannot read " + path);
    offer_.session_id = invitation.session;
    offer_.agent = invitation.name;
    offer_.name = path.substr(path.rfind('/') + 1);
    offer_.size_bytes = static_cast<int64_t>(photo_.size());
    offer_.blob_id = Sha256(photo_);
    offer_.owner = "agent." + invitation.name;
    offer_.capture_utime_us = 0;
    offer_.focal_px = 0;
    offer_.has_gps = offer_.has_altitude = false;
    offer_.latitude_deg = offer_.longitude_deg = offer_.altitude_m = 0;
    main_.subscribe("SKEIN_IMAGE_ACK", &Agent::OnAck, this);
    main_.subscribe(RequestChannel(offer_.owner), &Agent::OnRequest, this);
  }

  // Repeats the offer until ingest has decided. True if the photo is in the session.
  bool Run() {
    using std::chrono::steady_clock;
    auto due = steady_clock::now();
    while (status_ == skein::image_ack_t::WAIT) {
      if (steady_clock::now() >= due) {
        Publish(&main_, "SKEIN_IMAGE_OFFER", offer_);
        due = steady_clock::now() + std::chrono::milliseconds(500);
      }
      main_.handleTimeout(100);
    }
    return status_ != skein::image_ack_t::REFUSED;
  }

 private:
  static std::string Sha256(const Bytes& bytes) {
    unsigned char hash[crypto_hash_sha256_BYTES];
    char text[2 * sizeof(hash) + 1];
    crypto_hash_sha256(hash, bytes.data(), bytes.size());
    return sodium_bin2hex(text, sizeof(text), hash, sizeof(hash));
  }

  // Requests for an owner's blobs come here (BlobRequestChannel in libs/net/transport/channels.h).
  // A name in an invitation is short enough to be there whole.
  static std::string RequestChannel(std::string owner) {
    for (char& c : owner) c = std::isalnum(c) != 0 ? static_cast<char>(std::toupper(c)) : '_';
    return "SKEIN_BLOB_REQUEST_" + owner;
  }

  // The message, then its trailer (libs/net/auth/message_seal.h).
  template <class T>
  void Publish(lcm::LCM* bus, const std::string& channel, const T& message) {
    Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
    const size_t message_size = bytes.size();
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    Append(std::stoull(invitation_.session, nullptr, 16), &bytes);
    bytes.insert(bytes.end(), invitation_.certificate.begin(), invitation_.certificate.end());
    Append(NextCounter(), &bytes);
    const Bytes to_sign = SignedBytes(invitation_.session, channel, bytes.data(), bytes.size());
    unsigned char signature[kSignatureBytes];
    crypto_sign_detached(signature, nullptr, to_sign.data(), to_sign.size(), invitation_.secret);
    bytes.insert(bytes.end(), signature, signature + sizeof(signature));
    Append(static_cast<uint16_t>(bytes.size() - message_size + 6), &bytes);
    bytes.insert(bytes.end(), kIdentifier, kIdentifier + 4);
    bus->publish(channel, bytes.data(), static_cast<unsigned>(bytes.size()));
  }

  uint64_t NextCounter() {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    counter_ = std::max(counter_ + 1, static_cast<uint64_t>(std::chrono::nanoseconds(now).count()));
    return counter_;
  }

  // Whether the message ends with a trailer of ingest's that the session's root vouches for. A
  // repeated answer does no harm here, so that its counter is not looked at.
  bool IsFromIngest(const std::string& channel, const lcm::ReceiveBuffer* buffer) const {
    const auto* data = static_cast<const uint8_t*>(buffer->data);
    const size_t size = buffer->data_size;
    if (size < 6 || std::memcmp(data + size - 4, kIdentifier, 4) != 0) return false;
    const size_t trailer_size = data[size - 6] | data[size - 5] << 8;
    // Before the name: session, role, size of the name. After it: expiry, key, root's signature,
    // counter, signature, size and identifier.
    constexpr size_t kBefore = 10, kAfter = 8 + 32 + 64 + 8 + 64 + 6;
    if (trailer_size > size || trailer_size < kBefore + kAfter) return false;
    const uint8_t* certificate = data + size - trailer_size + 8;
    const size_t claims_size = 2 + certificate[1] + 8 + 32;
    if (certificate[0] != kIngest || trailer_size != kBefore + certificate[1] + kAfter)
      return false;
    Bytes claims;
    Append(std::string("skein-certificate-1"), &claims);
    Append(invitation_.session, &claims);
    claims.insert(claims.end(), certificate, certificate + claims_size);
    if (crypto_sign_verify_detached(certificate + claims_size, claims.data(), claims.size(),
                                    invitation_.root.data()) != 0) {
      return false;
    }
    const size_t signed_size = size - 6 - kSignatureBytes;
    const Bytes bytes = SignedBytes(invitation_.session, channel, data, signed_size);
    return crypto_sign_verify_detached(data + signed_size, bytes.data(), bytes.size(),
                                       certificate + claims_size - 32) == 0;
  }

  void OnAck(const lcm::ReceiveBuffer* buffer, const std::string& channel,
             const skein::image_ack_t* ack) {
    if (ack->session_id != offer_.session_id || ack->agent != offer_.agent) return;
    if (ack->name != offer_.name || ack->blob_id != offer_.blob_id) return;
    if (!IsFromIngest(channel, buffer)) return;
    status_ = ack->status;
    if (status_ == skein::image_ack_t::WAIT) return;
    std::printf("%s: status %d, photo %ld %s\n", ack->name.c_str(), status_,
                static_cast<long>(ack->image_id), ack->reason.c_str());
  }

  // Ingest's alone: others' requests would have the agent sign whatever they name.
  void OnRequest(const lcm::ReceiveBuffer* buffer, const std::string& channel,
                 const skein::blob_request_t* request) {
    if (!IsFromIngest(channel, buffer)) return;
    if (request->session_id != offer_.session_id || request->owner != offer_.owner) return;
    if (request->blob_id != offer_.blob_id || request->max_chunk_bytes <= 0) return;
    const int64_t step = std::min<int64_t>(request->max_chunk_bytes, 24 << 10);
    const int64_t last = std::min(offer_.size_bytes, request->offset + request->length);
    for (int64_t offset = std::max<int64_t>(0, request->offset); offset < last; offset += step) {
      skein::blob_chunk_t chunk;
      chunk.session_id = offer_.session_id;
      chunk.blob_id = offer_.blob_id;
      chunk.status = skein::blob_chunk_t::OK;
      chunk.total_bytes = offer_.size_bytes;
      chunk.offset = offset;
      chunk.size = static_cast<int32_t>(std::min(step, last - offset));
      chunk.data.assign(photo_.begin() + offset, photo_.begin() + offset + chunk.size);
      Publish(&bulk_, request->reply_channel, chunk);
    }
  }

  const Invitation& invitation_;
  lcm::LCM main_, bulk_;
  Bytes photo_;
  skein::image_offer_t offer_;
  int status_ = skein::image_ack_t::WAIT;
  uint64_t counter_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3 || sodium_init() < 0) {
    std::fprintf(stderr, "usage: offer_photo LINK PHOTO\n");
    return 2;
  }
  try {
    const Invitation invitation(argv[1]);
    return Agent(invitation, argv[2]).Run() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "offer_photo: %s\n", error.what());
    return 1;
  }
}
