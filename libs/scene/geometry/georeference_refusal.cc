#include "geometry/georeference_refusal.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "core/angles.h"
#include "core/statistics.h"

namespace skein {
namespace {

using Photos = std::vector<const GeoPhoto*>;

// Per axis. Phones have about 15 m (docs/measurements.md), and a few times that among houses.
constexpr double kMaxReceiverSigmaM = 50;

std::string Metres(double metres) {
  char text[40];
  const bool is_far = metres >= 1000;
  std::snprintf(text, sizeof(text), is_far ? "%.3g km" : "%.3g m", metres / (is_far ? 1000 : 1));
  return text;
}

// "alice" of "alice/1.jpg"; "" without a folder.
std::string AgentOf(const GeoPhoto& photo) {
  const size_t slash = photo.name.find('/');
  return slash == std::string::npos ? "" : photo.name.substr(0, slash);
}

size_t NumPlaces(const Photos& photos) {
  std::set<std::pair<double, double>> places;
  for (const GeoPhoto* photo : photos) {
    places.emplace(photo->position.latitude_deg, photo->position.longitude_deg);
  }
  return places.size();
}

std::string FewPlaces(size_t num_places, size_t num_photos) {
  const std::string photos = std::to_string(num_photos) + " photos carry ";
  return (num_places == 1
              ? "all " + photos + "one GPS position"
              : photos + "only " + std::to_string(num_places) + " different GPS positions") +
         ", as when a device keeps that of the start; each photo needs the position where it was "
         "taken";
}

// The map as the photos of one agent place it.
class Reference {
 public:
  Reference(std::string agent, Georeference fit, const Photos& own)
      : agent_(std::move(agent)), fit_(std::move(fit)) {
    for (const GeoPhoto* photo : own) centre_m_ += CentreM(*photo) / own.size();
  }

  const std::string& agent() const { return agent_; }
  double scale_sigma() const { return fit_.scale_sigma; }

  double MedianOffsetM(const Photos& photos) const {
    std::vector<double> offsets;
    for (const GeoPhoto* photo : photos) offsets.push_back(OffsetM(*photo));
    return UpperMedian(offsets);
  }

  bool Agrees(const Photos& photos) const {
    std::vector<double> sigmas;
    for (const GeoPhoto* photo : photos) sigmas.push_back(OffsetM(*photo) / SigmaM(*photo));
    return UpperMedian(sigmas) <= kInlierSigmas[1];
  }

 private:
  Eigen::Vector3d CentreM(const GeoPhoto& photo) const {
    return fit_.enu_from_model.Apply(photo.cam_from_world.Centre());
  }

  double OffsetM(const GeoPhoto& photo) const {
    const Eigen::Vector3d offset = CentreM(photo) - EnuFromGeodetic(fit_.origin, photo.position);
    const bool in_space = fit_.altitudes_used && photo.position.altitude_m;
    return in_space ? offset.norm() : offset.head<2>().norm();
  }

  // Sigma of a position and the fit together. The fit's errors of scale and rotation grow with the
  // distance.
  double SigmaM(const GeoPhoto& photo) const {
    const double relative = fit_.scale_sigma + DegToRad(fit_.rotation_sigma_deg);
    return fit_.sigma_m + relative * (CentreM(photo) - centre_m_).norm();
  }

  const std::string agent_;
  const Georeference fit_;
  Eigen::Vector3d centre_m_ = Eigen::Vector3d::Zero();  // of its own photos
};

using Agents = std::map<std::string, Photos>;

struct Disagreement {
  std::string agent;  // "": all agree
  double median_m = 0;
};

Disagreement LargestDisagreement(const Reference& reference, const Agents& agents) {
  Disagreement largest;
  for (const auto& [agent, photos] : agents) {
    const double median_m = reference.MedianOffsetM(photos);
    if (median_m > largest.median_m && !reference.Agrees(photos)) largest = {agent, median_m};
  }
  return largest;
}

// Null if no agent's photos place the map.
std::unique_ptr<Reference> BestReference(const GeodeticPosition& origin, const Agents& agents,
                                         GeoreferenceOf estimate) {
  std::unique_ptr<Reference> best;
  std::pair<std::ptrdiff_t, double> best_score;
  for (const auto& [agent, photos] : agents) {
    const Georeference fit = estimate(origin, photos);
    if (!fit.ok) continue;
    auto reference = std::make_unique<Reference>(agent, fit, photos);
    const auto num_agreeing = std::count_if(agents.begin(), agents.end(), [&](const auto& other) {
      return reference->Agrees(other.second);
    });
    const std::pair score(num_agreeing, -reference->scale_sigma());
    if (best && score <= best_score) continue;
    best = std::move(reference);
    best_score = score;
  }
  return best;
}

// "" if no two agents disagree.
std::string DisagreeingAgent(const GeodeticPosition& origin, const Photos& photos,
                             GeoreferenceOf estimate) {
  Agents agents;
  for (const GeoPhoto* photo : photos) agents[AgentOf(*photo)].push_back(photo);
  if (agents.size() < 2) return "";
  const auto reference = BestReference(origin, agents, estimate);
  if (!reference) return "";
  const Disagreement found = LargestDisagreement(*reference, agents);
  if (found.agent.empty()) return "";
  return "the GPS positions of " + found.agent + " are " + Metres(found.median_m) +
         " (median) off where those of " + reference->agent() +
         " place its photos; check clock, units and order of coordinates of both, and reconstruct "
         "without the wrong GPS";
}

}  // namespace

std::string CauseOfRefusal(const Georeference& refused, const Photos& photos,
                           GeoreferenceOf estimate) {
  const size_t num_places = NumPlaces(photos);
  if (num_places < kMinPositions) return FewPlaces(num_places, photos.size());
  const std::string agent = DisagreeingAgent(refused.origin, photos, estimate);
  if (!agent.empty()) return agent;
  if (refused.sigma_m <= kMaxReceiverSigmaM) return refused.reason;
  return "the GPS positions disagree with the map by " + Metres(refused.sigma_m) +
         "; check the camera's clock, units and order of coordinates";
}

}  // namespace skein
