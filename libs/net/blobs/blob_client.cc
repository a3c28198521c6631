#include "blobs/blob_client.h"

#include <algorithm>
#include <utility>

#include "core/attempt.h"
#include "core/hash.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr int kChunkBytes = 24 << 10;

// In one Ethernet frame with its trailer, where a lost IP fragment would lose a whole chunk.
constexpr int kSmallChunkBytes = 1000;

constexpr int kMaxActivePulls = 4;
constexpr double kTickS = 0.02;

// Of parties whose round trip is remembered while they fetch nothing.
constexpr size_t kMaxParties = 64;

// Bytes that are not the blob's.
constexpr int kMaxMismatches = 3;
// The owner may deny a blob for so long: one that was restarted does until it offers it again.
constexpr double kUnknownPatienceS = 3;

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
  return channel.rfind(kBlobChunkPrefix, 0) == 0 && channel.size() <= 63;
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
  request_subscription_ =
      bus_.Subscribe<blob_request_t>(BlobRequestChannel(options_.instance),
                                     [this](const blob_request_t& request) { OnRequest(request); });
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
  const std::string& party = options.party.empty() ? owner : options.party;
  const PullKey key{party, blob_id, owner, options.size_bytes, options.takes_unsigned};
  const auto [found, is_new] = fetching_.try_emplace(key);
  Fetching& fetching = found->second;
  fetching.waiting[id] = std::move(on_fetched);
  fetching.max_bytes = std::max(fetching.max_bytes, options.max_bytes);
  if (!is_new) return id;
  fetching.party = PartyNamed(party);
  LookLocally(key);
  return id;
}

BlobClient::Party* BlobClient::PartyNamed(const std::string& name) {
  for (auto party = parties_.begin(); parties_.size() >= kMaxParties && party != parties_.end();) {
    party = HasPulls(party->first) ? std::next(party) : parties_.erase(party);
  }
  return &parties_[name];
}

bool BlobClient::HasPulls(const std::string& party) const {
  const auto first = fetching_.lower_bound({party, "", "", kUnknownSize, false});
  return first != fetching_.end() && first->first.party == party;
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

void BlobClient::LookLocally(const PullKey& key) {
  if (!IsBlobId(key.blob_id)) {
    loop_.Post(alive_.Guarded(
        [this, key] { Finish(key, InvalidArgument("not a blob's name: " + key.blob_id)); }));
    return;
  }
  worker_->Run([this, blob_id = key.blob_id] { return Attempt([&] { return GetLocal(blob_id); }); },
               [this, key](const Result<Bytes>& bytes) {
                 if (bytes) return Finish(key, bytes);
                 StartPull(key);
               });
}

void BlobClient::StartPull(const PullKey& key) {
  const auto fetching = fetching_.find(key);
  if (fetching == fetching_.end() || fetching->second.pull) return;
  fetching->second.pull.emplace(chunk_bytes_, fetching->second.max_bytes, key.size_bytes);
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
  for (auto& [key, fetching] : fetching_) {
    if (fetching.asks()) fetching.pull->CheckTimeout(now_s, fetching.party->round_trip, &window_);
  }
  Pump();
}

// What owners do not answer waits for what they do.
void BlobClient::Pump() {
  CountParties();
  AskMore(/*late=*/false);
  AskMore(/*late=*/true);
}

// What a party has in flight beyond its share, from when it was alone, takes nothing from others.
void BlobClient::CountParties() {
  for (auto& [name, party] : parties_) party = {party.round_trip, 0, 0, false};
  for (auto& [key, fetching] : fetching_) {
    if (!fetching.asks() || fetching.pull->stalled()) continue;
    fetching.party->pulls = true;
    fetching.party->num_in_flight += fetching.pull->num_in_flight();
  }
  const auto pulls = [](const auto& entry) { return entry.second.pulls; };
  const auto num_parties = static_cast<int>(std::count_if(parties_.begin(), parties_.end(), pulls));
  share_ = std::max(1, window_.size() / std::max(1, num_parties));
  num_places_ = std::max(1, kMaxActivePulls / std::max(1, num_parties));
  num_in_flight_ = 0;
  for (const auto& [name, party] : parties_) {
    num_in_flight_ += std::min(share_, party.num_in_flight);
  }
}

// From the party after the one that was asked last: with more parties than chunks in the window
// each has its turn.
void BlobClient::AskMore(bool late) {
  auto next = fetching_.lower_bound({asked_last_ + '\0', "", "", kUnknownSize, false});
  for (size_t i = 0; i < fetching_.size(); ++i, ++next) {
    if (next == fetching_.end()) next = fetching_.begin();
    auto& [key, fetching] = *next;
    if (!fetching.asks() || fetching.pull->late() != late) continue;
    fetching.pull->stalled() ? Probe(key, &fetching) : AskFor(key, &fetching);
  }
}

// One chunk, to see whether the owner is back.
void BlobClient::Probe(const PullKey& key, Fetching* fetching) {
  if (fetching->pull->num_in_flight() > 0) return;
  if (const auto ask = fetching->pull->NextAsk(1, loop_.now_s(), &window_)) Ask(key, *ask);
}

void BlobClient::AskFor(const PullKey& key, Fetching* fetching) {
  Party& party = *fetching->party;
  BlobPull& pull = *fetching->pull;
  if (++party.num_active > num_places_) return;
  // Asking in larger pieces costs fewer requests.
  const int min_ask = std::max(1, share_ / 4);
  while (true) {
    const int free = std::min(share_ - party.num_in_flight, window_.size() - num_in_flight_);
    if (free < min_ask && (free <= 0 || pull.num_in_flight() > 0)) return;
    // An owner that has not answered yet may be away: it takes a part of the share only.
    const int most = pull.received_bytes() == 0 ? std::min(free, min_ask) : free;
    const int num_before = pull.num_in_flight();
    const auto ask = pull.NextAsk(most, loop_.now_s(), &window_);
    if (!ask) return;
    const int num_asked = pull.num_in_flight() - num_before;
    party.num_in_flight += num_asked;
    num_in_flight_ += num_asked;
    asked_last_ = key.party;
    Ask(key, *ask);
  }
}

void BlobClient::Ask(const PullKey& key, const BlobPull::Ask& ask) {
  blob_request_t request{};
  request.session_id = options_.session_id;
  request.owner = key.owner;
  request.blob_id = key.blob_id;
  request.offset = ask.offset;
  request.length = ask.length;
  request.max_chunk_bytes = chunk_bytes_;
  request.reply_channel = BlobChunkChannel(options_.instance);
  bus_.Publish(BlobRequestChannel(key.owner), request);
}

std::vector<BlobClient::PullKey> BlobClient::PullsOf(const std::string& blob_id) const {
  std::vector<PullKey> keys;
  for (const auto& [party, state] : parties_) {
    auto next = fetching_.lower_bound({party, blob_id, "", kUnknownSize, false});
    for (; next != fetching_.end(); ++next) {
      const PullKey& key = next->first;
      if (key.party != party || key.blob_id != blob_id) break;
      if (next->second.pull) keys.push_back(key);
    }
  }
  return keys;
}

void BlobClient::OnChunk(const blob_chunk_t& chunk) {
  const std::vector<PullKey> keys = PullsOf(chunk.blob_id);
  bool is_from_an_owner = keys.empty();
  for (const PullKey& key : keys) {
    if (!bus_.IsFrom(key.owner, key.takes_unsigned)) continue;
    is_from_an_owner = true;
    TakeChunk(key, chunk);
  }
  if (!is_from_an_owner) bus_.Refuse("blob chunks", "it is not from the blob's owner");
}

void BlobClient::TakeChunk(const PullKey& key, const blob_chunk_t& chunk) {
  const auto found = fetching_.find(key);
  if (found == fetching_.end() || !found->second.asks()) return;
  Fetching& fetching = found->second;
  if (chunk.status == blob_chunk_t::UNKNOWN) return OnUnknown(key, &fetching);
  fetching.first_unknown_s = 0;
  const auto outcome =
      fetching.pull->OnChunk(chunk.offset, chunk.total_bytes, chunk.data.data(), chunk.data.size(),
                             loop_.now_s(), &window_, &fetching.party->round_trip);
  if (outcome == BlobPull::Outcome::kIgnored) return;
  if (outcome == BlobPull::Outcome::kTooLarge) {
    return Finish(key, ResourceExhausted("blob " + chunk.blob_id + " has " +
                                         std::to_string(chunk.total_bytes) + " bytes, too many"));
  }
  bytes_pulled_ += chunk.size;
  if (outcome == BlobPull::Outcome::kComplete) CheckHash(key, &fetching);
  Pump();
}

void BlobClient::OnUnknown(const PullKey& key, Fetching* fetching) {
  const double now_s = loop_.now_s();
  if (fetching->first_unknown_s == 0) fetching->first_unknown_s = now_s;
  // Until then the pull's timeout asks again, with back-off.
  if (now_s < fetching->first_unknown_s + kUnknownPatienceS) return;
  Finish(key, NotFound(key.owner + " has no blob " + key.blob_id));
}

void BlobClient::CheckHash(const PullKey& key, Fetching* fetching) {
  fetching->hashing = true;
  const auto blob = std::make_shared<const Bytes>(fetching->pull->Take());
  worker_->Run(
      [blob, blob_id = key.blob_id] { return HashBytes(blob->data(), blob->size()) == blob_id; },
      [this, blob, key](bool matches) { OnHashed(key, blob, matches); });
}

void BlobClient::OnHashed(const PullKey& key, BlobPtr blob, bool matches) {
  if (matches) {
    shelf_.Cache(key.blob_id, blob);
    Finish(key, *blob);
    for (const PullKey& each : PullsOf(key.blob_id)) Finish(each, *blob);
    return;
  }
  const auto found = fetching_.find(key);
  if (found == fetching_.end()) return;
  found->second.hashing = false;
  if (++found->second.num_mismatches < kMaxMismatches) return Pump();  // from the start
  Finish(key, DataLoss("the bytes of blob " + key.blob_id + " do not match its name"));
}

void BlobClient::Finish(const PullKey& key, const Result<Bytes>& result) {
  const auto found = fetching_.find(key);
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
  worker_->Run([this, blob_id] { return Attempt([&] { return store_->Get(blob_id); }); },
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
