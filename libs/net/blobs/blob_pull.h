// Pull of one blob: which chunk to ask for next, which is lost, when the blob is whole. No
// messages, no clock, no I/O.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "core/bytes.h"

namespace skein {

// How many chunks may be in flight to this process, over all its pulls: receive buffers overflow
// first. Doubles every round trip until the first loss, then grows by one a round trip. A loss
// halves it, at most once a round trip (RFC 5681).
class PullWindow {
 public:
  PullWindow(int initial_chunks, int max_chunks);

  int size() const { return static_cast<int>(size_); }
  // Number of the next chunk asked for: chunks with lower tickets were asked for earlier.
  int64_t NextTicket() { return ++last_ticket_; }
  void OnArrival();
  // The chunk of that ticket is lost.
  void OnLoss(int64_t ticket);

 private:
  double size_;
  const double max_size_;
  double threshold_;
  int64_t last_ticket_ = 0;
  int64_t recovered_ticket_ = 0;  // losses up to here were answered
};

// Round trip of a request and its chunk, and the timeout that follows from it (RFC 6298).
class RoundTrip {
 public:
  void Add(double sample_s);
  double timeout_s() const;

 private:
  bool any_ = false;
  double mean_s_ = 0.1;
  double deviation_s_ = 0.05;
};

class BlobPull {
 public:
  struct Ask {
    int64_t offset;
    int64_t length;
  };
  static constexpr int64_t kUnknownSize = -1;

  enum class Outcome {
    kIgnored,   // double, not asked for, or of a blob of another size
    kTaken,     // more is missing
    kComplete,  // Take() gives it
    kTooLarge,  // its owner says again and again that it has more than max_bytes: give up
  };

  // chunk_bytes: what is asked for at once; a sender may use less. max_bytes: the largest blob
  // accepted. size_bytes: the blob's, where it is known; chunks that tell another are ignored.
  // If it is not known, the first chunk's word holds. When nothing more of that size comes, but
  // chunks of another, the pull begins again: one chunk that lies costs a timeout. Memory grows
  // with what was asked for and came, not with what a chunk claims.
  BlobPull(int chunk_bytes, int64_t max_bytes, int64_t size_bytes = kUnknownSize)
      : full_chunk_bytes_(chunk_bytes),
        max_bytes_(max_bytes),
        size_bytes_(size_bytes),
        chunk_bytes_(chunk_bytes) {}

  // The next missing range that is not in flight, at most max_chunks long. Marks it as in flight.
  std::optional<Ask> NextAsk(int max_chunks, double now_s, PullWindow* window);
  Outcome OnChunk(int64_t offset, int64_t total_bytes, const uint8_t* data, size_t size,
                  double now_s, PullWindow* window, RoundTrip* round_trip);
  // After a timeout: gives up all that is in flight and doubles the timeout, up to 2 s. True if it
  // did.
  bool CheckTimeout(double now_s, const RoundTrip& round_trip, PullWindow* window);
  // Nothing came although it was asked for.
  bool late() const { return num_timeouts_ >= 1; }
  // The same repeatedly: the owner is away.
  bool stalled() const { return num_timeouts_ >= 2; }

  int num_in_flight() const { return static_cast<int>(in_flight_.size()); }
  int64_t received_bytes() const { return received_bytes_; }
  // The whole blob, once; the pull is empty then.
  Bytes Take();
  // Forgets everything received.
  void Restart();

 private:
  struct Chunk {
    int64_t ticket = 0;  // of the ask in flight, 0 if none
    double asked_s = 0;
    int num_asks = 0;
    bool have = false;
  };

  bool AcceptTotal(int64_t total_bytes);
  Outcome OnMisfit();
  Outcome OnTooLarge();
  bool FitsGrid(int64_t offset, size_t size);
  void UseSmallerChunks(int chunk_bytes);
  void Store(size_t index, const uint8_t* data, size_t size);
  void FindLosses(int64_t arrived_ticket, PullWindow* window);
  int64_t ChunkSize(size_t index) const;
  bool complete() const { return total_bytes_ >= 0 && received_bytes_ == total_bytes_; }

  const int full_chunk_bytes_;
  const int64_t max_bytes_;
  const int64_t size_bytes_;
  int chunk_bytes_;
  int64_t total_bytes_ = kUnknownSize;  // by the chunks
  int64_t received_bytes_ = 0;
  std::vector<Chunk> chunks_;
  size_t first_missing_ = 0;             // no missing chunk before it that is not in flight
  std::map<int64_t, size_t> in_flight_;  // ticket -> chunk
  double last_event_s_ = 0;              // ask after idleness, or arrival
  int num_timeouts_ = 0;                 // since the last arrival
  int num_misfits_ = 0;                  // the same: chunks that belong to another size
  int num_too_large_ = 0;                // the same: chunks that tell more than max_bytes_
  int backoff_ = 0;                      // doublings of the timeout, until a clean round trip
  Bytes data_;
};

}  // namespace skein
