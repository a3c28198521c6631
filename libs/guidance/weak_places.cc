#include "guidance/weak_places.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace skein {

double UtilityOf(const QualityOptions& options, const SurfelQuality& quality) {
  constexpr double kOfFirstTwo = 0.2;
  if (quality.good) return 1;
  const double pairs = std::min(1.0, quality.reconstructability / options.min_reconstructability) *
                       std::min(1.0, options.max_sigma_gsd * options.target_gsd / quality.sigma) *
                       std::min(1.0, options.target_gsd / quality.best_gsd);
  return kOfFirstTwo * std::min(quality.num_photos, 2) / 2 + (1 - kOfFirstTwo) * 0.95 * pairs;
}

double UtilityOfBorder(size_t num_photos) {
  return 0.35 * static_cast<double>(std::min<size_t>(num_photos, 2));
}

bool Shows(const Eigen::Vector3d& centre, const Weak& weak) {
  const Eigen::Vector3d ray = centre - weak.position;
  return ray.dot(weak.normal) > weak.min_cos * ray.norm();
}

std::vector<Weak> FindWeak(const QualityOptions& options, const PlaceQuality& place) {
  std::vector<Weak> weak;
  for (const Piece& piece : place.pieces) {
    const SurfelQuality& quality = piece.quality;
    if (!quality.counts || quality.good || !HasTexture(options, quality)) continue;
    const Surfel& surfel = piece.surfel;
    if (surfel.is_ground) continue;
    weak.push_back({surfel.position, surfel.normal, piece.area, false, 0, &surfel,
                    UtilityOf(options, quality)});
  }
  for (size_t i = 0; i < place.surfels.size(); ++i) {
    const Surfel& surfel = place.surface.surfels[i];
    if (place.Counts(i) && surfel.open_border) {
      // What lies beyond is as wide as the gap to it.
      weak.push_back({surfel.beyond, surfel.beyond_normal, 2 * surfel.area, true,
                      std::cos(surfel.beyond_max_deg * kRadian)});
    }
  }
  return weak;
}

std::vector<uint32_t> NumberClusters(const std::vector<Weak>& weak, double width) {
  std::map<std::tuple<long, long, long, int>, std::vector<uint32_t>> members;
  for (uint32_t i = 0; i < weak.size(); ++i) {
    const Eigen::Vector3d cell = weak[i].position / width;
    Eigen::Index axis = 0;
    weak[i].normal.cwiseAbs().maxCoeff(&axis);
    const int side = static_cast<int>(axis) * 2 + (weak[i].normal[axis] > 0);
    members[{std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z()), side}].push_back(
        i);
  }
  std::vector<uint32_t> cluster_of(weak.size());
  uint32_t number = 0;
  for (const auto& [key, places] : members) {
    for (const uint32_t place : places) cluster_of[place] = number;
    ++number;
  }
  return cluster_of;
}

std::vector<Cluster> ClusterWeak(const std::vector<Weak>& weak,
                                 const std::vector<uint32_t>& cluster_of, size_t max_num) {
  constexpr size_t kMaxMembers = 6;
  std::vector<Cluster> clusters;
  for (size_t i = 0; i < weak.size(); ++i) {
    if (cluster_of[i] >= clusters.size()) clusters.resize(cluster_of[i] + 1);
    Cluster& cluster = clusters[cluster_of[i]];
    const double missing = Missing(weak[i]);
    cluster.position += missing * weak[i].position;
    cluster.normal += missing * weak[i].normal;
    cluster.weight += missing;
    cluster.members.push_back(i);
  }
  std::vector<Cluster> sorted;
  for (Cluster& cluster : clusters) {
    if (cluster.weight > 0) sorted.push_back(std::move(cluster));
  }
  std::sort(sorted.begin(), sorted.end(),
            [](const Cluster& a, const Cluster& b) { return a.weight > b.weight; });
  if (sorted.size() > max_num) sorted.resize(max_num);
  for (Cluster& cluster : sorted) {
    cluster.position /= cluster.weight;
    cluster.normal.normalize();
    auto& members = cluster.members;
    const size_t kept = std::min(kMaxMembers, members.size());
    std::partial_sort(members.begin(), members.begin() + static_cast<ptrdiff_t>(kept),
                      members.end(), [&](size_t a, size_t b) {
                        return std::pair(-Missing(weak[a]), a) < std::pair(-Missing(weak[b]), b);
                      });
    members.resize(kept);
  }
  return sorted;
}

}  // namespace skein
