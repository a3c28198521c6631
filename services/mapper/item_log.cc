#include "mapper/item_log.h"

#include <algorithm>
#include <map>

namespace skein {

void ItemLog::Take(const Fact& fact) {
  if (const auto* matches = std::get_if<matches_t>(&fact)) {
    items_.push_back({matches->header.seq, Item::Kind::kMatches, matches->image_id});
  } else if (const auto* merge = std::get_if<merge_t>(&fact)) {
    if (merge->state != merge_t::ORDERED) return;
    merges_.push_back(merge->header.seq);
  } else if (const auto* finish = std::get_if<finish_t>(&fact)) {
    static const std::map<int8_t, Item::Kind> kKinds = {{finish_t::DRAINED, Item::Kind::kDrained},
                                                        {finish_t::BATCH, Item::Kind::kBatch},
                                                        {finish_t::SETTLED, Item::Kind::kSettled}};
    const auto kind = kKinds.find(finish->state);
    if (kind != kKinds.end()) {
      items_.push_back({finish->header.seq, kind->second, finish->finish_id});
    }
  }
}

void ItemCursor::StartAfter(int64_t seq, int64_t merge_seq) {
  const auto& items = log_.items();
  const auto& merges = log_.merges();
  next_ = std::upper_bound(items.begin(), items.end(), seq,
                           [](int64_t s, const Item& item) { return s < item.seq; }) -
          items.begin();
  next_merge_ = std::upper_bound(merges.begin(), merges.end(), merge_seq) - merges.begin();
  seq_ = seq;
  merge_seq_ = merge_seq;
  is_open_ = true;
}

std::optional<int64_t> ItemCursor::PeekMerge() const {
  if (next_merge_ >= log_.merges().size()) return std::nullopt;
  return log_.merges()[next_merge_];
}

std::optional<int64_t> ItemCursor::NextMerge() {
  const std::optional<int64_t> merge = PeekMerge();
  if (merge) merge_seq_ = log_.merges()[next_merge_++];
  return merge;
}

std::optional<Item> ItemCursor::Next() {
  if (next_ >= log_.items().size()) return std::nullopt;
  const Item item = log_.items()[next_++];
  seq_ = item.seq;
  is_open_ = true;
  return item;
}

void ItemCursor::SkipTo(int64_t seq) { seq_ = std::max(seq_, seq); }

bool ItemCursor::HasReached(int64_t seq) const {
  return next_ >= log_.items().size() || log_.items()[next_].seq > seq;
}

}  // namespace skein
