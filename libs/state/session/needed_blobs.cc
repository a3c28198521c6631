#include "session/needed_blobs.h"

namespace skein {
namespace {

void AddPhoto(const PhotoState& photo, std::set<std::string>* blobs) {
  blobs->insert(photo.image.blob_id);
  blobs->insert(photo.features.keypoints_blob);
  blobs->insert(photo.features.descriptors_blob);
  blobs->insert(photo.features.global_blob);
  blobs->insert(photo.pairs_blob);
}

// A target that is restored from a model older than the merge carries the merge out again. A source
// whose merge was undone goes on from where it froze.
bool NeedsFrozenModel(const SessionState& state, const MergeState& merge) {
  if (merge.latest().state != merge_t::DONE) return state.IsLive(merge.ordered().source_id);
  const SubmapLife& target = *state.FindSubmap(merge.ordered().target_id);
  if (target.ended) return false;
  return !target.latest_model || target.latest_model->merge_seq < merge.ordered().header.seq;
}

}  // namespace

std::set<std::string> NeededBlobs(const SessionState& state) {
  std::set<std::string> blobs;
  for (const auto& [id, photo] : state.photos()) AddPhoto(photo, &blobs);
  for (const auto& [id, submap] : state.submaps()) {
    if (!submap.ended && submap.latest_model) blobs.insert(submap.latest_model->model_blob);
  }
  for (const auto& [id, merge] : state.merges()) {
    if (!NeedsFrozenModel(state, merge)) continue;
    for (const merge_t& fact : merge.facts) blobs.insert(fact.model_blob);
  }
  blobs.erase("");
  return blobs;
}

}  // namespace skein
