#include "guidance/weak_places.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

namespace skein {

double UtilityOf(double target_gsd, const SurfelQuality& quality) {
  constexpr double kOfFirstTwo = 0.2;
  if (quality.good) return 1;
  const double pairs = std::min(1.0, quality.reconstructability / kMinReconstructability) *
                       std::min(1.0, kMaxSigmaGsd * target_gsd / quality.sigma) *
                       std::min(1.0, target_gsd / quality.best_gsd);
  return kOfFirstTwo * std::min(quality.num_photos, 2) / 2 + (1 - kOfFirstTwo) * 0.95 * pairs;
}

double UtilityOfBorder(size_t num_photos) {
  return 0.35 * static_cast<double>(std::min<size_t>(num_photos, 2));
}

bool Shows(const Eigen::Vector3d& centre, const Weak& weak) {
  const Eigen::Vector3d ray = centre - weak.position;
  return ray.dot(weak.normal) > weak.min_cos * ray.norm();
}

std::vector<Weak> FindWeak(const PlaceQuality& place) {
  std::vector<Weak> weak;
  for (const Piece& piece : place.pieces) {
    const SurfelQuality& quality = piece.quality;
    if (!quality.counts || quality.good || !HasTexture(quality)) continue;
    const Surfel& surfel = piece.surfel;
    if (surfel.is_ground) continue;
    weak.push_back({surfel.position, surfel.normal, piece.area, false, 0, &surfel,
                    UtilityOf(place.completeness.target_gsd, quality)});
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

std::vector<Cluster> ClusterWeak(const std::vector<Weak>& weak, double width) {
  std::map<std::tuple<long, long, long, int>, Cluster> clusters;
  for (uint32_t i = 0; i < weak.size(); ++i) {
    const Eigen::Vector3d cell = weak[i].position / width;
    Eigen::Index axis = 0;
    weak[i].normal.cwiseAbs().maxCoeff(&axis);
    const int side = static_cast<int>(axis) * 2 + (weak[i].normal[axis] > 0);
    Cluster& cluster =
        clusters[{std::lround(cell.x()), std::lround(cell.y()), std::lround(cell.z()), side}];
    cluster.position += weak[i].area * weak[i].position;
    cluster.normal += weak[i].area * weak[i].normal;
    cluster.members.push_back(i);
  }
  std::vector<Cluster> all;
  for (auto& [key, cluster] : clusters) {
    double area = 0;
    for (const uint32_t i : cluster.members) area += weak[i].area;
    cluster.position /= area;
    cluster.normal.normalize();
    all.push_back(std::move(cluster));
  }
  return all;
}

std::vector<WeakCluster> FindWeakest(const std::vector<Weak>& weak,
                                     const std::vector<Cluster>& clusters, size_t max_num) {
  constexpr size_t kMaxWeakest = 6;
  std::vector<WeakCluster> weakest;
  for (const Cluster& cluster : clusters) {
    double missing = 0;
    for (const uint32_t i : cluster.members) missing += Missing(weak[i]);
    if (missing > 0) weakest.push_back({&cluster, missing, {}});
  }
  std::sort(weakest.begin(), weakest.end(),
            [](const WeakCluster& a, const WeakCluster& b) { return a.missing > b.missing; });
  if (weakest.size() > max_num) weakest.resize(max_num);
  for (WeakCluster& one : weakest) {
    one.weakest.resize(std::min(kMaxWeakest, one.cluster->members.size()));
    std::partial_sort_copy(one.cluster->members.begin(), one.cluster->members.end(),
                           one.weakest.begin(), one.weakest.end(), [&](uint32_t a, uint32_t b) {
                             return std::pair(-Missing(weak[a]), a) <
                                    std::pair(-Missing(weak[b]), b);
                           });
  }
  return weakest;
}

}  // namespace skein
