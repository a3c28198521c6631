#include "session/finish_cut.h"

#include <algorithm>
#include <cmath>

#include "core/counted.h"

namespace skein {
namespace {

using nlohmann::json;

// In a summary, which goes into one datagram.
constexpr size_t kNamedPhotos = 3;

const char* StageName(int8_t state) {
  switch (state) {
    case finish_t::REQUESTED:
      return "matching";
    case finish_t::DRAINED:
      return "consolidation and merging";
    default:
      return "final adjustment";
  }
}

bool IsMatchedInTime(const PhotoState& photo, const FinishState& finish) {
  return photo.matches_seq > 0 && photo.matches_seq < finish.cut_seq;
}

bool HasWordOfSubmap(const SessionState& session, int64_t image_id) {
  const auto& submaps = session.submaps();
  return std::any_of(submaps.begin(), submaps.end(), [&](const auto& entry) {
    return !entry.second.ended && entry.second.photos.count(image_id) > 0;
  });
}

// "" if nothing was.
std::string LeftOutOf(const SubmapLife& submap, const FinishState& finish) {
  if (!submap.latest_model) return "no model yet";
  const submap_model_t& model = *submap.latest_model;
  const bool is_final = finish.settled_seq > 0 && submap.final_ledger_seq >= finish.settled_seq;
  if (!is_final) {
    return "its mapper did not answer in time: an earlier model, " +
           std::to_string(model.num_images) + " of " + std::to_string(submap.num_registered) +
           " photos";
  }
  if (finish.cut_at == finish_t::SETTLED && model.header.seq < finish.cut_seq) return "";
  return finish.cut_at == finish_t::SETTLED ? "final adjustment not completed"
                                            : "consolidation and final adjustment not completed";
}

json PhotoNames(const SessionState& session, const std::vector<int64_t>& image_ids) {
  json names = json::array();
  for (const int64_t id : image_ids) names.push_back(session.NameOf(id));
  return names;
}

// "; 5 photos not matched in time (a/1.jpg, a/2.jpg, ...)", "" for none.
std::string PhotosText(const SessionState& session, const std::vector<int64_t>& image_ids,
                       const std::string& what) {
  if (image_ids.empty()) return "";
  std::string names;
  for (size_t i = 0; i < std::min(kNamedPhotos, image_ids.size()); ++i) {
    names += (i > 0 ? ", " : "") + session.NameOf(image_ids[i]);
  }
  if (image_ids.size() > kNamedPhotos) names += ", ...";
  return "; " + Counted(image_ids.size(), "photo") + " " + what + " (" + names + ")";
}

}  // namespace

FinishCut FindCut(const SessionState& session) {
  const FinishState& finish = session.finish();
  FinishCut cut;
  cut.after_s = static_cast<double>(finish.cut_utime_us - finish.requested_utime_us) * 1e-6;
  cut.during = StageName(finish.cut_at);
  for (const auto& [id, photo] : session.photos()) {
    if (photo.failed()) continue;
    if (!IsMatchedInTime(photo, finish)) {
      cut.not_matched.push_back(id);
    } else if (!session.covisibility().EdgesOf(id).empty() && !HasWordOfSubmap(session, id)) {
      cut.not_tried.push_back(id);
    }
  }
  for (const auto& [id, submap] : session.submaps()) {
    if (submap.ended) continue;
    const std::string left_out = LeftOutOf(submap, finish);
    if (!left_out.empty()) cut.submaps.push_back({id, left_out});
  }
  return cut;
}

json CutPart(const SessionState& session, const FinishCut& cut) {
  json submaps = json::array();
  for (const FinishCut::Submap& submap : cut.submaps) {
    submaps.push_back({{"id", submap.submap_id}, {"left_out", submap.left_out}});
  }
  return {{"after_s", cut.after_s},
          {"during", cut.during},
          {"not_matched", PhotoNames(session, cut.not_matched)},
          {"not_tried", PhotoNames(session, cut.not_tried)},
          {"submaps", std::move(submaps)}};
}

std::string CutSummary(const SessionState& session, const FinishCut& cut) {
  std::string text = "cut after " + std::to_string(std::lround(cut.after_s)) + " s, during " +
                     cut.during + PhotosText(session, cut.not_matched, "not matched in time") +
                     PhotosText(session, cut.not_tried, "not tried in time");
  for (const FinishCut::Submap& submap : cut.submaps) {
    text += "; map " + std::to_string(submap.submap_id) + ": " + submap.left_out;
  }
  return text;
}

}  // namespace skein
