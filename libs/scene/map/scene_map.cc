#include "map/scene_map.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <stdexcept>
#include <unordered_set>

#include "map/image_pose.h"
#include "sfm/camera.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

// COLMAP's Database::kMaxNumImages: pair ids are made of two image ids.
constexpr int64_t kMaxImageId = 2147483646;
constexpr int kMaxSize = 1 << 20;

bool IsValidId(int64_t id) { return id >= 1 && id <= kMaxImageId; }

void SortByKeypoint(FeatureMatches* matches) {
  std::sort(matches->begin(), matches->end(),
            [](const auto& a, const auto& b) { return a.point2D_idx1 < b.point2D_idx1; });
}

Eigen::Matrix3Xd Columns(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Matrix3Xd columns(3, points.size());
  for (size_t i = 0; i < points.size(); ++i) columns.col(i) = points[i];
  return columns;
}

// With new ids, in the order of the old ones.
void AddPoints(const Reconstruction& from, Reconstruction* to) {
  for (const Point3DId id : AscendingPoints(from)) {
    const Point3D& point = from.Point3D(id);
    const Point3DId added = to->AddPoint3D(point.XYZ(), point.Track(), point.Color());
    to->Point3D(added).SetError(point.Error());
  }
}

}  // namespace

SceneMap::SceneMap(const std::string& camera_model)
    : reconstruction_(std::make_unique<Reconstruction>()),
      graph_(std::make_unique<CorrespondenceGraph>()),
      triangulator_(std::make_unique<Triangulator>(graph_.get(), reconstruction_.get())) {
  if (!ExistsCameraModel(camera_model)) {
    throw std::invalid_argument("unknown camera model " + camera_model);
  }
  camera_model_id_ = CameraModelId(camera_model);
}

Status SceneMap::CheckPhoto(const PhotoInput& photo) const {
  if (!IsValidId(photo.image_id)) return InvalidArgument("image id out of range");
  if (!IsValidId(photo.camera_id)) return InvalidArgument("camera id out of range");
  if (HasPhoto(photo.image_id)) return AlreadyExists("image is there already");
  if (photo.width_px < 1 || photo.height_px < 1 || photo.width_px > kMaxSize ||
      photo.height_px > kMaxSize) {
    return InvalidArgument("image size out of range");
  }
  if (!(photo.focal_px > 0) || !std::isfinite(photo.focal_px)) {
    return InvalidArgument("focal length out of range");
  }
  if (const Status camera = CheckCamera(photo); !camera.ok()) return camera;
  for (const Keypoint& keypoint : photo.keypoints) {
    if (!std::isfinite(keypoint.x) || !std::isfinite(keypoint.y)) {
      return InvalidArgument("keypoint is not finite");
    }
  }
  return Status::Ok();
}

Status SceneMap::CheckCamera(const PhotoInput& photo) const {
  if (photo.camera_model.empty()) return Status::Ok();
  if (!ExistsCameraModel(photo.camera_model)) {
    return InvalidArgument("unknown camera model " + photo.camera_model);
  }
  const int model = CameraModelId(photo.camera_model);
  const bool finite = std::all_of(photo.camera_params.begin(), photo.camera_params.end(),
                                  [](double value) { return std::isfinite(value); });
  if (finite && AreParamsOfModel(model, photo.camera_params)) return Status::Ok();
  return InvalidArgument("parameters that are none of camera model " + photo.camera_model);
}

void SceneMap::AddCamera(const PhotoInput& photo) {
  const CameraId id = static_cast<CameraId>(photo.camera_id);
  if (cameras_.count(id) > 0) return;
  Camera camera;
  const bool known = !photo.camera_model.empty();
  const int model = known ? CameraModelId(photo.camera_model) : camera_model_id_;
  camera.InitializeWithId(model, photo.focal_px, photo.width_px, photo.height_px);
  if (known) camera.SetParams(photo.camera_params);
  camera.SetCameraId(id);
  camera.SetPriorFocalLength(photo.focal_from_exif);
  CameraState& state = cameras_[id];
  state.given_model_id = model;
  state.given_params = state.prior_params = camera.Params();
  state.focal_from_exif = photo.focal_from_exif || known;
  state.known = known;
  state.fixed = known && photo.camera_fixed;
  reconstruction_->AddCamera(camera);
}

Status SceneMap::AddPhoto(const PhotoInput& photo) {
  const Status status = CheckPhoto(photo);
  if (!status.ok()) return status;
  AddCamera(photo);
  const ImageId id = static_cast<ImageId>(photo.image_id);
  std::vector<Eigen::Vector2d> points;
  std::vector<std::array<uint8_t, 3>>& colours = colours_[id];
  for (const Keypoint& k : photo.keypoints) {
    points.emplace_back(k.x, k.y);
    colours.push_back({k.r, k.g, k.b});
  }
  Image image;
  image.SetImageId(id);
  image.SetCameraId(static_cast<CameraId>(photo.camera_id));
  image.SetName(photo.name);
  image.SetPoints2D(points);
  reconstruction_->AddImage(std::move(image));
  graph_->AddImage(id, points.size());
  photos_.push_back(id);
  const auto waiting = waiting_.find(id);
  if (waiting == waiting_.end()) return Status::Ok();
  const auto pairs = std::move(waiting->second);
  waiting_.erase(waiting);
  for (const auto& [other, matches] : pairs) Connect(other, id, matches);
  return Status::Ok();
}

std::set<CameraId> SceneMap::FixedCameras() const {
  std::set<CameraId> fixed;
  for (const auto& [id, state] : cameras_) {
    if (state.fixed) fixed.insert(id);
  }
  return fixed;
}

Status SceneMap::CheckPair(ImageId image_id, const TwoViewPair& pair) const {
  if (!IsValidId(pair.other_id) || pair.other_id == image_id) {
    return InvalidArgument("pair with an image id out of range");
  }
  const size_t num_points = reconstruction_->Image(image_id).NumPoints2D();
  for (const auto& [index, other_index] : pair.inliers) {
    if (index >= num_points) return InvalidArgument("pair with a keypoint index out of range");
    (void)other_index;
  }
  return Status::Ok();
}

Status SceneMap::AddPairs(int64_t image_id, const TwoViewPairs& pairs) {
  if (!HasPhoto(image_id)) return NotFound("pairs of an image that is not there");
  const ImageId id = static_cast<ImageId>(image_id);
  for (const TwoViewPair& pair : pairs) {
    const Status status = CheckPair(id, pair);
    if (!status.ok()) return status;
  }
  Status result = Status::Ok();
  for (const TwoViewPair& pair : pairs) {
    const ImageId other = static_cast<ImageId>(pair.other_id);
    if (neighbours_[id].count(other) > 0) continue;
    FeatureMatches matches;
    for (const auto& [index, other_index] : pair.inliers) {
      matches.emplace_back(index, other_index);
    }
    neighbours_[id][other] = neighbours_[other][id] = static_cast<int>(matches.size());
    if (!HasPhoto(other)) {
      waiting_[other][id] = std::move(matches);
      continue;
    }
    const Status status = Connect(id, other, matches);
    if (!status.ok()) result = status;
  }
  return result;
}

Status SceneMap::Connect(ImageId image_id1, ImageId image_id2, const FeatureMatches& matches) {
  const size_t n1 = reconstruction_->Image(image_id1).NumPoints2D();
  const size_t n2 = reconstruction_->Image(image_id2).NumPoints2D();
  // One-to-one: COLMAP's graph holds at most one correspondence of a keypoint with an image.
  std::unordered_set<Point2DIdx> used1, used2;
  FeatureMatches valid;
  for (const FeatureMatch& match : matches) {
    if (match.point2D_idx1 >= n1 || match.point2D_idx2 >= n2) {
      return InvalidArgument("pair with a keypoint index out of range");
    }
    if (used1.count(match.point2D_idx1) || used2.count(match.point2D_idx2)) continue;
    used1.insert(match.point2D_idx1);
    used2.insert(match.point2D_idx2);
    valid.push_back(match);
  }
  SortByKeypoint(&valid);
  graph_->AddCorrespondences(image_id1, image_id2, valid);
  pairs_.emplace_back(image_id1, image_id2);
  matches_[{image_id1, image_id2}] = std::make_shared<const FeatureMatches>(std::move(valid));
  return Status::Ok();
}

FeatureMatches SceneMap::MatchesOfPair(ImageId id1, ImageId id2) const {
  if (const auto it = matches_.find({id1, id2}); it != matches_.end()) return *it->second;
  const auto it = matches_.find({id2, id1});
  if (it == matches_.end()) return {};
  FeatureMatches matches = *it->second;
  for (FeatureMatch& match : matches) std::swap(match.point2D_idx1, match.point2D_idx2);
  SortByKeypoint(&matches);
  return matches;
}

bool SceneMap::HasPhoto(int64_t image_id) const {
  return IsValidId(image_id) && reconstruction_->ExistsImage(static_cast<ImageId>(image_id));
}

bool SceneMap::IsRegistered(int64_t image_id) const {
  return HasPhoto(image_id) && reconstruction_->IsImageRegistered(static_cast<ImageId>(image_id));
}

const std::map<ImageId, int>& SceneMap::Neighbours(ImageId image_id) const {
  static const std::map<ImageId, int> kNone;
  const auto it = neighbours_.find(image_id);
  return it == neighbours_.end() ? kNone : it->second;
}

bool SceneMap::IsStrongPair(ImageId id1, ImageId id2, double min_share) const {
  int strongest = 0;
  for (const ImageId id : {id1, id2}) {
    for (const auto& [other, inliers] : Neighbours(id)) strongest = std::max(strongest, inliers);
  }
  return Neighbours(id1).at(id2) >= min_share * strongest;
}

void SceneMap::Register(ImageId image_id) {
  if (reconstruction_->IsImageRegistered(image_id)) return;
  reconstruction_->RegisterImage(image_id);
  ++cameras_.at(reconstruction_->Image(image_id).CameraId()).num_registered;
}

void SceneMap::Deregister(ImageId image_id) {
  if (!reconstruction_->IsImageRegistered(image_id)) return;
  reconstruction_->DeRegisterImage(image_id);
  const CameraId camera = reconstruction_->Image(image_id).CameraId();
  if (--cameras_.at(camera).num_registered == 0) ResetCamera(camera);
  RemoveOwnCamera(image_id);
}

void SceneMap::GiveOwnCamera(ImageId image_id) {
  Image& image = reconstruction_->Image(image_id);
  const CameraId given = image.CameraId(), own = OwnCamera(image_id);
  if (given == own) return;
  if (cameras_.count(own) == 0) {
    const CameraState& of_given = cameras_.at(given);
    CameraState state;
    state.given_model_id = of_given.given_model_id;
    state.given_params = state.prior_params = of_given.given_params;
    cameras_[own] = state;
    Camera camera = reconstruction_->Camera(given);
    camera.SetCameraId(own);
    camera.SetModelId(state.given_model_id);
    camera.SetParams(state.given_params);
    reconstruction_->AddCamera(camera);
  }
  image.SetCameraId(own);
  given_cameras_[image_id] = given;
  if (!image.IsRegistered()) return;
  ++cameras_.at(own).num_registered;
  if (--cameras_.at(given).num_registered == 0) ResetCamera(given);
}

void SceneMap::RemoveOwnCamera(ImageId image_id) {
  Image& image = reconstruction_->Image(image_id);
  const CameraId own = image.CameraId(), given = GivenCamera(image_id);
  if (given == own) return;
  image.SetCameraId(given);
  given_cameras_.erase(image_id);
  if (!image.IsRegistered()) return;
  ++cameras_.at(given).num_registered;
  if (--cameras_.at(own).num_registered == 0) ResetCamera(own);
}

bool SceneMap::HaveItsPhotosOwnCameras(CameraId given) const {
  const auto state = cameras_.find(given);
  if (state == cameras_.end() || state->second.num_registered > 0) return false;
  return std::any_of(given_cameras_.begin(), given_cameras_.end(), [&](const auto& photo) {
    return photo.second == given && IsRegistered(photo.first);
  });
}

CameraId SceneMap::GivenCamera(ImageId image_id) const {
  const auto given = given_cameras_.find(image_id);
  return given != given_cameras_.end() ? given->second
                                       : reconstruction_->Image(image_id).CameraId();
}

void SceneMap::ResetCamera(CameraId id) {
  CameraState& state = cameras_.at(id);
  Camera& camera = reconstruction_->Camera(id);
  camera.SetModelId(state.given_model_id);
  camera.SetParams(state.given_params);
  state.prior_params = state.given_params;
  state.refined = false;
  state.num_at_choice = 0;
}

void SceneMap::SetPose(const BundlePose& pose) {
  skein::SetPose(pose, &reconstruction_->Image(pose.image_id));
}

void SceneMap::SetPose(ImageId id, const Eigen::Vector4d& qvec_wxyz, const Eigen::Vector3d& tvec) {
  reconstruction_->Image(id).SetQvec(qvec_wxyz);
  reconstruction_->Image(id).SetTvec(tvec);
}

void SceneMap::SetCamera(CameraId id, const std::vector<double>& params) {
  reconstruction_->Camera(id).SetParams(params);
}

void SceneMap::SetCamera(const Camera& camera) {
  Camera& here = reconstruction_->Camera(camera.CameraId());
  if (here.ModelId() != camera.ModelId()) {
    CameraState& state = cameras_.at(camera.CameraId());
    if (state.known) return;
    state.prior_params =
        InitialCameraParams(camera.ModelId(), state.given_params[0], here.Width(), here.Height());
    here.SetModelId(camera.ModelId());
  }
  here.SetParams(camera.Params());
}

Point3DId SceneMap::AddPoint(const Eigen::Vector3d& xyz, const Track& track) {
  return reconstruction_->AddPoint3D(xyz, track);
}

void SceneMap::SetPoint(Point3DId id, const Eigen::Vector3d& xyz) {
  reconstruction_->Point3D(id).SetXYZ(xyz);
}

void SceneMap::DeletePoint(Point3DId id) { reconstruction_->DeletePoint3D(id); }

void SceneMap::ContinueTrack(Point3DId id, ImageId image_id, Point2DIdx index) {
  reconstruction_->AddObservation(id, {image_id, index});
  triangulator_->AddModifiedPoint3D(id);
}

void SceneMap::DeleteObservation(ImageId image_id, Point2DIdx index) {
  reconstruction_->DeleteObservation(image_id, index);
}

size_t SceneMap::TriangulateImage(ImageId id) { return triangulator_->TriangulateImage(id); }

std::vector<Point3DId> SceneMap::ModifiedPoints() {
  const auto& modified = triangulator_->GetModifiedPoints3D();
  std::vector<Point3DId> points(modified.begin(), modified.end());
  std::sort(points.begin(), points.end());
  return points;
}

void SceneMap::ForgetModifiedPoints() { triangulator_->ClearModifiedPoints3D(); }

void SceneMap::ReplaceRegistered(const Reconstruction& model) {
  const std::vector<ImageId> old_ids = reconstruction_->RegImageIds();
  for (const ImageId id : old_ids) Deregister(id);
  for (const ImageId id : model.RegImageIds()) {
    Image& image = reconstruction_->Image(id);
    if (model.Image(id).CameraId() == OwnCamera(id)) GiveOwnCamera(id);
    SetCamera(model.Camera(image.CameraId()));
    image.SetQvec(model.Image(id).Qvec());
    image.SetTvec(model.Image(id).Tvec());
    Register(id);
  }
  AddPoints(model, reconstruction_.get());
  triangulator_->ClearModifiedPoints3D();
}

void SceneMap::AlignTo(const Reconstruction& model) {
  std::vector<Eigen::Vector3d> from, to;
  for (const ImageId id : reconstruction_->RegImageIds()) {
    if (!model.IsImageRegistered(id)) continue;
    from.push_back(reconstruction_->Image(id).ProjectionCenter());
    to.push_back(model.Image(id).ProjectionCenter());
  }
  if (from.size() < 3) return;
  const Eigen::Matrix4d moved = Eigen::umeyama(Columns(from), Columns(to), true);
  const double scale = moved.block<1, 3>(0, 0).norm();
  if (!moved.allFinite() || !(scale > 0)) return;
  reconstruction_->Transform(scale, moved.topLeftCorner<3, 3>() / scale, moved.block<3, 1>(0, 3));
}

void SceneMap::Clear() {
  ReplaceRegistered(Reconstruction());
  for (const auto& [id, unused] : cameras_) ResetCamera(id);
}

std::array<uint8_t, 3> SceneMap::MeanColour(const Track& track) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const TrackElement& element : track.Elements()) {
    const auto& colour = colours_.at(element.image_id)[element.point2D_idx];
    sum += Eigen::Vector3d(colour[0], colour[1], colour[2]);
  }
  sum /= static_cast<double>(std::max<size_t>(1, track.Length()));
  const Eigen::Matrix<uint8_t, 3, 1> mean = sum.array().round().cast<uint8_t>();
  return {mean[0], mean[1], mean[2]};
}

void SceneMap::ColourPoints() {
  for (const Point3DId id : reconstruction_->Point3DIds()) {
    Point3D& point = reconstruction_->Point3D(id);
    const std::array<uint8_t, 3> mean = MeanColour(point.Track());
    point.SetColor({mean[0], mean[1], mean[2]});
  }
}

std::unique_ptr<SceneMap> SceneMap::Clone() const {
  auto copy = std::make_unique<SceneMap>();
  copy->camera_model_id_ = camera_model_id_;
  *copy->reconstruction_ = *reconstruction_;
  *copy->graph_ = *graph_;
  copy->cameras_ = cameras_;
  copy->given_cameras_ = given_cameras_;
  copy->neighbours_ = neighbours_;
  copy->waiting_ = waiting_;
  copy->colours_ = colours_;
  copy->pairs_ = pairs_;
  copy->matches_ = matches_;
  copy->photos_ = photos_;
  return copy;
}

std::vector<Point3DId> PointsSeenBy(const Reconstruction& model,
                                    const std::vector<ImageId>& images) {
  std::vector<Point3DId> points;
  for (const ImageId id : images) {
    for (const Point2D& point2D : model.Image(id).Points2D()) {
      if (point2D.HasPoint3D()) points.push_back(point2D.Point3DId());
    }
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<Point3DId> PointsSeenBy(const SceneMap& map, const std::vector<ImageId>& images) {
  return PointsSeenBy(map.reconstruction(), images);
}

std::vector<ImageId> ObserversOf(const SceneMap& map, const std::vector<Point3DId>& points) {
  std::set<ImageId> observers;
  for (const Point3DId id : points) {
    for (const auto& element : map.reconstruction().Point3D(id).Track().Elements()) {
      observers.insert(element.image_id);
    }
  }
  return {observers.begin(), observers.end()};
}

bool IsLongTrack(const SceneMap& map, Point3DId id) {
  return map.reconstruction().Point3D(id).Track().Length() > kLongTrackLength;
}

std::vector<Point3DId> WithoutLongTracks(const SceneMap& map,
                                         const std::vector<Point3DId>& points) {
  std::vector<Point3DId> result;
  for (const Point3DId id : points) {
    if (!IsLongTrack(map, id)) result.push_back(id);
  }
  return result;
}

std::vector<Point3DId> Without(const std::vector<Point3DId>& ids,
                               const std::vector<Point3DId>& others) {
  std::vector<Point3DId> result;
  std::set_difference(ids.begin(), ids.end(), others.begin(), others.end(),
                      std::back_inserter(result));
  return result;
}

}  // namespace skein
