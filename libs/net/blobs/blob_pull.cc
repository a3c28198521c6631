#include "blobs/blob_pull.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace skein {
namespace {

constexpr double kMinWindow = 4;
constexpr double kMinTimeoutS = 0.05;
constexpr double kMaxTimeoutS = 2.0;

// Chunks that may overtake another before that one counts as lost.
constexpr int64_t kReorder = 3;

// Fewer chunks may be lies, or strays.
constexpr int kBelieved = 8;

}  // namespace

PullWindow::PullWindow(int initial_chunks, int max_chunks)
    : size_(initial_chunks), max_size_(max_chunks), threshold_(max_chunks) {}

void PullWindow::OnArrival() {
  size_ = std::min(max_size_, size_ + (size_ < threshold_ ? 1 : 1 / size_));
}

void PullWindow::OnLoss(int64_t ticket) {
  if (ticket <= recovered_ticket_) return;
  size_ = threshold_ = std::max(kMinWindow, size_ / 2);
  recovered_ticket_ = last_ticket_;
}

void RoundTrip::Add(double sample_s) {
  if (!any_) {
    mean_s_ = sample_s;
    deviation_s_ = sample_s / 2;
    any_ = true;
    return;
  }
  deviation_s_ += (std::abs(sample_s - mean_s_) - deviation_s_) / 4;
  mean_s_ += (sample_s - mean_s_) / 8;
}

double RoundTrip::timeout_s() const {
  return std::clamp(mean_s_ + 4 * deviation_s_, kMinTimeoutS, kMaxTimeoutS);
}

std::optional<BlobPull::Ask> BlobPull::NextAsk(int max_chunks, double now_s, PullWindow* window) {
  if (complete() || max_chunks <= 0) return std::nullopt;
  const auto wanted = [this](size_t i) { return !chunks_[i].have && chunks_[i].ticket == 0; };
  if (total_bytes_ < 0 && in_flight_.empty()) {  // a blind first ask
    chunks_.assign(max_chunks, {});
    first_missing_ = 0;
  }
  while (first_missing_ < chunks_.size() && !wanted(first_missing_)) ++first_missing_;
  const size_t first = first_missing_;
  size_t end = first;
  if (in_flight_.empty()) last_event_s_ = now_s;
  for (; end < chunks_.size() && end - first < static_cast<size_t>(max_chunks) && wanted(end);
       ++end) {
    Chunk& chunk = chunks_[end];
    chunk.ticket = window->NextTicket();
    chunk.asked_s = now_s;
    ++chunk.num_asks;
    in_flight_[chunk.ticket] = end;
  }
  if (end == first) return std::nullopt;
  return Ask{static_cast<int64_t>(first) * chunk_bytes_,
             static_cast<int64_t>(end - first) * chunk_bytes_};
}

BlobPull::Outcome BlobPull::OnChunk(int64_t offset, int64_t total_bytes, const uint8_t* data,
                                    size_t size, double now_s, PullWindow* window,
                                    RoundTrip* round_trip) {
  if (size_bytes_ != kUnknownSize && total_bytes != size_bytes_) return Outcome::kIgnored;
  if (total_bytes > max_bytes_) return OnTooLarge();
  if (!AcceptTotal(total_bytes)) return OnMisfit();
  if (complete()) return Outcome::kComplete;  // an empty blob
  if (!FitsGrid(offset, size)) return OnMisfit();
  const auto index = static_cast<size_t>(offset / chunk_bytes_);
  Chunk& chunk = chunks_[index];
  if (chunk.have || chunk.num_asks == 0) return Outcome::kIgnored;
  const int64_t ticket = chunk.ticket;
  // Only a chunk asked for once measures the round trip (Karn's algorithm).
  if (ticket > 0 && chunk.num_asks == 1) {
    round_trip->Add(now_s - chunk.asked_s);
    backoff_ = 0;
  }
  Store(index, data, size);
  last_event_s_ = now_s;
  num_timeouts_ = num_misfits_ = num_too_large_ = 0;
  window->OnArrival();
  if (ticket > 0) FindLosses(ticket, window);
  return complete() ? Outcome::kComplete : Outcome::kTaken;
}

BlobPull::Outcome BlobPull::OnMisfit() {
  ++num_misfits_;
  return Outcome::kIgnored;
}

BlobPull::Outcome BlobPull::OnTooLarge() {
  return ++num_too_large_ >= kBelieved ? Outcome::kTooLarge : Outcome::kIgnored;
}

bool BlobPull::AcceptTotal(int64_t total_bytes) {
  if (total_bytes < 0) return false;
  if (total_bytes_ >= 0) return total_bytes == total_bytes_;
  total_bytes_ = total_bytes;
  chunks_.resize(static_cast<size_t>((total_bytes + chunk_bytes_ - 1) / chunk_bytes_));
  // The blind first ask may have reached beyond the end.
  for (auto it = in_flight_.begin(); it != in_flight_.end();) {
    it = it->second >= chunks_.size() ? in_flight_.erase(it) : std::next(it);
  }
  return true;
}

int64_t BlobPull::ChunkSize(size_t index) const {
  return std::min<int64_t>(chunk_bytes_, total_bytes_ - static_cast<int64_t>(index) * chunk_bytes_);
}

bool BlobPull::FitsGrid(int64_t offset, size_t size) {
  if (offset < 0 || offset >= total_bytes_ || size == 0) return false;
  // A sender whose own limit is smaller begins with a short chunk.
  const bool is_short = static_cast<int64_t>(size) < std::min<int64_t>(chunk_bytes_, total_bytes_);
  if (offset == 0 && is_short && received_bytes_ == 0) UseSmallerChunks(static_cast<int>(size));
  if (offset % chunk_bytes_ != 0) return false;
  return static_cast<int64_t>(size) == ChunkSize(static_cast<size_t>(offset / chunk_bytes_));
}

void BlobPull::UseSmallerChunks(int chunk_bytes) {
  constexpr int kSmallestChunk = 256;  // less would only waste memory on bookkeeping
  if (chunk_bytes < kSmallestChunk) return;
  const int64_t total_bytes = total_bytes_;
  const auto is_asked = [](const Chunk& chunk) { return chunk.num_asks > 0; };
  const int64_t asked_bytes =
      std::count_if(chunks_.begin(), chunks_.end(), is_asked) * chunk_bytes_;
  Restart();
  chunk_bytes_ = chunk_bytes;
  AcceptTotal(total_bytes);
  // In larger chunks: they measure no round trip.
  for (size_t i = 0; i < chunks_.size() && static_cast<int64_t>(i) * chunk_bytes_ < asked_bytes;
       ++i) {
    chunks_[i].num_asks = 2;
  }
}

void BlobPull::Store(size_t index, const uint8_t* data, size_t size) {
  Chunk& chunk = chunks_[index];
  in_flight_.erase(chunk.ticket);
  chunk.ticket = 0;
  chunk.have = true;
  const size_t offset = index * static_cast<size_t>(chunk_bytes_);
  // Grows with what has come, not with what a message claims.
  if (data_.size() < offset + size) data_.resize(offset + size);
  std::memcpy(data_.data() + offset, data, size);
  received_bytes_ += static_cast<int64_t>(size);
}

void BlobPull::FindLosses(int64_t arrived_ticket, PullWindow* window) {
  while (!in_flight_.empty() && in_flight_.begin()->first < arrived_ticket - kReorder) {
    const auto [ticket, index] = *in_flight_.begin();
    in_flight_.erase(in_flight_.begin());
    chunks_[index].ticket = 0;
    first_missing_ = std::min(first_missing_, index);
    window->OnLoss(ticket);
  }
}

bool BlobPull::CheckTimeout(double now_s, const RoundTrip& round_trip, PullWindow* window) {
  const double wait_s =
      std::min(kMaxTimeoutS, round_trip.timeout_s() * std::pow(2.0, std::min(backoff_, 10)));
  if (in_flight_.empty() || now_s < last_event_s_ + wait_s) return false;
  for (const auto& [ticket, index] : in_flight_) {
    chunks_[index].ticket = 0;
    first_missing_ = std::min(first_missing_, index);
  }
  if (!stalled()) window->OnLoss(in_flight_.rbegin()->first);  // an absent owner is no congestion
  in_flight_.clear();
  ++num_timeouts_;
  ++backoff_;
  if (std::exchange(num_misfits_, 0) > 0) Restart();
  return true;
}

Bytes BlobPull::Take() {
  Bytes bytes = std::move(data_);
  Restart();
  return bytes;
}

void BlobPull::Restart() {
  chunk_bytes_ = full_chunk_bytes_;
  total_bytes_ = kUnknownSize;
  received_bytes_ = 0;
  chunks_.clear();
  in_flight_.clear();
  first_missing_ = 0;
  data_.clear();
}

}  // namespace skein
