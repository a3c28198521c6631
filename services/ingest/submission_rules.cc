#include "ingest/submission_rules.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/hash.h"
#include "formats/formats.h"
#include "ledger/fact_ids.h"

namespace skein {
namespace {

constexpr size_t kMaxFactIdBytes = 200;
constexpr int kMaxKeypoints = 1 << 20;
constexpr size_t kMaxConfigurationBytes = 16 << 10;

// Of encodings (formats/formats.h): what they have beside their items, and an item.
constexpr int64_t kEncodingBytes = 1 << 10;
constexpr int64_t kKeypointBytes = 32;
constexpr int64_t kPairBytes = 512;
constexpr int64_t kInlierBytes = 8;
constexpr int64_t kModelBytes = int64_t{1} << 30;

Status Refuse(const std::string& reason) { return FailedPrecondition(reason); }

bool AllFinite(const double* values, size_t count) {
  return std::all_of(values, values + count, [](double v) { return std::isfinite(v); });
}

bool IsUnit(const double* qwxyz) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += qwxyz[i] * qwxyz[i];
  return std::abs(sum - 1) < 1e-3;
}

// Or tells nothing.
bool IsPlaced(const georeference_t& earth) {
  return !earth.ok || (AllFinite(earth.translation_m, 3) && std::isfinite(earth.scale) &&
                       earth.scale > 0 && IsUnit(earth.rotation_qwxyz));
}

// One method a kind.
class Rules {
 public:
  explicit Rules(const SessionState& state) : state_(state) {}

  Status operator()(const image_t&) const { return Refuse("photos come as offers"); }

  Status operator()(const features_t& f) const {
    if (Status status = CheckOnePerImage(f, FeaturesFactId(f.image_id)); !status.ok())
      return status;
    if (f.num_keypoints < 0 || f.num_keypoints > kMaxKeypoints) return Refuse("bad keypoint count");
    for (const auto* blob : {&f.keypoints_blob, &f.descriptors_blob}) {
      if (f.num_keypoints > 0 && blob->empty()) return Refuse("keypoints without their blobs");
    }
    if (f.global_model.empty()) return Refuse("no name of the global descriptor's model");
    return Status::Ok();
  }

  Status operator()(const candidates_t& f) const {
    if (Status status = CheckOnePerImage(f, CandidatesFactId(f.image_id)); !status.ok())
      return status;
    if (state_.FindPhoto(f.image_id)->features_seq == 0) return Refuse("photo has no features yet");
    return CheckOthers(f.image_id, f.other_ids);
  }

  Status operator()(const matches_t& f) const {
    if (Status status = CheckOnePerImage(f, MatchesFactId(f.image_id)); !status.ok()) return status;
    if (state_.FindPhoto(f.image_id)->candidates_seq == 0) {
      return Refuse("photo has no candidates yet");
    }
    std::vector<int64_t> others;
    for (const two_view_t& pair : f.pairs) {
      if (pair.num_inliers < 1) return Refuse("a verified pair without inliers");
      if (pair.num_inliers > kMaxKeypoints) return Refuse("a pair with too many inliers");
      others.push_back(pair.other_id);
    }
    if (f.num_pairs > 0 && f.pairs_blob.empty()) return Refuse("pairs without their blob");
    return CheckOthers(f.image_id, others);
  }

  Status operator()(const registration_t& f) const {
    if (state_.FindPhoto(f.image_id) == nullptr) return Refuse("no such photo");
    if (f.state < registration_t::REGISTERED || f.state > registration_t::WITHDRAWN) {
      return Refuse("unknown state");
    }
    const bool pose = f.state == registration_t::REGISTERED;
    if (pose && (!AllFinite(f.cam_from_world_xyz, 3) || !IsUnit(f.cam_from_world_qwxyz))) {
      return Refuse("pose is not finite or not a rotation");
    }
    return Status::Ok();
  }

  Status operator()(const submap_lease_t&) const { return Refuse("leases are ingest's to give"); }

  Status operator()(const submap_end_t& f) const {
    if (f.header.fact_id != SubmapEndFactId(f.submap_id)) {
      return Refuse("fact_id must be " + SubmapEndFactId(f.submap_id));
    }
    if (f.merged_into != 0) return Refuse("a submap is merged by its target's DONE");
    return f.reason.empty() ? Refuse("an end needs its reason") : Status::Ok();
  }

  Status operator()(const submap_model_t& f) const {
    if (f.kind != submap_model_t::CHECKPOINT && f.kind != submap_model_t::FINAL) {
      return Refuse("unknown kind");
    }
    if (f.model_blob.empty()) return Refuse("no model");
    if (std::min(f.ledger_seq, f.merge_seq) < 0) return Refuse("ledger position is negative");
    if (std::max(f.ledger_seq, f.merge_seq) > state_.head()) {
      return Refuse("ledger position lies in the future");
    }
    return IsPlaced(f.georeference) ? Status::Ok() : Refuse("georeference is no similarity");
  }

  Status operator()(const seed_t& f) const {
    if (f.image_id1 == f.image_id2) return Refuse("a pair needs two photos");
    if (state_.finishing() && state_.finish().settled_seq > 0)
      return Refuse("session is finishing");
    for (const int64_t image_id : {f.image_id1, f.image_id2}) {
      if (state_.FindPhoto(image_id) == nullptr) return Refuse("no such photo");
      if (state_.IsRegistered(image_id)) return Refuse("photo is registered already");
      if (state_.IsInLiveSeed(image_id)) return Refuse("photo is in a seed already");
    }
    return Status::Ok();
  }

  Status operator()(const merge_t& f) const {
    if (f.state != merge_t::FROZEN && !f.model_blob.empty()) {
      return Refuse("only the frozen source has a model");
    }
    switch (f.state) {
      case merge_t::ORDERED:
        return CheckOrder(f);
      case merge_t::FAILED:
        return Status::Ok();
      case merge_t::FROZEN:
      case merge_t::DONE:
      case merge_t::UNDONE:
        return CheckMergeStep(f);
      default:
        return Refuse("unknown state");
    }
  }

  Status operator()(const failure_t& f) const {
    if (f.image_id != 0 && state_.FindPhoto(f.image_id) == nullptr) return Refuse("no such photo");
    if (f.stage.empty() || f.reason.empty()) return Refuse("a failure needs its stage and reason");
    return Status::Ok();
  }

  Status operator()(const configuration_t& f) const {
    if (f.service.empty() || f.instance.empty()) return Refuse("no name of the service");
    return f.text.size() <= kMaxConfigurationBytes ? Status::Ok()
                                                   : Refuse("configuration too long");
  }

  Status operator()(const finish_t& f) const {
    if (f.state != finish_t::SETTLED && f.state != finish_t::BATCH) {
      return Refuse("only batch and settling are submitted");
    }
    const FinishState& finish = state_.finish();
    if (f.state == finish_t::BATCH && finish.batch_seq > 0) return Refuse("there was a batch");
    if (f.finish_id != finish.finish_id) return Refuse("another finish");
    return finish.state == finish_t::DRAINED ? Status::Ok() : Refuse("not drained");
  }

 private:
  template <class T>
  Status CheckOnePerImage(const T& fact, const std::string& fact_id) const {
    if (state_.FindPhoto(fact.image_id) == nullptr) return Refuse("no such photo");
    return fact.header.fact_id == fact_id ? Status::Ok() : Refuse("fact_id must be " + fact_id);
  }

  Status CheckOthers(int64_t image_id, std::vector<int64_t> others) const {
    std::sort(others.begin(), others.end());
    if (std::adjacent_find(others.begin(), others.end()) != others.end()) {
      return Refuse("names a photo twice");
    }
    for (const int64_t other : others) {
      if (other == image_id || state_.FindPhoto(other) == nullptr)
        return Refuse("no such other photo");
    }
    return Status::Ok();
  }

  Status CheckOrder(const merge_t& f) const {
    if (f.source_id == f.target_id) return Refuse("a merge needs two submaps");
    if (state_.finishing() && state_.finish().settled_seq > 0)
      return Refuse("session is finishing");
    if (!(f.target_from_source_scale > 0) || !std::isfinite(f.target_from_source_scale) ||
        !IsUnit(f.target_from_source_qwxyz) || !AllFinite(f.target_from_source_xyz, 3)) {
      return Refuse("not a similarity");
    }
    for (const int64_t submap_id : {f.source_id, f.target_id}) {
      const SubmapLife* submap = state_.FindSubmap(submap_id);
      if (submap == nullptr || submap->ended) return Refuse("no such living submap");
      if (submap->open_merge_id != 0) return Refuse("submap is in a merge already");
    }
    return Status::Ok();
  }

  Status CheckMergeStep(const merge_t& f) const {
    const MergeState* merge = state_.FindMerge(f.merge_id);
    if (merge == nullptr) return Refuse("no such merge");
    const int8_t before = merge->latest().state;
    const merge_t& ordered = merge->ordered();
    if (f.source_id != ordered.source_id || f.target_id != ordered.target_id) {
      return Refuse("other submaps than were ordered to merge");
    }
    if (!merge->is_open()) return Refuse("merge is over");
    if (f.state == merge_t::FROZEN && f.model_blob.empty()) return Refuse("no model");
    if (f.state == merge_t::DONE && before != merge_t::FROZEN)
      return Refuse("source is not frozen");
    return Status::Ok();
  }

  const SessionState& state_;
};

// The lease under which a mapper says something.
struct LeaseClaim {
  int64_t submap_id;
  int64_t epoch;
};

std::optional<LeaseClaim> ClaimOf(const Fact& fact) {
  if (const auto* r = std::get_if<registration_t>(&fact)) return LeaseClaim{r->submap_id, r->epoch};
  if (const auto* m = std::get_if<submap_model_t>(&fact)) return LeaseClaim{m->submap_id, m->epoch};
  if (const auto* e = std::get_if<submap_end_t>(&fact)) return LeaseClaim{e->submap_id, e->epoch};
  const auto* merge = std::get_if<merge_t>(&fact);
  if (merge == nullptr) return std::nullopt;
  if (merge->state == merge_t::FROZEN) return LeaseClaim{merge->source_id, merge->source_epoch};
  const bool ends = merge->state == merge_t::DONE || merge->state == merge_t::UNDONE;
  if (ends) return LeaseClaim{merge->target_id, merge->target_epoch};
  return std::nullopt;
}

void SetIds(image_t* f, const SessionState& state) { f->image_id = state.next_image_id(); }
void SetIds(seed_t* f, const SessionState& state) {
  f->submap_id = state.submaps().empty() ? 1 : state.submaps().rbegin()->first + 1;
}
void SetIds(merge_t* f, const SessionState&) {
  if (f->state == merge_t::ORDERED) f->merge_id = f->header.seq;
}
void SetIds(finish_t* f, const SessionState&) {
  if (f->state == finish_t::REQUESTED) f->finish_id = f->header.seq;
}
template <class T>
void SetIds(T*, const SessionState&) {}

}  // namespace

Status CheckSubmission(const Fact& fact, const SessionState& state) {
  const fact_header_t& header = Header(fact);
  if (header.fact_id.empty() || header.fact_id.size() > kMaxFactIdBytes) {
    return Refuse("fact_id must have 1 to 200 bytes");
  }
  if (header.author.empty()) return Refuse("no author");
  if (!HasValidTexts(fact)) return Refuse("a text is not valid UTF-8");
  for (const std::string& blob : BlobsOf(fact)) {
    if (!IsBlobId(blob)) return Refuse("'" + ClampText(blob, 70) + "' is no blob id");
  }
  return std::visit(Rules(state), fact);
}

namespace {

std::vector<NamedBlob> BlobsWithin(const features_t& f) {
  return {{f.keypoints_blob, kEncodingBytes + kKeypointBytes * f.num_keypoints},
          {f.descriptors_blob,
           kEncodingBytes + static_cast<int64_t>(Descriptors::kDim) * f.num_keypoints},
          {f.global_blob, kEncodingBytes + int64_t{sizeof(float)} * kMaxGlobalDescriptorValues}};
}

std::vector<NamedBlob> BlobsWithin(const matches_t& f) {
  int64_t max_bytes = kEncodingBytes;
  for (const two_view_t& pair : f.pairs) {
    max_bytes += kPairBytes + kInlierBytes * static_cast<int64_t>(pair.num_inliers);
  }
  return {{f.pairs_blob, max_bytes}};
}

std::vector<NamedBlob> BlobsWithin(const submap_model_t& f) {
  return {{f.model_blob, kModelBytes}};
}
std::vector<NamedBlob> BlobsWithin(const merge_t& f) { return {{f.model_blob, kModelBytes}}; }
template <class T>
std::vector<NamedBlob> BlobsWithin(const T&) {
  return {};
}

}  // namespace

std::vector<NamedBlob> NamedBlobs(const Fact& fact) {
  std::vector<NamedBlob> blobs = std::visit([](const auto& f) { return BlobsWithin(f); }, fact);
  const auto is_unnamed = [](const NamedBlob& blob) { return blob.blob_id.empty(); };
  blobs.erase(std::remove_if(blobs.begin(), blobs.end(), is_unnamed), blobs.end());
  return blobs;
}

Status CheckLease(const Fact& fact, const SessionState& state) {
  const std::optional<LeaseClaim> claim = ClaimOf(fact);
  if (!claim) return Status::Ok();
  const SubmapLife* submap = state.FindSubmap(claim->submap_id);
  if (submap == nullptr) return Refuse("no such submap");
  if (submap->ended) return Refuse("submap has ended: " + submap->end_reason);
  if (claim->epoch != submap->lease.epoch) {
    return Refuse("epoch " + std::to_string(claim->epoch) + " is over; " + submap->lease.owner +
                  " has the submap in epoch " + std::to_string(submap->lease.epoch));
  }
  if (Header(fact).author == submap->lease.owner) return Status::Ok();
  return Refuse("submap is leased to " + submap->lease.owner);
}

void CompleteFact(Fact* fact, const SessionState& state, int64_t utime_us) {
  Header(*fact).seq = state.head() + 1;
  Header(*fact).utime_us = std::max(utime_us, state.last_utime_us());
  std::visit([&](auto& f) { SetIds(&f, state); }, *fact);
}

}  // namespace skein
