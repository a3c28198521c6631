#include "merger/submap_directory.h"

#include <algorithm>

namespace skein {
namespace {

// Some 30 of their matches have points then, as many as a pose needs.
constexpr int kMinLinkingInliers = 60;

}  // namespace

void SubmapDirectory::OnStatus(int64_t submap_id, int64_t epoch, int64_t ledger_seq) {
  const SubmapLife* submap = session_.FindSubmap(submap_id);
  if (submap == nullptr || epoch != submap->lease.epoch) return;
  Position& position = positions_[submap_id];
  if (position.epoch != epoch) position = {epoch, 0};
  position.ledger_seq = std::max(position.ledger_seq, ledger_seq);
}

int64_t SubmapDirectory::PositionOf(int64_t submap_id, const SubmapLife& submap) const {
  const auto found = positions_.find(submap_id);
  const bool known = found != positions_.end() && found->second.epoch == submap.lease.epoch;
  return known ? found->second.ledger_seq : 0;
}

std::vector<LiveSubmap> SubmapDirectory::Live() const {
  std::vector<LiveSubmap> live;
  for (const auto& [id, submap] : session_.submaps()) {
    if (!submap.ended) live.push_back({id, &submap, PositionOf(id, submap)});
  }
  return live;
}

bool SubmapDirectory::IsDeferred(int64_t image_id) const {
  for (const LiveSubmap& submap : Live()) {
    const auto photo = submap.state->photos.find(image_id);
    if (photo == submap.state->photos.end()) continue;
    const int8_t state = photo->second.state;
    if (state == registration_t::DEFERRED || state == registration_t::WITHDRAWN) return true;
  }
  return false;
}

bool SubmapDirectory::IsBusy(int64_t submap_id) const {
  const SubmapLife* submap = session_.FindSubmap(submap_id);
  return submap != nullptr && submap->open_merge_id != 0;
}

int SubmapDirectory::NumOpenMerges() const {
  const auto& merges = session_.merges();
  return static_cast<int>(std::count_if(merges.begin(), merges.end(), [&](const auto& entry) {
    const SubmapLife* source = session_.FindSubmap(entry.second.ordered().source_id);
    return source->open_merge_id == entry.first;
  }));
}

// Photo -> live submaps, by id.
SubmapDirectory::Holders SubmapDirectory::HoldersOfPhotos() const {
  Holders holders;
  for (const LiveSubmap& submap : Live()) {
    for (const auto& [image_id, photo] : submap.state->photos) {
      if (photo.state == registration_t::REGISTERED) holders[image_id].push_back(submap.submap_id);
    }
  }
  return holders;
}

const SubmapDirectory::Overlaps& SubmapDirectory::FindOverlaps() const {
  if (cached_.head != session_.head()) cached_ = {session_.head(), ComputeOverlaps()};
  return cached_.overlaps;
}

SubmapDirectory::Overlaps SubmapDirectory::ComputeOverlaps() const {
  if (Live().size() < 2) return {};
  const Holders holders = HoldersOfPhotos();
  Overlaps overlaps;
  std::map<Pair, std::vector<std::pair<int64_t, int64_t>>> linked;  // -inliers, photo
  for (const auto& [image_id, own] : holders) {
    for (auto a = own.begin(); a != own.end(); ++a) {
      for (auto b = std::next(a); b != own.end(); ++b) {
        overlaps[{*a, *b}].shared.push_back(image_id);
      }
    }
    for (const auto& [other, inliers] : LinksOf(image_id, own, holders)) {
      if (inliers < kMinLinkingInliers) continue;
      for (const int64_t submap_id : own) {
        linked[std::minmax(submap_id, other)].emplace_back(-inliers, image_id);
      }
    }
  }
  for (auto& [pair, photos] : linked) {
    std::sort(photos.begin(), photos.end());
    for (const auto& [unused, image_id] : photos) overlaps[pair].linked.push_back(image_id);
  }
  for (auto& [pair, overlap] : overlaps) std::sort(overlap.shared.begin(), overlap.shared.end());
  return overlaps;
}

std::vector<int64_t> SubmapDirectory::WithNeighbours(const Pair& pair, std::vector<int64_t> images,
                                                     int num) const {
  std::map<int64_t, int64_t> inliers;  // of candidates, with photos of their submap among `images`
  const auto count_with = [&](int64_t image_id) {
    for (const int64_t submap_id : {pair.first, pair.second}) {
      const int64_t other = submap_id == pair.first ? pair.second : pair.first;
      const SubmapLife& holder = *session_.FindSubmap(submap_id);
      if (!holder.IsRegistered(image_id)) continue;
      for (const CovisibilityGraph::Edge& edge : session_.covisibility().EdgesOf(image_id)) {
        const bool is_candidate = holder.IsRegistered(edge.other_id) &&
                                  !session_.FindSubmap(other)->IsRegistered(edge.other_id);
        if (is_candidate) inliers[edge.other_id] += edge.num_inliers;
      }
    }
  };
  for (const int64_t image_id : images) count_with(image_id);
  for (const int64_t image_id : images) inliers.erase(image_id);
  while (static_cast<int>(images.size()) < num && !inliers.empty()) {
    const auto best =
        std::max_element(inliers.begin(), inliers.end(),
                         [](const auto& a, const auto& b) { return a.second < b.second; });
    images.push_back(best->first);
    count_with(images.back());
    for (const int64_t image_id : images) inliers.erase(image_id);
  }
  return images;
}

// Submaps that do not hold the photo -> inliers of its verified pairs with photos there.
std::map<int64_t, int64_t> SubmapDirectory::LinksOf(int64_t image_id,
                                                    const std::vector<int64_t>& own,
                                                    const Holders& holders) const {
  std::map<int64_t, int64_t> links;
  for (const CovisibilityGraph::Edge& edge : session_.covisibility().EdgesOf(image_id)) {
    const auto others = holders.find(edge.other_id);
    if (others == holders.end()) continue;
    for (const int64_t other : others->second) {
      if (!std::binary_search(own.begin(), own.end(), other)) links[other] += edge.num_inliers;
    }
  }
  return links;
}

}  // namespace skein
