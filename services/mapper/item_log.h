// Items of the ledger that submaps work through, and a submap's position among them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "ledger/facts.h"

namespace skein {

struct Item {
  enum class Kind { kMatches, kDrained, kBatch, kSettled };
  int64_t seq = 0;
  Kind kind = Kind::kMatches;
  int64_t id = 0;  // image id or finish id
};

// The items of the whole ledger, by seq, and its merges. Loop's thread only.
class ItemLog {
 public:
  void Take(const Fact& fact);
  const std::vector<Item>& items() const { return items_; }
  const std::vector<int64_t>& merges() const { return merges_; }  // ids, which are the orders' seqs

 private:
  std::vector<Item> items_;
  std::vector<int64_t> merges_;
};

// A submap's place in the log. Its state is a function of the items that were opened.
class ItemCursor {
 public:
  explicit ItemCursor(const ItemLog& log) : log_(log) {}

  // Everything up to `seq` and merges up to `merge_seq` are known to the submap; what came with
  // `seq` is still worked on.
  void StartAfter(int64_t seq, int64_t merge_seq);
  // Opens the next item; nullopt if there is none.
  std::optional<Item> Next();
  // The next merge, by id. A merge waits for no item, not for the open one either: items that the
  // source has not worked through become the target's.
  std::optional<int64_t> NextMerge();
  std::optional<int64_t> PeekMerge() const;
  // The open item is done.
  void Close() { is_open_ = false; }
  // All items are done, and the ledger was read up to `seq`.
  void SkipTo(int64_t seq);

  // Sequence number of the item opened last.
  int64_t seq() const { return seq_; }
  // Id of the last merge that NextMerge returned.
  int64_t merge_seq() const { return merge_seq_; }
  // Everything up to here is done.
  int64_t done_seq() const { return is_open_ ? seq_ - 1 : seq_; }
  // All items up to `seq` were opened.
  bool HasReached(int64_t seq) const;
  int num_left() const { return static_cast<int>(log_.items().size() - next_); }

 private:
  const ItemLog& log_;
  size_t next_ = 0, next_merge_ = 0;
  int64_t seq_ = 0, merge_seq_ = 0;
  bool is_open_ = false;
};

}  // namespace skein
