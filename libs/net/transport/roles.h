// Permissions: the channels on which each role may publish, and the names in messages that must be
// the signer's. Each receiver holds every message against it (docs/security.md).
#pragma once

#include <optional>
#include <string>

#include "auth/message_seal.h"
#include "transport/channels.h"
#include "transport/decode.h"

namespace skein {

// Signer of a message; nullopt for a message without a signature. Unsigned messages may offer
// photos and read.
using Sender = std::optional<Speaker>;

bool MayPublish(const Sender& sender, const std::string& channel);

// Whether the sender may call itself so. A credential NAME is for the instances NAME and NAME.*; an
// agent's for AgentInstance(NAME) and agent.NAME; an operator's for all of these. Without a
// signature: any name that begins with "agent".
bool MayBe(const Sender& sender, const std::string& instance);

// Whether the channel is for the chunks of an instance that the sender may be.
bool MayReceiveOn(const Sender& sender, const std::string& chunk_channel);

// Whether the sender speaks in its own name. Ingest answers others by their names, and the web
// server offers the photos of the agents that it has let in.
template <class T>
bool SpeaksForItself(const Sender& sender, const T& message) {
  if constexpr (decode_internal::HasHeader<T>::value) return MayBe(sender, message.header.author);
  return true;
}
inline bool SpeaksForItself(const Sender& sender, const image_offer_t& offer) {
  const bool is_own = !sender || sender->name == offer.agent || sender->role == Role::kWeb;
  return is_own && MayBe(sender, offer.owner);
}
inline bool SpeaksForItself(const Sender& sender, const work_request_t& request) {
  return MayBe(sender, request.worker);
}
inline bool SpeaksForItself(const Sender& sender, const work_failed_t& failed) {
  return MayBe(sender, failed.worker);
}
inline bool SpeaksForItself(const Sender& sender, const demand_t& demand) {
  return MayBe(sender, demand.author);
}
inline bool SpeaksForItself(const Sender& sender, const submap_status_t& status) {
  return MayBe(sender, status.owner);
}
inline bool SpeaksForItself(const Sender& sender, const submap_shape_t& shape) {
  return MayBe(sender, shape.owner);
}
inline bool SpeaksForItself(const Sender& sender, const shape_wanted_t& wanted) {
  return MayBe(sender, wanted.author);
}
inline bool SpeaksForItself(const Sender& sender, const dense_points_t& points) {
  return MayBe(sender, points.author);
}
inline bool SpeaksForItself(const Sender& sender, const guidance_t& guidance) {
  return MayBe(sender, guidance.author);
}
inline bool SpeaksForItself(const Sender& sender, const advice_t& advice) {
  return MayBe(sender, advice.author);
}
inline bool SpeaksForItself(const Sender& sender, const shared_reply_t& reply) {
  return MayBe(sender, reply.owner);
}
inline bool SpeaksForItself(const Sender& sender, const heartbeat_t& heartbeat) {
  return MayBe(sender, heartbeat.instance);
}
inline bool SpeaksForItself(const Sender& sender, const command_t& command) {
  return MayBe(sender, command.sender);
}
inline bool SpeaksForItself(const Sender& sender, const ledger_request_t& request) {
  return !sender || MayBe(sender, request.requester);
}
inline bool SpeaksForItself(const Sender& sender, const blob_request_t& request) {
  return !sender || MayReceiveOn(sender, request.reply_channel);
}

// Why the message is refused; null if it is not.
template <class T>
const char* WhyRefused(const Sender& sender, const std::string& channel, const T& message) {
  if (!MayPublish(sender, channel)) return "its role may not say so";
  if (sender && sender->role == Role::kIngest) return nullptr;
  return SpeaksForItself(sender, message) ? nullptr : "it speaks in another's name";
}

}  // namespace skein
