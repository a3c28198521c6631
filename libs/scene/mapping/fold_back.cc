#include "mapping/fold_back.h"

#include <map>
#include <unordered_map>
#include <utility>

#include "core/statistics.h"
#include "map/bundle_builder.h"

namespace skein {
namespace {

// X_new = R X + t, scaled: from the map as it is to the map after folding back.
struct LocalSimilarity {
  double scale = 1;
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t = Eigen::Vector3d::Zero();
  Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return scale * (R * x) + t; }
};

class Folder {
 public:
  Folder(const Bundle& refined, SceneMap* map) : refined_(refined), map_(*map) {}

  std::vector<ImageId> Run() {
    FindDepthRatios();
    for (const BundlePose& pose : refined_.poses) {
      if (!pose.constant && map_.IsRegistered(pose.image_id)) FindSimilarity(pose);
    }
    AttachNewImages();
    for (const BundlePoint& point : refined_.points) in_bundle_[point.point3D_id] = true;
    for (const auto& [id, point] : map_.reconstruction().Points3D()) {
      if (in_bundle_.count(id) == 0) new_points_.push_back(id);
    }
    MoveNew();
    ApplyBundle(refined_, &map_);
    return new_images_;
  }

 private:
  // For each image of the bundle the change of its points' depths from the map to the refinement.
  void FindDepthRatios() {
    std::unordered_map<int, BundlePose> now;
    for (size_t i = 0; i < refined_.poses.size(); ++i) {
      const ImageId id = refined_.poses[i].image_id;
      if (map_.IsRegistered(id)) GetPose(map_.reconstruction().Image(id), &now[i]);
    }
    for (const BundlePoint& point : refined_.points) {
      if (!map_.reconstruction().ExistsPoint3D(point.point3D_id)) continue;
      const Eigen::Vector3d& xyz = map_.reconstruction().Point3D(point.point3D_id).XYZ();
      for (int i = point.first; i < point.first + point.count; ++i) {
        const int pose = refined_.observations[i].pose;
        const auto it = now.find(pose);
        if (it == now.end()) continue;
        const BundlePose& refined = refined_.poses[pose];
        const double depth = it->second.R.row(2).dot(xyz) + it->second.t.z();
        const double depth_after = refined.R.row(2).dot(point.xyz) + refined.t.z();
        if (depth > 0 && depth_after > 0) ratios_[refined.image_id].push_back(depth_after / depth);
      }
    }
  }

  void FindSimilarity(const BundlePose& after) {
    BundlePose now;
    GetPose(map_.reconstruction().Image(after.image_id), &now);
    LocalSimilarity similarity;
    std::vector<double>& ratios = ratios_[after.image_id];
    if (!ratios.empty()) {
      similarity.scale = UpperMedian(std::move(ratios));
    }
    similarity.R = after.R.transpose() * now.R;
    similarity.t = after.R.transpose() * (similarity.scale * now.t - after.t);
    similarities_[after.image_id] = similarity;
  }

  // In the order of registration, so that a new image may hang on an earlier new one.
  void AttachNewImages() {
    for (const ImageId id : map_.reconstruction().RegImageIds()) {
      if (similarities_.count(id) > 0) continue;
      new_images_.push_back(id);
      const ImageId anchor = FindAnchor(id);
      if (anchor != kInvalidImageId) similarities_[id] = similarities_.at(anchor);
    }
  }

  ImageId FindAnchor(ImageId id) const {
    std::map<ImageId, int> counts;
    for (const Point2D& point2D : map_.reconstruction().Image(id).Points2D()) {
      if (!point2D.HasPoint3D()) continue;
      const Point3D& point = map_.reconstruction().Point3D(point2D.Point3DId());
      for (const auto& element : point.Track().Elements()) {
        if (element.image_id != id && similarities_.count(element.image_id) > 0) {
          ++counts[element.image_id];
        }
      }
    }
    ImageId best = kInvalidImageId;
    for (const auto& [other, count] : counts) {
      if (best == kInvalidImageId || count > counts.at(best)) best = other;
    }
    return best;
  }

  void MoveNew() {
    for (const Point3DId id : new_points_) {
      const Point3D& point = map_.reconstruction().Point3D(id);
      for (const auto& element : point.Track().Elements()) {
        const auto it = similarities_.find(element.image_id);
        if (it == similarities_.end()) continue;
        map_.SetPoint(id, it->second(point.XYZ()));
        break;
      }
    }
    for (const ImageId id : new_images_) {
      const auto it = similarities_.find(id);
      if (it == similarities_.end()) continue;
      BundlePose pose;
      GetPose(map_.reconstruction().Image(id), &pose);
      const Eigen::Vector3d center = it->second(-(pose.R.transpose() * pose.t));
      pose.R = pose.R * it->second.R.transpose();
      pose.t = -(pose.R * center);
      map_.SetPose(pose);
    }
  }

  const Bundle& refined_;
  SceneMap& map_;
  std::unordered_map<ImageId, std::vector<double>> ratios_;
  std::unordered_map<ImageId, LocalSimilarity> similarities_;
  std::unordered_map<Point3DId, bool> in_bundle_;
  std::vector<Point3DId> new_points_;
  std::vector<ImageId> new_images_;
};

}  // namespace

std::vector<ImageId> FoldBack(const Bundle& refined, SceneMap* map) {
  return Folder(refined, map).Run();
}

}  // namespace skein
