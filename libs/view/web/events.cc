#include "web/events.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "session/diagnosis.h"
#include "session/state_names.h"

namespace skein {
namespace {

using nlohmann::json;

constexpr int kPoseDigits = 7, kFigureDigits = 4, kGpsDigits = 10;

double Figure(double value) { return Rounded(value, kFigureDigits); }

json Pose(const double* qwxyz, const double* xyz) {
  json pose = json::array();
  for (int i = 0; i < 4; ++i) pose.push_back(Rounded(qwxyz[i], kPoseDigits));
  for (int i = 0; i < 3; ++i) pose.push_back(Rounded(xyz[i], kPoseDigits));
  return pose;
}

json Begin(const fact_header_t& header, const char* kind) {
  return {{"seq", header.seq}, {"t", header.utime_us}, {"kind", kind}};
}

const char* StateOf(const registration_t& fact) {
  switch (fact.state) {
    case registration_t::REGISTERED:
      return "registered";
    case registration_t::DEFERRED:
      return "deferred";
    case registration_t::REJECTED:
      return "rejected";
    default:
      return "withdrawn";
  }
}

json Submap(const fact_header_t& header, int64_t submap_id, const char* state) {
  json event = Begin(header, "submap");
  event.update({{"submap", submap_id},
                {"state", state},
                {"photos", 0},
                {"points", 0},
                {"reason", ""},
                {"merged_into", 0},
                {"error_px", 0}});
  return event;
}

struct EventMaker {
  json operator()(const image_t& fact) const {
    json event = Begin(fact.header, "photo");
    event.update({{"image", fact.image_id},
                  {"agent", fact.agent},
                  {"name", fact.name},
                  {"camera", fact.camera_id},
                  {"width", fact.width_px},
                  {"height", fact.height_px},
                  {"orientation", fact.orientation},
                  {"bytes", fact.size_bytes},
                  {"focal", Figure(fact.focal_px)},
                  {"captured", fact.capture_utime_us},
                  {"received", fact.received_utime_us}});
    if (fact.has_gps) {
      event["gps"] = {Rounded(fact.latitude_deg, kGpsDigits),
                      Rounded(fact.longitude_deg, kGpsDigits)};
      if (fact.has_altitude) event["gps"].push_back(Rounded(fact.altitude_m, kPoseDigits));
    }
    return event;
  }

  json operator()(const features_t& fact) const {
    json event = Begin(fact.header, "described");
    event.update({{"image", fact.image_id},
                  {"keypoints", fact.num_keypoints},
                  {"s", Figure(fact.local_s + fact.global_s)}});
    return event;
  }

  json operator()(const candidates_t& fact) const {
    json event = Begin(fact.header, "candidates");
    event.update({{"image", fact.image_id}, {"count", fact.num_candidates}});
    return event;
  }

  json operator()(const matches_t& fact) const {
    json event = Begin(fact.header, "matched");
    json pairs = json::array();
    for (const two_view_t& pair : fact.pairs) pairs.push_back({pair.other_id, pair.num_inliers});
    event.update({{"image", fact.image_id},
                  {"pairs", std::move(pairs)},
                  {"s", Figure(fact.match_s + fact.verify_s)}});
    return event;
  }

  json operator()(const registration_t& fact) const {
    json event = Begin(fact.header, "registration");
    event.update({{"image", fact.image_id},
                  {"submap", fact.submap_id},
                  {"state", StateOf(fact)},
                  {"reason", fact.reason},
                  {"inliers", fact.num_inliers},
                  {"visible", fact.num_visible},
                  {"error_px", Figure(fact.mean_reprojection_error_px)},
                  {"s", Figure(fact.total_s)}});
    if (fact.state == registration_t::REGISTERED) {
      event["pose"] = Pose(fact.cam_from_world_qwxyz, fact.cam_from_world_xyz);
    } else {
      event["cause"] = TrialCauseName(fact.cause);
    }
    return event;
  }

  json operator()(const seed_t& fact) const {
    return Submap(fact.header, fact.submap_id, "seeded");
  }

  json operator()(const submap_model_t& fact) const {
    const bool final = fact.kind == submap_model_t::FINAL;
    json event = Submap(fact.header, fact.submap_id, final ? "final" : "checkpoint");
    event.update({{"photos", fact.num_images},
                  {"points", fact.num_points},
                  {"error_px", Figure(fact.mean_reprojection_error_px)}});
    if (fact.check.position_sigma > 0) {
      event["expected_error_percent"] = Figure(100 * fact.check.position_sigma);
    }
    return event;
  }

  json operator()(const submap_end_t& fact) const {
    json event = Submap(fact.header, fact.submap_id, "ended");
    event.update({{"reason", fact.reason}, {"merged_into", fact.merged_into}});
    return event;
  }

  // The merge's id is the seq of its order.
  json operator()(const merge_t& fact) const {
    const bool has_similarity = fact.target_from_source_scale > 0;
    json similarity = json::array({Rounded(fact.target_from_source_scale, kPoseDigits)});
    for (const json& value : Pose(fact.target_from_source_qwxyz, fact.target_from_source_xyz)) {
      similarity.push_back(value);
    }
    json event = Begin(fact.header, "merge");
    event.update({{"merge", fact.merge_id},
                  {"state", MergeStateName(fact.state)},
                  {"source", fact.source_id},
                  {"target", fact.target_id},
                  {"reason", fact.reason},
                  {"s", Figure(fact.duration_s)}});
    if (has_similarity) event["similarity"] = std::move(similarity);
    return event;
  }

  json operator()(const failure_t& fact) const {
    json event = Begin(fact.header, "failure");
    event.update({{"image", fact.image_id},
                  {"agent", fact.agent},
                  {"name", fact.name},
                  {"stage", fact.stage},
                  {"cause", FailureCauseName(fact.cause)},
                  {"reason", fact.reason},
                  {"parked", fact.parked != 0}});
    return event;
  }

  json operator()(const finish_t& fact) const {
    json event = Begin(fact.header, "finish");
    event.update({{"finish", fact.finish_id}, {"state", FinishStateName(fact.state)}});
    if (fact.state == finish_t::REQUESTED || fact.state == finish_t::DEADLINE) {
      event["deadline"] = fact.deadline_utime_us;
    }
    return event;
  }

  json operator()(const submap_lease_t&) const { return nullptr; }
  json operator()(const configuration_t&) const { return nullptr; }
};

}  // namespace

double Rounded(double value, int digits) {
  if (!std::isfinite(value)) return 0;
  char text[32];
  std::snprintf(text, sizeof(text), "%.*g", digits, value);
  return std::strtod(text, nullptr);
}

std::string EventOf(const Fact& fact) {
  const json event = std::visit(EventMaker(), fact);
  if (event.is_null()) return "";
  return event.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace skein
