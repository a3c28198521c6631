// Blobs by name: fetched from wherever they are, offered to whoever asks.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "blobs/blob_pull.h"
#include "blobs/blob_shelf.h"
#include "blobs/blob_store.h"
#include "core/bytes.h"
#include "core/result.h"
#include "event_loop/alive.h"
#include "event_loop/poll_loop.h"
#include "event_loop/worker_thread.h"
#include "transport/bus.h"

namespace skein {

struct BlobClientOptions {
  std::string session_id;
  std::string instance;
  // DIR/blobs of the session folder if this process shares it; "" if it does not.
  std::string store_dir;
  // Memory for blobs fetched over the bus or read for others, bytes.
  size_t cache_bytes = 128 << 20;
};

// Loop's thread only, but for Offer, Release and GetLocal.
class BlobClient {
 public:
  using FetchId = int64_t;
  using OnFetched = std::function<void(Result<Bytes>)>;

  static constexpr int64_t kMaxBlobBytes = int64_t{1} << 30;
  static constexpr int64_t kUnknownSize = BlobPull::kUnknownSize;

  struct FetchOptions {
    int64_t max_bytes = kMaxBlobBytes;  // a larger blob is an error
    int64_t size_bytes = kUnknownSize;  // where it is known; chunks that tell another are ignored
    // Whether the owner may serve it without a signature, as one that offered it so.
    bool takes_unsigned = false;
    // Party for which the pull is made: parties share chunks in flight and places of active pulls
    // equally. "": the owner.
    std::string party = {};
  };

  BlobClient(PollLoop& loop, Bus& bus, BlobClientOptions options);
  ~BlobClient();
  BlobClient(const BlobClient&) = delete;
  BlobClient& operator=(const BlobClient&) = delete;

  // Calls back with the blob's bytes, their hash checked, or an error; never within the call. Looks
  // in memory and in the session folder, then pulls from `owner`. The owner is the instance that
  // offered the blob, or "ingest", which holds every blob of a committed fact. A pull survives
  // restarts of the owner. A pull ends when the owner answers repeatedly that it has no such blob,
  // when bytes came several times that are not the blob's, or at Cancel. Fetches of one blob share
  // a pull where owner, party, size_bytes and takes_unsigned are the same, with the largest limits
  // given. Other fetches have nothing in common: bytes that one owner sends cannot spoil those of
  // another. The first bytes that match the name end all pulls of the blob.
  FetchId Fetch(const std::string& blob_id, const std::string& owner, OnFetched on_fetched) {
    return Fetch(blob_id, owner, std::move(on_fetched), FetchOptions());
  }
  FetchId Fetch(const std::string& blob_id, const std::string& owner, OnFetched on_fetched,
                const FetchOptions& options);
  // The fetch's function is not called any more.
  void Cancel(FetchId id);
  // Bytes of the fetch that came over the bus so far; 0 once it is done.
  int64_t ReceivedBytes(FetchId id) const;
  // Whether the owner left the last request of this fetch unanswered; false while the fetch waits
  // for its turn.
  bool IsLate(FetchId id) const;

  // Offers the blob to others under the returned id. A shared session folder keeps it, durably when
  // this returns; memory keeps it until Release where there is none, or where the disk is full. A
  // Submitter releases a fact's blobs once the fact is committed or refused. Any thread: it hashes
  // and may write a file.
  std::string Offer(Bytes bytes);
  void Release(const std::string& blob_id) { shelf_.Release(blob_id); }
  // Answers for the blob from memory, until nobody asked for it for ttl_s; writes no file. Beyond
  // BlobShelf::kMaxServedBytes the blobs go first that were not asked for for longest.
  std::string Serve(Bytes bytes, double ttl_s = 60);
  // Answers for the blob, whose id is that of its bytes, until as many calls of Release.
  void Keep(const std::string& blob_id, BlobPtr blob) { shelf_.Hold(blob_id, std::move(blob)); }
  // Whether it is served or held still, which counts as a use.
  bool Serves(const std::string& blob_id) { return shelf_.Find(blob_id) != nullptr; }

  // From memory or the session folder. Any thread; may read a file.
  Result<Bytes> GetLocal(const std::string& blob_id);

  // Bulk data that came over the bus since the start.
  int64_t bytes_pulled() const { return bytes_pulled_; }
  // Fetches that wait, e.g. for a heartbeat's backlog.
  int num_fetching() const { return static_cast<int>(fetching_.size()); }

 private:
  struct Party {
    RoundTrip round_trip;
    int num_in_flight = 0;  // chunks, but of stalled pulls
    int num_active = 0;     // pulls
    bool pulls = false;     // one that is not stalled
  };
  // Fetches with one key share a pull. By party first.
  struct PullKey {
    std::string party, blob_id, owner;
    int64_t size_bytes;
    bool takes_unsigned;

    bool operator<(const PullKey& other) const { return Tied() < other.Tied(); }
    auto Tied() const -> std::tuple<const std::string&, const std::string&, const std::string&,
                                    const int64_t&, const bool&> {
      return std::tie(party, blob_id, owner, size_bytes, takes_unsigned);
    }
  };
  // Everyone who waits for one pull.
  struct Fetching {
    std::map<FetchId, OnFetched> waiting;
    Party* party = nullptr;
    int64_t max_bytes = 0;
    std::optional<BlobPull> pull;  // once it is not here
    bool hashing = false;
    double first_unknown_s = 0;  // 0: the owner did not say so
    int num_mismatches = 0;

    bool asks() const { return pull && !hashing; }
  };

  // Receiving.
  Party* PartyNamed(const std::string& name);
  bool HasPulls(const std::string& party) const;
  const BlobPull* FindPull(FetchId id) const;
  void LookLocally(const PullKey& key);
  void StartPull(const PullKey& key);
  std::vector<PullKey> PullsOf(const std::string& blob_id) const;
  void OnChunk(const blob_chunk_t& chunk);
  void TakeChunk(const PullKey& key, const blob_chunk_t& chunk);
  void OnUnknown(const PullKey& key, Fetching* fetching);
  void CheckHash(const PullKey& key, Fetching* fetching);
  void OnHashed(const PullKey& key, BlobPtr blob, bool matches);
  void Finish(const PullKey& key, const Result<Bytes>& result);
  void Tick();
  void Pump();
  void CountParties();
  void AskMore(bool late);
  void AskFor(const PullKey& key, Fetching* fetching);
  void Probe(const PullKey& key, Fetching* fetching);
  void Ask(const PullKey& key, const BlobPull::Ask& ask);
  void WatchBus();

  // Serving.
  void OnRequest(const blob_request_t& request);
  void LoadForRequest(const blob_request_t& request);
  void Answer(const blob_request_t& request, const Bytes& blob);
  void AnswerUnknown(const blob_request_t& request);

  PollLoop& loop_;
  Bus& bus_;
  const BlobClientOptions options_;
  const int chunk_bytes_;
  std::unique_ptr<BlobStore> store_;  // null if the folder is not shared; any thread
  BlobShelf shelf_;

  std::map<std::string, Party> parties_;
  std::map<PullKey, Fetching> fetching_;
  FetchId next_fetch_id_ = 1;
  int share_ = 1;           // of each party, chunks in flight
  int num_places_ = 1;      // the same, active pulls
  int num_in_flight_ = 0;   // chunks, of no party more than its share
  std::string asked_last_;  // party
  PullWindow window_;
  Bus::SubscriptionId chunk_subscription_ = 0;
  PollLoop::TimerId tick_timer_ = 0;
  int64_t bytes_pulled_ = 0;

  Bus::SubscriptionId request_subscription_ = 0;
  PollLoop::TimerId expiry_timer_ = 0;
  std::map<std::string, std::vector<blob_request_t>> loading_;

  Alive alive_;                           // of posted functions
  std::unique_ptr<WorkerThread> worker_;  // reads files and hashes; last member: ends first
};

}  // namespace skein
