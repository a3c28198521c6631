#include "depth/depth_regions.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "depth/inverse_planes.h"
#include "depth/padded_rows.h"
#include "depth/sweep_kernels.h"

namespace skein {
namespace {

constexpr double kMarginPx = 6;        // of the search, at each end of a region's planes
constexpr double kLeastSearchPx = 31;  // of a region's planes, at least
constexpr double kOffRegion = 0.01;    // part of a region's coarse depths, at each end
constexpr double kMinKnown = 0.1;      // part of a region's coarse pixels that have a depth
// The planes of a region: pixels of the search by which a depth may be off one, the part of the
// depths that lie on the first and on each next one, and the triples that are tried.
constexpr double kOnPlanePx = 1.5;
constexpr double kMinOnFirst = 0.25, kMinOnNext = 0.1;
constexpr int kTriples = 50;

cv::Rect InCoarse(const cv::Rect& area, cv::Size photo, cv::Size coarse) {
  const double x = static_cast<double>(coarse.width) / photo.width;
  const double y = static_cast<double>(coarse.height) / photo.height;
  const cv::Point first(static_cast<int>(area.x * x) - 1, static_cast<int>(area.y * y) - 1);
  const cv::Point last(static_cast<int>(area.br().x * x) + 2,
                       static_cast<int>(area.br().y * y) + 2);
  return cv::Rect(first, last) & cv::Rect(cv::Point(), coarse);
}

class Quadtree {
 public:
  Quadtree(const DepthPhoto& photo, const DepthMap& coarse, const SweepPlanes& whole,
           double most_steps, const RegionSearch& search_px)
      : photo_(photo),
        coarse_(coarse),
        whole_(whole),
        most_steps_(most_steps),
        search_px_(search_px) {}

  void Add(const cv::Rect& area) {
    const DepthRegion region{area, PlanesOf(area)};
    const bool is_small = std::min(area.width, area.height) < 2 * kMinRegionPx;
    if (is_small || StepsOf(region) <= most_steps_) return regions_.push_back(region);
    const cv::Point middle = (area.tl() + area.br()) / 2;
    for (const cv::Point corner :
         {area.tl(), cv::Point(area.br().x, area.y), cv::Point(area.x, area.br().y), area.br()}) {
      Add(cv::Rect(corner, middle));
    }
  }

  std::vector<DepthRegion> Take() { return std::move(regions_); }

 private:
  // They have one slope, or several if that makes hardly more planes.
  std::vector<SweepPlanes> PlanesOf(const cv::Rect& area) const {
    const cv::Rect there = InCoarse(area, photo_.grey.size(), coarse_.depth.size());
    const std::vector<InverseDepth> depths = DepthsIn(there);
    const double search = search_px_(area, whole_);
    const bool is_known = static_cast<double>(depths.size()) > kMinKnown * there.area();
    if (!is_known || search < kLeastSearchPx) return {whole_};
    const double px = (whole_.last - whole_.first) / search;
    const FoundPlanes found =
        FindPlanes(depths, {kOnPlanePx * px, kMinOnFirst, kMinOnNext, kTriples});
    const DepthRegion one{area, {OneFamily(area, depths, found, px)}};
    if (found.planes.size() < 2) return one.families;
    const DepthRegion several{area, Families(area, found, px)};
    return StepsOf(several) <= StepsOf(one) + kSweepLanes ? several.families : one.families;
  }

  SweepPlanes OneFamily(const cv::Rect& area, const std::vector<InverseDepth>& depths,
                        const FoundPlanes& found, double px) const {
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    return FamilyOf(area, found.planes.empty() ? none : found.planes[0].plane, depths, px);
  }

  // One of each plane; the first one has what lies on none, too.
  std::vector<SweepPlanes> Families(const cv::Rect& area, const FoundPlanes& found,
                                    double px) const {
    std::vector<SweepPlanes> families;
    for (const FoundPlane& one : found.planes) {
      std::vector<InverseDepth> depths = one.on;
      if (families.empty()) depths.insert(depths.end(), found.left.begin(), found.left.end());
      families.push_back(FamilyOf(area, one.plane, depths, px));
    }
    return families;
  }

  SweepPlanes FamilyOf(const cv::Rect& area, const Eigen::Vector3d& plane,
                       const std::vector<InverseDepth>& depths, double px) const {
    SweepPlanes family;
    family.centre = photo_.camera.Ray({area.x + area.width / 2.0, area.y + area.height / 2.0});
    family.slope = plane.head<2>();
    SetEnds(depths, px, &family);
    return family;
  }

  double StepsOf(const DepthRegion& region) const {
    double sum = 0;
    for (const SweepPlanes& planes : region.families) {
      sum += RoundUp(static_cast<int>(search_px_(region.area, planes)) + 1, kSweepLanes);
    }
    return sum;
  }

  std::vector<InverseDepth> DepthsIn(const cv::Rect& there) const {
    std::vector<InverseDepth> depths;
    for (int y = there.y; y < there.br().y; ++y) {
      for (int x = there.x; x < there.br().x; ++x) {
        const float depth = coarse_.depth(y, x);
        if (depth > 0) depths.push_back({coarse_.camera.Ray({x + 0.5, y + 0.5}), 1 / depth});
      }
    }
    return depths;
  }

  // px: inverse depth of a pixel of the search.
  static void SetEnds(const std::vector<InverseDepth>& depths, double px, SweepPlanes* planes) {
    std::vector<double> at_centre;
    for (const InverseDepth& depth : depths) {
      at_centre.push_back(depth.inverse - planes->InverseDepth(depth.ray, 0));
    }
    std::sort(at_centre.begin(), at_centre.end());
    const auto outliers = static_cast<size_t>(kOffRegion * static_cast<double>(depths.size()));
    const double low = at_centre[outliers], high = at_centre[at_centre.size() - 1 - outliers];
    const double margin = std::max(kMarginPx * px, (kLeastSearchPx * px - (high - low)) / 2);
    planes->first = low - margin;
    planes->last = high + margin;
  }

  const DepthPhoto& photo_;
  const DepthMap& coarse_;
  const SweepPlanes& whole_;
  const double most_steps_;
  const RegionSearch& search_px_;
  std::vector<DepthRegion> regions_;
};

}  // namespace

DepthPhoto Halved(const DepthPhoto& photo) {
  DepthPhoto half{{}, {}, photo.camera, photo.cam_from_world};
  DepthCamera& camera = half.camera;
  camera.width = (photo.camera.width + 1) / 2;
  camera.height = (photo.camera.height + 1) / 2;
  const Eigen::Vector2d scale(static_cast<double>(camera.width) / photo.camera.width,
                              static_cast<double>(camera.height) / photo.camera.height);
  camera.focal_px = camera.focal_px.cwiseProduct(scale);
  camera.principal_point_px = camera.principal_point_px.cwiseProduct(scale);
  const cv::Size size(camera.width, camera.height);
  cv::resize(photo.grey, half.grey, size, 0, 0, cv::INTER_AREA);
  if (photo.valid.empty()) return half;
  cv::resize(photo.valid, half.valid, size, 0, 0, cv::INTER_AREA);
  half.valid = half.valid == 255;
  return half;
}

DepthPhoto Cropped(const DepthPhoto& photo, const cv::Rect& area) {
  DepthPhoto part{photo.grey(area), photo.valid.empty() ? cv::Mat1b() : photo.valid(area),
                  photo.camera, photo.cam_from_world};
  part.camera.width = area.width;
  part.camera.height = area.height;
  part.camera.principal_point_px -= Eigen::Vector2d(area.x, area.y);
  return part;
}

std::vector<DepthRegion> RegionsOf(const DepthPhoto& photo, const DepthMap& coarse,
                                   const SweepPlanes& whole, double most_steps,
                                   const RegionSearch& search_px) {
  Quadtree tree(photo, coarse, whole, most_steps, search_px);
  tree.Add(cv::Rect(cv::Point(), photo.grey.size()));
  return tree.Take();
}

}  // namespace skein
