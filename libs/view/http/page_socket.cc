#include "http/page_socket.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "core/clock.h"

namespace skein {
namespace {

// A WebSocket's control frame has at most 125 bytes, two of them for the code (RFC 6455, 5.5).
constexpr size_t kMaxReasonBytes = 123;

constexpr size_t kMaxFrameBytes = 1 << 10;    // of a message that a page sends
constexpr int kMaxFramesPerS = 20;            // the same
constexpr size_t kMaxQueueBytes = 256 << 10;  // events that wait; beyond, the page pulls events

// For a page to answer that it was closed.
constexpr double kGoodbyeS = 0.3;

// The kernel's share of what waits for a page.
constexpr int kSendBufferBytes = 256 << 10;

SharedText Text(const nlohmann::json& message) {
  return std::make_shared<const std::string>(message.dump());
}

}  // namespace

PageSocket::PageSocket(ConnectionHost& host, int64_t id, WebStream stream)
    : host_(host),
      id_(id),
      stream_(std::move(stream)),
      stalled_(stream_.get_executor()),
      buffer_(kMaxFrameBytes * 2) {}

void PageSocket::Start(UpgradeRequest request, std::map<std::string, SharedText> latest) {
  request_ = std::move(request);
  topics_ = std::move(latest);
  const WebServerOptions& options = host_.options();
  stream_.next_layer().lowest().expires_never();
  ErrorCode ignored;
  stream_.next_layer().lowest().socket().set_option(
      asio::socket_base::send_buffer_size(kSendBufferBytes), ignored);
  websocket::stream_base::timeout timeout{};
  timeout.handshake_timeout = Milliseconds(options.bounds.stalled_s);
  timeout.idle_timeout = Milliseconds(options.bounds.idle_s);
  timeout.keep_alive_pings = true;
  stream_.set_option(timeout);
  stream_.read_message_max(kMaxFrameBytes);
  stream_.text(true);
  stream_.control_callback(
      [this](websocket::frame_type, boost::beast::string_view) { CountFrame(); });
  stream_.async_accept(request_,
                       [self = shared_from_this()](ErrorCode error) { self->OnAccepted(error); });
}

void PageSocket::OnAccepted(ErrorCode error) {
  if (error || closed_) return Close();
  open_ = true;
  hello_ = Text(
      {{"type", "hello"}, {"session_id", host_.options().session_id}, {"head", host_.sent_seq()}});
  Read();
  Pump();
}

void PageSocket::Read() {
  stream_.async_read(buffer_, [self = shared_from_this()](ErrorCode error, size_t) {
    if (error) return self->Close();
    self->buffer_.clear();
    if (self->CountFrame()) self->Read();
  });
}

bool PageSocket::CountFrame() {
  const auto now = static_cast<int64_t>(MonotonicS());
  if (now != second_) num_frames_ = 0;
  second_ = now;
  if (++num_frames_ <= kMaxFramesPerS) return true;
  Close();
  return false;
}

void PageSocket::SendEvents(const SharedText& text) {
  if (!open_ || closed_ || refused_ || behind_) return;
  if (text == nullptr || queued_bytes_ + text->size() > kMaxQueueBytes) {
    behind_ = true;
  } else {
    queued_bytes_ += text->size();
    events_.push_back(text);
  }
  Pump();
}

void PageSocket::SendLatest(const std::string& topic, const SharedText& text) {
  topics_[topic] = text;
  Pump();
}

// Hello, then topics, as these are few, then events.
SharedText PageSocket::NextMessage() {
  if (hello_ != nullptr) return std::exchange(hello_, nullptr);
  if (!topics_.empty()) {
    const SharedText text = topics_.begin()->second;
    topics_.erase(topics_.begin());
    return text;
  }
  if (!events_.empty()) {
    const SharedText text = events_.front();
    events_.pop_front();
    queued_bytes_ -= text->size();
    return text;
  }
  if (!behind_) return nullptr;
  behind_ = false;
  return Text({{"type", "head"}, {"head", host_.sent_seq()}});
}

void PageSocket::Pump() {
  if (!open_ || closed_ || refused_ || writing_ != nullptr) return;
  writing_ = NextMessage();
  if (writing_ == nullptr) return;
  WatchWrite();
  stream_.async_write(asio::buffer(*writing_),
                      [self = shared_from_this()](ErrorCode error, size_t) {
                        if (!self->refused_) self->stalled_.cancel();
                        self->writing_ = nullptr;
                        error ? self->Close() : self->Pump();
                      });
}

// What is being written ends first, if that takes no longer.
void PageSocket::Refuse(const std::string& reason) {
  if (refused_ || closed_) return;
  refused_ = true;
  if (!open_) return Close();
  stalled_.expires_after(Milliseconds(kGoodbyeS));
  stalled_.async_wait([weak = weak_from_this()](ErrorCode error) {
    const auto self = weak.lock();
    if (!error && self) self->Close();
  });
  const websocket::close_reason said(websocket::close_code::policy_error,
                                     reason.substr(0, kMaxReasonBytes).c_str());
  stream_.async_close(said, [self = shared_from_this()](ErrorCode) { self->Close(); });
}

void PageSocket::WatchWrite() {
  stalled_.expires_after(Milliseconds(host_.options().bounds.stalled_s));
  stalled_.async_wait([weak = weak_from_this()](ErrorCode error) {
    const auto self = weak.lock();
    if (!error && self && self->writing_ != nullptr) self->Close();
  });
}

void PageSocket::Close() {
  if (closed_) return;
  closed_ = true;
  stalled_.cancel();
  stream_.next_layer().lowest().close();
  host_.OnClosed(id_);
}

}  // namespace skein
