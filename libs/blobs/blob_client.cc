#include "blobs/blob_client.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "core/hash.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr int kChunkBytes = 24 << 10;

// In one Ethernet frame with its trailer, where a lost IP fragment would lose a whole chunk.
constexpr int kSmallChunkBytes = 1000;

constexpr int kMaxActivePulls = 4;
constexpr double kTickS = 0.02;

// Bytes that are not the blob's, whoever sent them.
constexpr int kMaxMismatches = 3;

constexpr size_t kMaxWaitingRequests = 64;
constexpr size_t kMaxLoading = 256;  // blobs that are read for others; more are asked for again
constexpr int kMaxChunksPerRequest = 1024;

int ChunkBytes(const LcmUrl& url) {
  return url.leaves_host_by_datagram() ? kSmallChunkBytes : kChunkBytes;
}

// Default socket buffers (208 KiB) lose larger bursts of datagrams.
PullWindow InitialWindow(int chunk_bytes) {
  return chunk_bytes == kChunkBytes ? PullWindow(8, 64) : PullWindow(32, 1024);
}

// A request may name any channel; only a channel for chunks is answered.
bool IsChunkChannel(const std::string& channel) {
  return channel.rfind("SKEIN_BLOB_CHUNK_", 0) == 0 && channel.size() <= 63;
}

}  // namespace

BlobClient::BlobClient(PollLoop& loop, Bus& bus, BlobClientOptions options)
    : loop_(loop),
      bus_(bus),
      options_(std::move(options)),
      chunk_bytes_(ChunkBytes(bus.url())),
      shelf_(options_.cache_bytes, [&loop] { return loop.now_s(); }),
      window_(InitialWindow(chunk_bytes_)),
      worker_(std::make_unique<WorkerThread>(loop)) {
  if (!options_.store_dir.empty()) store_ = std::make_unique<BlobStore>(options_.store_dir);
  request_subscription_ = bus_.Subscribe<blob_request_t>(
      kBlobRequestChannel, [this](const blob_request_t& request) { OnRequest(request); });
  expiry_timer_ = loop_.AddTimer(1.0, [this] { shelf_.DropExpired(); });
}

BlobClient::~BlobClient() {
  bus_.Unsubscribe(request_subscription_);
  bus_.Unsubscribe(chunk_subscription_);
  loop_.CancelTimer(expiry_timer_);
  loop_.CancelTimer(tick_timer_);
}

std::string BlobClient::Offer(Bytes bytes) {
  if (store_) {
    const Result<std::string> id = store_->Put(bytes);
    if (id) return *id;
    LogWarn("a blob stays in memory until ingest has stored it: {}", id.error());
  }
  const std::string id = HashBytes(bytes.data(), bytes.size());
  shelf_.Hold(id, std::make_shared<const Bytes>(std::move(bytes)));
  return id;
}

std::string BlobClient::Serve(Bytes bytes, double ttl_s) {
  const std::string id = HashBytes(bytes.data(), bytes.size());
  shelf_.HoldFor(id, std::make_shared<const Bytes>(std::move(bytes)), ttl_s);
  return id;
}

Result<Bytes> BlobClient::GetLocal(const std::string& blob_id) {
  if (const BlobPtr blob = shelf_.Find(blob_id)) return *blob;
  if (store_) return store_->Get(blob_id);
  return NotFound("blob " + blob_id + " is not here");
}

BlobClient::FetchId BlobClient::Fetch(const std::string& blob_id, const std::string& owner,
                                      OnFetched on_fetched, const FetchOptions& options) {
  const FetchId id = next_fetch_id_++;
  const bool is_new = !fetching_.count(blob_id);
  Fetching& fetching = fetching_[blob_id];
  fetching.waiting[id] = std::move(on_fetched);
  if (is_new) {
    fetching.options = options;
  } else {
    Widen(options, &fetching);
  }
  if (std::find(fetching.owners.begin(), fetching.owners.end(), owner) == fetching.owners.end()) {
    fetching.owners.push_back(owner);
  }
  if (is_new) LookLocally(blob_id);
  return id;
}

void BlobClient::Widen(const FetchOptions& more, Fetching* fetching) const {
  FetchOptions& options = fetching->options;
  options.max_bytes = std::max(options.max_bytes, more.max_bytes);
  options.unknown_patience_s = std::max(options.unknown_patience_s, more.unknown_patience_s);
  options.takes_unsigned &= more.takes_unsigned;
  if (options.size_bytes == more.size_bytes) return;
  const bool was_known = std::exchange(options.size_bytes, kUnknownSize) != kUnknownSize;
  if (was_known && fetching->pull && !fetching->hashing) fetching->pull.emplace(NewPull(options));
}

BlobPull BlobClient::NewPull(const FetchOptions& options) const {
  return BlobPull(chunk_bytes_, options.max_bytes, options.size_bytes);
}

void BlobClient::Cancel(FetchId id) {
  for (auto fetching = fetching_.begin(); fetching != fetching_.end(); ++fetching) {
    if (fetching->second.waiting.erase(id) == 0) continue;
    if (fetching->second.waiting.empty()) fetching_.erase(fetching);
    return WatchBus();
  }
}

const BlobPull* BlobClient::FindPull(FetchId id) const {
  for (const auto& [blob_id, fetching] : fetching_) {
    if (fetching.waiting.count(id) > 0) return fetching.pull ? &*fetching.pull : nullptr;
  }
  return nullptr;
}

int64_t BlobClient::ReceivedBytes(FetchId id) const {
  const BlobPull* pull = FindPull(id);
  return pull == nullptr ? 0 : pull->received_bytes();
}

bool BlobClient::IsLate(FetchId id) const {
  const BlobPull* pull = FindPull(id);
  return pull != nullptr && pull->late();
}

void BlobClient::LookLocally(const std::string& blob_id) {
  if (!IsBlobId(blob_id)) {
    loop_.Post(alive_.Guarded(
        [this, blob_id] { Finish(blob_id, InvalidArgument("not a blob's name: " + blob_id)); }));
    return;
  }
  worker_->Run([this, blob_id] { return GetLocal(blob_id); },
               [this, blob_id](const Result<Bytes>& bytes) {
                 if (bytes) return Finish(blob_id, bytes);
                 StartPull(blob_id);
               });
}

void BlobClient::StartPull(const std::string& blob_id) {
  const auto fetching = fetching_.find(blob_id);
  if (fetching == fetching_.end() || fetching->second.pull) return;
  fetching->second.pull.emplace(NewPull(fetching->second.options));
  WatchBus();
  Pump();
}

void BlobClient::WatchBus() {
  const bool pulls = std::any_of(fetching_.begin(), fetching_.end(),
                                 [](const auto& entry) { return entry.second.pull.has_value(); });
  if (pulls && chunk_subscription_ == 0) {
    chunk_subscription_ = bus_.SubscribeBulk<blob_chunk_t>(
        BlobChunkChannel(options_.instance), [this](const blob_chunk_t& chunk) { OnChunk(chunk); });
    tick_timer_ = loop_.AddTimer(kTickS, [this] { Tick(); });
  }
  if (!pulls && chunk_subscription_ != 0) {
    bus_.Unsubscribe(std::exchange(chunk_subscription_, 0));
    loop_.CancelTimer(tick_timer_);
  }
}

void BlobClient::Tick() {
  const double now_s = loop_.now_s();
  for (auto& [blob_id, fetching] : fetching_) {
    if (!fetching.pull || fetching.hashing) continue;
    if (fetching.pull->CheckTimeout(now_s, round_trip_, &window_) && fetching.pull->stalled()) {
      ++fetching.owner;
    }
  }
  Pump();
}

int BlobClient::NumInFlight() const {
  int count = 0;
  for (const auto& [blob_id, fetching] : fetching_) {
    if (fetching.pull && !fetching.pull->stalled()) count += fetching.pull->num_in_flight();
  }
  return count;
}

// What owners do not answer waits for what they do.
void BlobClient::Pump() {
  int num_active = 0;
  AskMore(/*late=*/false, &num_active);
  AskMore(/*late=*/true, &num_active);
}

void BlobClient::AskMore(bool late, int* num_active) {
  const double now_s = loop_.now_s();
  int free = window_.size() - NumInFlight();
  // Asking in larger pieces costs fewer requests.
  const int min_ask = std::max(1, window_.size() / 4);
  for (auto& [blob_id, fetching] : fetching_) {
    if (!fetching.pull || fetching.hashing || fetching.pull->late() != late) continue;
    if (fetching.pull->stalled()) {  // one chunk, to see whether the owner is back
      if (fetching.pull->num_in_flight() > 0) continue;
      if (const auto ask = fetching.pull->NextAsk(1, now_s, &window_)) Ask(blob_id, fetching, *ask);
      continue;
    }
    if (++*num_active > kMaxActivePulls) continue;
    while (free >= min_ask || (free > 0 && fetching.pull->num_in_flight() == 0)) {
      // An owner that has not answered yet may be away: it takes a part of the window only.
      const int most = fetching.pull->received_bytes() == 0 ? std::min(free, min_ask) : free;
      const auto ask = fetching.pull->NextAsk(most, now_s, &window_);
      if (!ask) break;
      Ask(blob_id, fetching, *ask);
      free = window_.size() - NumInFlight();
    }
  }
}

void BlobClient::Ask(const std::string& blob_id, const Fetching& fetching,
                     const BlobPull::Ask& ask) {
  blob_request_t request{};
  request.session_id = options_.session_id;
  request.owner = fetching.owners[fetching.owner % fetching.owners.size()];
  request.blob_id = blob_id;
  request.offset = ask.offset;
  request.length = ask.length;
  request.max_chunk_bytes = chunk_bytes_;
  request.reply_channel = BlobChunkChannel(options_.instance);
  bus_.Publish(kBlobRequestChannel, request);
}

void BlobClient::OnChunk(const blob_chunk_t& chunk) {
  const auto found = fetching_.find(chunk.blob_id);
  if (found == fetching_.end()) return;
  Fetching& fetching = found->second;
  if (!fetching.pull || fetching.hashing) return;
  if (!bus_.IsFrom(fetching.owners, fetching.options.takes_unsigned)) return;
  if (chunk.status == blob_chunk_t::UNKNOWN) return OnUnknown(chunk.blob_id, &fetching);
  fetching.first_unknown_s = 0;
  const auto outcome =
      fetching.pull->OnChunk(chunk.offset, chunk.total_bytes, chunk.data.data(), chunk.data.size(),
                             loop_.now_s(), &window_, &round_trip_);
  if (outcome == BlobPull::Outcome::kIgnored) return;
  if (outcome == BlobPull::Outcome::kTooLarge) {
    return Finish(chunk.blob_id,
                  ResourceExhausted("blob " + chunk.blob_id + " has " +
                                    std::to_string(chunk.total_bytes) + " bytes, too many"));
  }
  bytes_pulled_ += chunk.size;
  if (outcome == BlobPull::Outcome::kComplete) CheckHash(chunk.blob_id, &fetching);
  Pump();
}

void BlobClient::OnUnknown(const std::string& blob_id, Fetching* fetching) {
  const double now_s = loop_.now_s();
  if (fetching->first_unknown_s == 0) fetching->first_unknown_s = now_s;
  // Until then the pull's timeout asks again, with back-off.
  if (now_s < fetching->first_unknown_s + fetching->options.unknown_patience_s) return;
  const std::string& owner = fetching->owners[fetching->owner % fetching->owners.size()];
  Finish(blob_id, NotFound(owner + " has no blob " + blob_id));
}

void BlobClient::CheckHash(const std::string& blob_id, Fetching* fetching) {
  fetching->hashing = true;
  const auto blob = std::make_shared<const Bytes>(fetching->pull->Take());
  worker_->Run([blob, blob_id] { return HashBytes(blob->data(), blob->size()) == blob_id; },
               [this, blob, blob_id](bool matches) { OnHashed(blob_id, blob, matches); });
}

void BlobClient::OnHashed(const std::string& blob_id, BlobPtr blob, bool matches) {
  const auto found = fetching_.find(blob_id);
  if (matches) shelf_.Cache(blob_id, blob);
  if (found == fetching_.end()) return;
  if (matches) return Finish(blob_id, *blob);
  found->second.hashing = false;
  if (++found->second.num_mismatches < kMaxMismatches) return Pump();  // from the start
  Finish(blob_id, DataLoss("the bytes of blob " + blob_id + " do not match its name"));
}

void BlobClient::Finish(const std::string& blob_id, const Result<Bytes>& result) {
  const auto found = fetching_.find(blob_id);
  if (found == fetching_.end()) return;
  const auto waiting = std::move(found->second.waiting);
  fetching_.erase(found);
  WatchBus();
  for (const auto& [id, on_fetched] : waiting) on_fetched(result);
}

void BlobClient::OnRequest(const blob_request_t& request) {
  if (request.owner != options_.instance || !IsBlobId(request.blob_id)) return;
  if (request.offset < 0 || request.length < 0 || request.max_chunk_bytes <= 0) return;
  if (!IsChunkChannel(request.reply_channel)) return;
  if (const BlobPtr blob = shelf_.Find(request.blob_id)) return Answer(request, *blob);
  if (!store_) return AnswerUnknown(request);
  LoadForRequest(request);
}

void BlobClient::LoadForRequest(const blob_request_t& request) {
  const std::string& blob_id = request.blob_id;
  if (loading_.size() >= kMaxLoading && loading_.count(blob_id) == 0) return;
  std::vector<blob_request_t>& requests = loading_[blob_id];
  if (requests.size() < kMaxWaitingRequests) requests.push_back(request);
  if (requests.size() > 1) return;
  worker_->Run([this, blob_id] { return store_->Get(blob_id); },
               [this, blob_id](Result<Bytes> bytes) {
                 const auto waiting = std::move(loading_[blob_id]);
                 loading_.erase(blob_id);
                 BlobPtr blob;
                 if (bytes) blob = std::make_shared<const Bytes>(*std::move(bytes));
                 if (blob) shelf_.Cache(blob_id, blob);
                 for (const blob_request_t& each : waiting) {
                   blob ? Answer(each, *blob) : AnswerUnknown(each);
                 }
               });
}

void BlobClient::Answer(const blob_request_t& request, const Bytes& blob) {
  blob_chunk_t chunk{};
  chunk.session_id = options_.session_id;
  chunk.blob_id = request.blob_id;
  chunk.status = blob_chunk_t::OK;
  chunk.total_bytes = static_cast<int64_t>(blob.size());
  const int64_t step = std::min(chunk_bytes_, request.max_chunk_bytes);
  const int64_t asked_end =
      std::min(request.offset, kMaxBlobBytes) + std::min(request.length, kMaxBlobBytes);
  const int64_t end = std::min(chunk.total_bytes, asked_end);
  chunk.offset = blob.empty() ? 0 : request.offset;
  int num_sent = 0;
  do {  // an empty blob has one empty chunk
    chunk.size = static_cast<int32_t>(std::clamp<int64_t>(end - chunk.offset, 0, step));
    if (chunk.size == 0 && !blob.empty()) return;
    const auto first = blob.begin() + chunk.offset;
    chunk.data.assign(first, first + chunk.size);
    bus_.PublishBulk(request.reply_channel, chunk);
    chunk.offset += chunk.size;
  } while (chunk.offset < end && ++num_sent < kMaxChunksPerRequest);
}

void BlobClient::AnswerUnknown(const blob_request_t& request) {
  blob_chunk_t chunk{};
  chunk.session_id = options_.session_id;
  chunk.blob_id = request.blob_id;
  chunk.status = blob_chunk_t::UNKNOWN;
  chunk.total_bytes = 0;
  chunk.offset = 0;
  chunk.size = 0;
  bus_.PublishBulk(request.reply_channel, chunk);
}

}  // namespace skein
