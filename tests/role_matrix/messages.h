#pragma once

// What is said in the matrix of roles: a message of each channel, in anybody's name.

#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "ledger/facts.h"
#include "transport/bus.h"

namespace skein {

constexpr char kRequestChannel[] = "SKEIN_BLOB_REQUEST_NOBODY";
constexpr char kChunkChannel[] = "SKEIN_BLOB_CHUNK_NOBODY";
constexpr char kOtherChannel[] = "SKEIN_NO_SUCH_CHANNEL";

template <class T>
T Need(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error());
  return *std::move(result);
}

template <class T>
Bytes Encode(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

inline Bytes WithoutTrailer(const Bytes& message) {
  const auto size = static_cast<std::ptrdiff_t>(SizeWithoutTrailer(message));
  return {message.begin(), message.begin() + size};
}

// In whose name a message is.
struct Name {
  std::string name;      // of the agent
  std::string instance;  // of the process
};

template <class Fn>
void ForEachMainChannel(Fn fn) {
  ForEachCommittedChannel(fn);
  ForEachSubmitChannel(fn);
  fn(kSubmitReplyChannel);
  fn(kImageOfferChannel);
  fn(kImageAckChannel);
  fn(kPhotoDiagnosisChannel);
  fn(kLedgerHeadChannel);
  fn(kLedgerRequestChannel);
  fn(kLedgerRangeChannel);
  fn(kWorkRequestChannel);
  fn(kWorkChannel);
  fn(kWorkFailedChannel);
  fn(kDemandChannel);
  fn(kSubmapStatusChannel);
  fn(kSubmapShapeChannel);
  fn(kShapeWantedChannel);
  fn(kDensePointsChannel);
  fn(kGuidanceChannel);
  fn(kAdviceChannel);
  fn(kSharedRequestChannel);
  fn(kSharedReplyChannel);
  fn(kHeartbeatChannel);
  fn(kCommandChannel);
  fn(kCommandReplyChannel);
  fn(Channel<blob_request_t>{kRequestChannel});
  fn(Channel<heartbeat_t>{kOtherChannel});
}

// A channel of the table.
struct Row {
  std::string label;
  std::string channel;
  bool bulk = false;
  std::function<Bytes(const std::string& session_id, const Name& as)> message;
};

std::vector<Row> AllRows();

// A message on its way, with its trailer.
struct Sent {
  bool bulk = false;
  std::string channel;
  Bytes bytes;
};

}  // namespace skein
