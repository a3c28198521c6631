// The protocol of LCM's tcpq:// transport, between a client and the relay. Numbers are uint32, big
// endian. Each side first sends its magic number and the protocol's version. Then come frames:
//
//   publish (both ways): 1, length of the channel's name, name, length of the message, message
//   subscribe, unsubscribe (client to relay): 2 or 3, length of the name, name (a regex; Skein's
//   relay takes names, PREFIX.* and .* alone)
//
// Source: lcm/lcm_tcpq.c and lcm-java/lcm/lcm/TCPService.java of LCM 1.3.1.
#pragma once

#include <cstdint>
#include <string>

#include "core/bytes.h"

namespace skein::tcpq {

inline constexpr uint32_t kServerMagic = 0x287617fa;
inline constexpr uint32_t kClientMagic = 0x287617fb;
inline constexpr uint32_t kVersion = 0x0100;

enum class FrameType : uint32_t { kPublish = 1, kSubscribe = 2, kUnsubscribe = 3 };

// Limits of a frame: the receiver hangs up on a larger one. Skein's messages have up to 32 KiB; an
// uncompressed colour image of 1280 x 960, as other LCM programs send them, has 3.7 MB.
inline constexpr uint32_t kMaxChannelBytes = 1024;
inline constexpr uint32_t kMaxMessageBytes = 4 << 20;

// Over TLS, by which a client shows the relay that it belongs to the session: the connection's
// binding (transport/stream.h), signed. The signature counts on that connection alone, and the
// relay does not forward it.
inline constexpr char kHelloChannel[] = "SKEIN_HELLO";

struct Frame {
  FrameType type = FrameType::kPublish;
  std::string channel;
  Bytes message;  // of kPublish
};

void AppendGreeting(uint32_t magic, Bytes* out);
void AppendSubscription(FrameType type, const std::string& channel, Bytes* out);
void AppendPublish(const std::string& channel, const void* data, size_t size, Bytes* out);

// Splits a stream of bytes, which come in pieces of any size, into frames.
class FrameParser {
 public:
  // expected_magic: the other side's.
  explicit FrameParser(uint32_t expected_magic) : expected_magic_(expected_magic) {}

  void Feed(const uint8_t* data, size_t size);
  enum class State { kFrame, kNeedMore, kBroken };
  // kFrame: one was moved to *frame; call again. kBroken: hang up, why_broken() tells the reason.
  State Next(Frame* frame);

  const char* why_broken() const { return why_broken_; }
  bool greeted() const { return greeted_; }
  // Whether a part of a frame is here. Only after Next has said kNeedMore.
  bool has_part() const { return available() > 0; }
  // Memory that it holds.
  size_t held_bytes() const { return buffer_.capacity(); }

 private:
  bool Peek(size_t offset, uint32_t* value) const;
  State ParseGreeting();
  State Broken(const char* why);
  size_t available() const { return buffer_.size() - consumed_; }

  uint32_t expected_magic_;
  bool greeted_ = false;
  const char* why_broken_ = "";
  Bytes buffer_;
  size_t consumed_ = 0;
};

}  // namespace skein::tcpq
