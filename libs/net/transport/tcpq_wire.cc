#include "transport/tcpq_wire.h"

namespace skein::tcpq {
namespace {

constexpr size_t kKeptBytes = 128 << 10;  // of a parser that waits for the next frame
constexpr char kOtherProtocol[] = "it speaks another protocol";

void AppendNumber(uint32_t value, Bytes* out) {
  for (int shift = 24; shift >= 0; shift -= 8) out->push_back(static_cast<uint8_t>(value >> shift));
}

void AppendSized(const void* data, size_t size, Bytes* out) {
  AppendNumber(static_cast<uint32_t>(size), out);
  const auto* first = static_cast<const uint8_t*>(data);
  out->insert(out->end(), first, first + size);
}

bool IsKnown(uint32_t type) { return type >= 1 && type <= 3; }

}  // namespace

void AppendGreeting(uint32_t magic, Bytes* out) {
  AppendNumber(magic, out);
  AppendNumber(kVersion, out);
}

void AppendSubscription(FrameType type, const std::string& channel, Bytes* out) {
  AppendNumber(static_cast<uint32_t>(type), out);
  AppendSized(channel.data(), channel.size(), out);
}

void AppendPublish(const std::string& channel, const void* data, size_t size, Bytes* out) {
  out->reserve(out->size() + 12 + channel.size() + size);
  AppendSubscription(FrameType::kPublish, channel, out);
  AppendSized(data, size, out);
}

// What is parsed goes before more comes, and memory beyond the usual with it.
void FrameParser::Feed(const uint8_t* data, size_t size) {
  buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(consumed_));
  consumed_ = 0;
  if (buffer_.empty() && buffer_.capacity() > kKeptBytes) Bytes().swap(buffer_);
  buffer_.insert(buffer_.end(), data, data + size);
}

FrameParser::State FrameParser::Broken(const char* why) {
  why_broken_ = why;
  return State::kBroken;
}

bool FrameParser::Peek(size_t offset, uint32_t* value) const {
  if (available() < offset + 4) return false;
  const uint8_t* byte = buffer_.data() + consumed_ + offset;
  *value = uint32_t{byte[0]} << 24 | uint32_t{byte[1]} << 16 | uint32_t{byte[2]} << 8 | byte[3];
  return true;
}

FrameParser::State FrameParser::ParseGreeting() {
  uint32_t magic = 0, version = 0;
  if (!Peek(0, &magic)) return State::kNeedMore;
  if (magic != expected_magic_) return Broken(kOtherProtocol);
  if (!Peek(4, &version)) return State::kNeedMore;
  consumed_ += 8;
  greeted_ = true;
  return State::kFrame;
}

FrameParser::State FrameParser::Next(Frame* frame) {
  if (!greeted_) {
    const State state = ParseGreeting();
    if (state != State::kFrame) return state;
  }
  uint32_t type = 0, channel_size = 0, message_size = 0;
  if (!Peek(0, &type)) return State::kNeedMore;
  if (!IsKnown(type)) return Broken(kOtherProtocol);
  if (!Peek(4, &channel_size)) return State::kNeedMore;
  if (channel_size > kMaxChannelBytes) return Broken("a channel's name above 1,024 bytes");
  size_t size = 8 + channel_size;
  frame->type = static_cast<FrameType>(type);
  const bool publish = frame->type == FrameType::kPublish;
  if (publish) {
    if (!Peek(size, &message_size)) return State::kNeedMore;
    if (message_size > kMaxMessageBytes) return Broken("a message above 4 MiB");
    size += 4 + message_size;
  }
  if (available() < size) return State::kNeedMore;
  const auto* first = buffer_.data() + consumed_;
  frame->channel.assign(reinterpret_cast<const char*>(first) + 8, channel_size);
  const auto* message = first + size - message_size;
  frame->message.assign(message, message + message_size);
  consumed_ += size;
  if (consumed_ == buffer_.size() && buffer_.capacity() > kKeptBytes) {
    Bytes().swap(buffer_);
    consumed_ = 0;
  }
  return State::kFrame;
}

}  // namespace skein::tcpq
