#include "session/session_history.h"

#include <algorithm>
#include <cstdlib>

#include "core/finite.h"
#include "ledger/fact_ids.h"

namespace skein {
namespace {

// The content that a vanished agent was sending, "" for other failures.
std::string VanishedBlob(const failure_t& failure) {
  static const std::string kPrefix = VanishedAgentPrefix();
  const std::string& id = failure.header.fact_id;
  if (id.compare(0, kPrefix.size(), kPrefix) != 0) return "";
  return id.substr(kPrefix.size(), id.rfind('/') - kPrefix.size());
}

bool IsRefusal(const failure_t& failure) {
  return failure.image_id == 0 && failure.stage == "ingest";
}

}  // namespace

void SessionHistory::Apply(const Fact& fact) {
  fact_ids_[Header(fact).fact_id] = Header(fact).seq;
  std::visit([this](const auto& f) { ApplyFact(f); }, fact);
}

int64_t SessionHistory::FindFact(const std::string& fact_id) const {
  const auto found = fact_ids_.find(fact_id);
  return found == fact_ids_.end() ? 0 : found->second;
}

int64_t SessionHistory::FindImageByBlob(const std::string& blob_id) const {
  const auto found = image_by_blob_.find(blob_id);
  return found == image_by_blob_.end() ? 0 : found->second;
}

const SessionHistory::FirstRegistration* SessionHistory::FindFirstRegistration(
    int64_t image_id) const {
  const auto found = first_registrations_.find(image_id);
  return found == first_registrations_.end() ? nullptr : &found->second;
}

std::vector<failure_t> SessionHistory::Failures() const {
  std::vector<failure_t> failures;
  for (const auto& [seq, failure] : failures_) {
    if (failure.image_id == 0 || failure.parked) failures.push_back(failure);
  }
  return failures;
}

const failure_t* SessionHistory::FindFailure(const std::string& fact_id) const {
  const auto found = failure_by_id_.find(fact_id);
  return found == failure_by_id_.end() ? nullptr : &failures_.at(found->second);
}

// A stage that is done again, after a crash, ended the first time.
void SessionHistory::EndStage(int64_t image_id, PhotoStage stage, int64_t utime_us, float work_s) {
  PhotoPath& path = paths_[image_id];
  const auto index = static_cast<size_t>(stage);
  if (path.end_utime_us[index] != 0) return;
  path.end_utime_us[index] = utime_us;
  path.work_s[index] = FiniteOrZero(work_s);
}

void SessionHistory::AddTime(const std::string& stage, float seconds) {
  times_.by_stage[stage].push_back(seconds);
  times_.sum_s[stage] += std::max(FiniteOrZero(seconds), 0.F);
}

void SessionHistory::ApplyFact(const image_t& fact) {
  paths_[fact.image_id].received_utime_us = fact.received_utime_us;
  EndStage(fact.image_id, PhotoStage::kIngest, fact.header.utime_us, 0);
  image_by_blob_[fact.blob_id] = fact.image_id;
  AddTime("ingest", static_cast<float>(fact.header.utime_us - fact.received_utime_us) * 1e-6f);
  ForgetVanished(fact.blob_id);
}

// The photo came after all.
void SessionHistory::ForgetVanished(const std::string& blob_id) {
  const auto found = vanished_.find(blob_id);
  if (found == vanished_.end()) return;
  for (const std::string& id : found->second) {
    const auto failure = failures_.find(failure_by_id_.at(id));
    num_refused_ -= IsRefusal(failure->second) ? 1 : 0;
    failures_.erase(failure);
    failure_by_id_.erase(id);
  }
  vanished_.erase(found);
}

void SessionHistory::ApplyFact(const features_t& fact) {
  EndStage(fact.image_id, PhotoStage::kFeatures, fact.header.utime_us,
           fact.local_s + fact.global_s);
  AddTime("features", fact.local_s + fact.global_s);
  AddTime("features.local", fact.local_s);
  AddTime("features.global", fact.global_s);
}

void SessionHistory::ApplyFact(const candidates_t& fact) {
  EndStage(fact.image_id, PhotoStage::kRetrieval, fact.header.utime_us,
           fact.insert_s + fact.query_s);
  unmatched_candidates_[fact.image_id] = fact.other_ids;
  AddTime("retrieval", fact.insert_s + fact.query_s);
  AddTime("retrieval.insert", fact.insert_s);
  AddTime("retrieval.query", fact.query_s);
}

void SessionHistory::CountHits(const matches_t& fact) {
  retrieval_.pairs_matched += fact.num_tried;
  retrieval_.pairs_verified += fact.num_pairs;
  const auto found = unmatched_candidates_.find(fact.image_id);
  if (found == unmatched_candidates_.end()) return;
  const std::vector<int64_t>& candidates = found->second;
  retrieval_.candidates += static_cast<int64_t>(candidates.size());
  for (const two_view_t& pair : fact.pairs) {
    retrieval_.hits += std::count(candidates.begin(), candidates.end(), pair.other_id);
  }
  unmatched_candidates_.erase(found);
}

void SessionHistory::ApplyFact(const matches_t& fact) {
  CountHits(fact);
  EndStage(fact.image_id, PhotoStage::kMatching, fact.header.utime_us,
           fact.match_s + fact.verify_s);
  AddTime("matching", fact.match_s + fact.verify_s);
  AddTime("matching.match", fact.match_s);
  AddTime("matching.verify", fact.verify_s);
}

void SessionHistory::ApplyFact(const registration_t& fact) {
  if (fact.state != registration_t::REGISTERED) return;
  EndStage(fact.image_id, PhotoStage::kMapper, fact.header.utime_us, std::max(fact.total_s, 0.F));
  first_registrations_.try_emplace(fact.image_id,
                                   FirstRegistration{fact.header.utime_us, fact.submap_id});
  if (fact.total_s <= 0) return;  // it came with a merged submap
  placements_.emplace(fact.image_id, fact.submap_id);
  AddTime("mapper", fact.total_s);
  AddTime("mapper.register", fact.register_s);
  AddTime("mapper.triangulate", fact.triangulate_s);
  AddTime("mapper.local_ba", fact.local_ba_s);
}

void SessionHistory::ApplyFact(const merge_t& fact) {
  if (fact.state == merge_t::DONE || fact.state == merge_t::UNDONE) {
    AddTime("merge", fact.duration_s);
  }
}

void SessionHistory::ApplyFact(const failure_t& fact) {
  failures_[fact.header.seq] = fact;
  num_refused_ += IsRefusal(fact) ? 1 : 0;
  failure_by_id_[fact.header.fact_id] = fact.header.seq;
  if (const std::string blob = VanishedBlob(fact); !blob.empty()) {
    vanished_[blob].push_back(fact.header.fact_id);
  }
}

void SessionHistory::ApplyFact(const finish_t& fact) {
  if (fact.state == finish_t::REQUESTED || fact.state == finish_t::DEADLINE) {
    finish_of_command_[std::atoll(fact.detail.c_str())] = fact.finish_id;
  } else if (fact.state == finish_t::DONE) {
    finish_results_[fact.finish_id] = fact.detail;
  }
}

void SessionHistory::ApplyFact(const configuration_t& fact) {
  configurations_[{fact.service, fact.text, fact.version}].insert(fact.instance);
}

}  // namespace skein
