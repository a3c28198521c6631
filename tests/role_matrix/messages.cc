#include "role_matrix/messages.h"

namespace skein {
namespace {

template <class T>
void SpeakAs([[maybe_unused]] const Name& as, [[maybe_unused]] T* message) {
  if constexpr (decode_internal::HasHeader<T>::value) message->header.author = as.instance;
}
void SpeakAs(const Name& as, image_offer_t* offer) {
  offer->agent = as.name;
  offer->owner = as.instance;
}
void SpeakAs(const Name& as, work_request_t* request) { request->worker = as.instance; }
void SpeakAs(const Name& as, work_failed_t* failed) { failed->worker = as.instance; }
void SpeakAs(const Name& as, demand_t* demand) { demand->author = as.instance; }
void SpeakAs(const Name& as, submap_status_t* status) { status->owner = as.instance; }
void SpeakAs(const Name& as, submap_shape_t* shape) { shape->owner = as.instance; }
void SpeakAs(const Name& as, shape_wanted_t* wanted) { wanted->author = as.instance; }
void SpeakAs(const Name& as, dense_points_t* points) { points->author = as.instance; }
void SpeakAs(const Name& as, guidance_t* guidance) { guidance->author = as.instance; }
void SpeakAs(const Name& as, advice_t* advice) { advice->author = as.instance; }
void SpeakAs(const Name& as, shared_reply_t* reply) { reply->owner = as.instance; }
void SpeakAs(const Name& as, heartbeat_t* heartbeat) { heartbeat->instance = as.instance; }
void SpeakAs(const Name& as, command_t* command) { command->sender = as.instance; }
void SpeakAs(const Name& as, ledger_request_t* request) { request->requester = as.instance; }
void SpeakAs(const Name& as, blob_request_t* request) {
  request->reply_channel = BlobChunkChannel(as.instance);
}

// As docs/security.md names the channel.
std::string LabelOf(const std::string& channel) {
  if (channel == kRequestChannel) return std::string(kBlobRequestPrefix) + "<INSTANCE>";
  if (channel == kChunkChannel) return std::string(kBlobChunkPrefix) + "<INSTANCE>";
  return channel == kOtherChannel ? "other" : channel;
}

template <class T>
Row RowOf(const Channel<T>& channel) {
  return {LabelOf(channel.name), channel.name, false,
          [](const std::string& session_id, const Name& as) {
            T message{};
            SessionOf(message) = session_id;
            SpeakAs(as, &message);
            return Encode(message);
          }};
}

}  // namespace

std::vector<Row> AllRows() {
  std::vector<Row> rows;
  ForEachMainChannel([&](const auto& channel) { rows.push_back(RowOf(channel)); });
  rows.push_back(RowOf(Channel<blob_chunk_t>{kChunkChannel}));
  rows.back().bulk = true;
  return rows;
}

}  // namespace skein
