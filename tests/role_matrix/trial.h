#pragma once

// Says messages, and tells which of them were heard.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "auth/revocations.h"
#include "auth/session_keys.h"
#include "core/clock.h"
#include "role_matrix/messages.h"
#include "transport/bus.h"

namespace skein {

// Who listens: what it has heard since Forget.
class Ear {
 public:
  virtual ~Ear() = default;
  virtual bool HasHeard(const Sent& sent) const = 0;
  virtual void Forget() = 0;
};

// Takes everything, as it came.
class RawEar : public Ear {
 public:
  RawEar(PollLoop& loop, const LcmUrl& url)
      : main_(Listen(loop, url, false)), bulk_(Listen(loop, url.Bulk(), true)) {
    ForEachMainChannel([&](const auto& channel) { main_->Subscribe(channel.name); });
    bulk_->Subscribe(kChunkChannel);
    bulk_->Subscribe(kHeartbeatChannel.name);
  }
  bool HasHeard(const Sent& sent) const override {
    return heard_.count({sent.bulk, sent.channel, sent.bytes}) > 0;
  }
  void Forget() override { heard_.clear(); }

 private:
  std::unique_ptr<Link> Listen(PollLoop& loop, const LcmUrl& url, bool bulk) {
    return MakeLink(url, loop, [this, bulk](const std::string& channel, const Bytes& message) {
      heard_.emplace(bulk, channel, message);
    });
  }

  std::set<std::tuple<bool, std::string, Bytes>> heard_;
  const std::unique_ptr<Link> main_, bulk_;
};

// As every process of the session. It hears messages without their trailers.
class ReceiverEar : public Ear {
 public:
  ReceiverEar(PollLoop& loop, const LcmUrl& url, const SessionAccess& access,
              const std::string& keys_dir, bool takes_unsigned)
      : bus_(url.ToString(), loop) {
    bus_.SetSession(access.trust.session_id);
    MessageSeal seal(access.trust, access.credential, access.used, NowUs);
    seal.SetRevoked(Revocations(keys_dir));
    bus_.SetSeal(std::make_unique<MessageSeal>(std::move(seal)), takes_unsigned);
    ForEachMainChannel([&](const auto& channel) {
      bus_.Subscribe(channel, [this, name = channel.name](const auto& message) {
        heard_.emplace(false, name, Encode(message));
      });
    });
    SubscribeBulk(Channel<blob_chunk_t>{kChunkChannel});
    SubscribeBulk(kHeartbeatChannel);
  }
  bool HasHeard(const Sent& sent) const override {
    return heard_.count({sent.bulk, sent.channel, WithoutTrailer(sent.bytes)}) > 0;
  }
  void Forget() override { heard_.clear(); }
  // What it has not taken.
  int64_t num_refused() const {
    return bus_.counters().num_refused + bus_.counters().num_other_sessions;
  }

 private:
  template <class T>
  void SubscribeBulk(const Channel<T>& channel) {
    bus_.SubscribeBulk<T>(channel.name, [this, name = std::string(channel.name)](const T& message) {
      heard_.emplace(true, name, Encode(message));
    });
  }

  Bus bus_;
  std::set<std::tuple<bool, std::string, Bytes>> heard_;
};

// A connection to each network.
class Mouth {
 public:
  Mouth(PollLoop& loop, const LcmUrl& url)
      : main_(MakeLink(url, loop, Ignore)), bulk_(MakeLink(url.Bulk(), loop, Ignore)) {}
  bool Say(const Sent& message) {
    Link& link = message.bulk ? *bulk_ : *main_;
    return link.Publish(message.channel, message.bytes.data(), message.bytes.size());
  }

 private:
  static void Ignore(const std::string&, const Bytes&) {}

  const std::unique_ptr<Link> main_, bulk_;
};

// Says messages over a connection, and tells which of them were heard. Behind them goes a marker
// that everybody takes: a connection keeps its messages' order, so what was not heard before the
// marker is never heard.
class Trial {
 public:
  Trial(PollLoop& loop, const LcmUrl& url, Ear* ear, const SessionAccess& marker)
      : loop_(loop),
        url_(url),
        ear_(ear),
        session_id_(marker.trust.session_id),
        marker_name_(marker.credential.certificate.name),
        marker_seal_(marker.trust, marker.credential, marker.used, NowUs) {}

  // A connection that is heard.
  std::unique_ptr<Mouth> Connect() {
    auto mouth = std::make_unique<Mouth>(loop_, url_);
    for (const bool bulk : {false, true}) {
      std::vector<Sent> markers;
      const auto timer = loop_.AddTimer(0.05, [&] {
        markers.push_back(MakeMarker(bulk));
        mouth->Say(markers.back());
      });
      Await([&] {
        return std::any_of(markers.begin(), markers.end(),
                           [&](const Sent& marker) { return ear_->HasHeard(marker); });
      });
      loop_.CancelTimer(timer);
    }
    return mouth;
  }

  // Of each message, whether it was heard.
  std::vector<bool> Say(Mouth* mouth, const std::vector<Sent>& messages) {
    std::vector<bool> heard;
    for (auto next = messages.begin(); next != messages.end();) {
      ear_->Forget();
      const auto end = next + std::min<std::ptrdiff_t>(kAtOnce, messages.end() - next);
      std::for_each(next, end, [&](const Sent& message) { Publish(mouth, message); });
      for (const bool bulk : {false, true}) AwaitMarker(mouth, bulk);
      for (; next != end; ++next) heard.push_back(ear_->HasHeard(*next));
    }
    num_sent_ += static_cast<int64_t>(heard.size());
    num_heard_ += std::count(heard.begin(), heard.end(), true);
    return heard;
  }

  PollLoop& loop() { return loop_; }
  const std::string& session_id() const { return session_id_; }
  int64_t num_sent() const { return num_sent_; }
  int64_t num_heard() const { return num_heard_; }

 private:
  static constexpr double kDeadlineS = 60;
  // Messages between two markers: datagrams have no queue.
  static constexpr std::ptrdiff_t kAtOnce = 64;

  Sent MakeMarker(bool bulk) {
    heartbeat_t marker{};
    marker.session_id = session_id_;
    marker.instance = marker_name_;
    marker.state = "marker " + std::to_string(++num_markers_);
    return {bulk, kHeartbeatChannel.name,
            marker_seal_.Seal(kHeartbeatChannel.name, Encode(marker))};
  }
  void AwaitMarker(Mouth* mouth, bool bulk) {
    const Sent marker = MakeMarker(bulk);
    Publish(mouth, marker);
    Await([&] { return ear_->HasHeard(marker); });
  }
  void Await(const std::function<bool()>& done) {
    if (loop_.RunUntil(done, kDeadlineS)) return;
    throw std::runtime_error("a marker that everybody takes was not heard within the deadline");
  }
  static void Publish(Mouth* mouth, const Sent& message) {
    if (!mouth->Say(message)) throw std::runtime_error(message.channel + ": it cannot be sent");
  }

  PollLoop& loop_;
  const LcmUrl url_;
  Ear* const ear_;
  const std::string session_id_;
  const std::string marker_name_;
  MessageSeal marker_seal_;
  int64_t num_markers_ = 0, num_sent_ = 0, num_heard_ = 0;
};

inline MessageSeal SealOf(const SessionAccess& access) {
  return {access.trust, access.credential, access.used, NowUs};
}

}  // namespace skein
