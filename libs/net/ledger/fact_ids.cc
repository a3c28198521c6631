#include "ledger/fact_ids.h"

#include <algorithm>
#include <stdexcept>

#include "core/hash.h"
#include "skein/finish_t.hpp"

namespace skein {
namespace {

std::string Text(const std::string& part) { return part; }
std::string Text(const char* part) { return part; }
std::string Text(int64_t part) { return std::to_string(part); }

template <class... Parts>
std::string Join(const std::string& first, const Parts&... parts) {
  std::string id = first;
  ((id += "/" + Text(parts)), ...);
  return id;
}

std::string Pair(int64_t first, int64_t second) {
  return std::to_string(first) + "-" + std::to_string(second);
}

}  // namespace

std::string ConfigurationFactId(const std::string& instance, const std::string& service,
                                const std::string& version, const std::string& text) {
  const std::string content = service + '\0' + version + '\0' + text;
  return Join("configuration", instance, HashBytes(content.data(), content.size()).substr(0, 16));
}

std::string ImageFactId(const std::string& blob_id) { return Join("image", blob_id); }

std::string RefusedOfferFactId(const std::string& agent, const std::string& name,
                               const std::string& blob_id) {
  const std::string offer = agent + '\0' + name + '\0' + blob_id;
  return Join("refused", HashBytes(offer.data(), offer.size()));
}

std::string VanishedAgentFactId(const std::string& blob_id, int64_t finish_id) {
  return VanishedAgentPrefix() + blob_id + "/" + std::to_string(finish_id);
}

std::string VanishedAgentPrefix() { return "vanished/"; }

std::string FeaturesFactId(int64_t image_id) { return Join("features", image_id); }
std::string CandidatesFactId(int64_t image_id) { return Join("candidates", image_id); }
std::string MatchesFactId(int64_t image_id) { return Join("matches", image_id); }

std::string RegistrationFactId(int64_t image_id, int64_t submap_id, int64_t epoch, int64_t n) {
  return Join("registration", image_id, submap_id, epoch, n);
}

std::string SeedFactId(int64_t image_id1, int64_t image_id2) {
  const auto [first, second] = std::minmax(image_id1, image_id2);
  return Join("seed", Pair(first, second));
}

std::string SubmapLeaseFactId(int64_t submap_id, int64_t epoch) {
  return Join("submap", submap_id, epoch, "lease");
}

std::string SubmapModelFactId(int64_t submap_id, int64_t epoch, int64_t n) {
  return Join("submap", submap_id, epoch, "model", n);
}

std::string SubmapEndFactId(int64_t submap_id) { return Join("submap", submap_id, "end"); }

std::string MergeAttemptFactId(int64_t source_id, int64_t target_id, int num_images,
                               int64_t drained_seq, bool ordered) {
  return Join("merge", Pair(source_id, target_id), int64_t{num_images}, drained_seq,
              ordered ? "ordered" : "failed");
}

std::string MergeFrozenFactId(int64_t merge_id, int64_t epoch) {
  return Join("merge", merge_id, "frozen", epoch);
}

std::string MergeEndFactId(int64_t merge_id, int64_t epoch) {
  return Join("merge", merge_id, "end", epoch);
}

std::string FailedStepFactId(int64_t submap_id, const std::string& step, const std::string& cause) {
  return Join("failure/submap", submap_id, step, cause);
}

std::string FailureFactId(const std::string& kind, int64_t item, int attempts) {
  return Join("failure", kind, item, int64_t{attempts});
}

std::string FinishRequestFactId(int64_t command_id) {
  return Join("finish", "requested", command_id);
}

std::string FinishFactId(int64_t finish_id, int8_t state) {
  switch (state) {
    case finish_t::DRAINED:
      return Join("finish", finish_id, "drained");
    case finish_t::BATCH:
      return Join("finish", finish_id, "batch");
    case finish_t::SETTLED:
      return Join("finish", finish_id, "settled");
    case finish_t::DONE:
      return Join("finish", finish_id, "done");
    case finish_t::CUT:
      return Join("finish", finish_id, "cut");
    default:
      throw std::invalid_argument("no fact id for a finish's state " + std::to_string(state));
  }
}

}  // namespace skein
