#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "bundle/bundle.h"
#include "core/result.h"
#include "formats/formats.h"
#include "map/triangulator.h"
#include "sfm/correspondence_graph.h"
#include "sfm/reconstruction.h"

namespace skein {

using ImagePairs = std::vector<std::pair<ImageId, ImageId>>;

// A photo as the mapper takes it.
struct PhotoInput {
  int64_t image_id = 0;
  int64_t camera_id = 0;
  std::string name;  // AGENT/NAME
  int width_px = 0;
  int height_px = 0;
  double focal_px = 0;  // prior
  bool focal_from_exif = false;
  // Known intrinsics; "": the map's camera model with the focal prior.
  std::string camera_model;           // one of COLMAP's
  std::vector<double> camera_params;  // in COLMAP's order
  bool camera_fixed = false;          // never refined; else refined from these on
  Keypoints keypoints;
};

// Prior of a camera, and how far its parameters are refined.
struct CameraState {
  // Model and prior that its photos came with, and the prior as parameters of the present model.
  int given_model_id = 0;
  std::vector<double> given_params;
  std::vector<double> prior_params;
  bool known = false;  // a person gave the model and the prior: the model stays
  bool focal_from_exif = false;
  bool refined = false;    // a map of several photos has set its parameters
  bool fixed = false;      // its parameters are known and stay
  int num_registered = 0;  // registered photos of it
  int num_at_choice = 0;   // the same when its model was chosen last; 0: never
};

// A growing scene: photos with their keypoints, verified correspondences, poses, points. All input
// is validated. Owned by one thread.
class SceneMap {
 public:
  // `camera_model`: one of COLMAP's names. Throws std::invalid_argument for another.
  explicit SceneMap(const std::string& camera_model = "SIMPLE_RADIAL");

  // Refuses a second photo of an id, non-finite or negative sizes, ids beyond COLMAP's.
  Status AddPhoto(const PhotoInput& photo);

  // The verified pairs of a photo that was added, with any others. A pair with a photo that is not
  // there yet is kept until it comes. A pair given twice counts once. Refuses indices out of range.
  Status AddPairs(int64_t image_id, const TwoViewPairs& pairs);

  bool HasPhoto(int64_t image_id) const;
  bool IsRegistered(int64_t image_id) const;

  // Photos that have a verified pair with this one, and the pair's inliers. Includes photos that
  // are not in the map.
  const std::map<ImageId, int>& Neighbours(ImageId image_id) const;
  // Whether a pair of neighbours has at least this share of the inliers of the strongest pair of
  // either photo.
  bool IsStrongPair(ImageId id1, ImageId id2, double min_share) const;

  // Registers with the pose that the image has been given / takes it and its observations out.
  // After the last photo of a camera is out, the camera starts from its prior again, in the model
  // that it came with. A photo that is out gets the camera that it came with.
  void Register(ImageId image_id);
  void Deregister(ImageId image_id);

  // The photo's intrinsics are no longer those of other photos and start from their prior, in the
  // model that it came with, until it is taken out.
  void GiveOwnCamera(ImageId image_id);
  // The reverse: the photo has the camera again that it came with.
  void RemoveOwnCamera(ImageId image_id);
  // `given`: a camera that photos came with. True if such photos are registered, and each of them
  // has a camera of its own.
  bool HaveItsPhotosOwnCameras(CameraId given) const;
  // The camera that it came with / the id of its own.
  CameraId GivenCamera(ImageId image_id) const;
  static CameraId OwnCamera(ImageId image_id) { return kFirstOwnCamera + image_id; }

  // cam_from_world, of the photo that the pose names.
  void SetPose(const BundlePose& pose);
  void SetPose(ImageId id, const Eigen::Vector4d& qvec_wxyz, const Eigen::Vector3d& tvec);
  void SetCamera(CameraId id, const std::vector<double>& params);
  // Model and parameters of the camera with that id. A known camera keeps its model.
  void SetCamera(const Camera& camera);
  void SetCameraRefined(CameraId id, bool is_refined) { cameras_.at(id).refined = is_refined; }
  void NoteModelChosen(CameraId id) {
    cameras_.at(id).num_at_choice = cameras_.at(id).num_registered;
  }

  // Points and their tracks. An observation goes to a point at most.
  Point3DId AddPoint(const Eigen::Vector3d& xyz, const Track& track);
  void SetPoint(Point3DId id, const Eigen::Vector3d& xyz);
  void DeletePoint(Point3DId id);
  // The track counts as modified.
  void ContinueTrack(Point3DId id, ImageId image_id, Point2DIdx index);
  // A point that fewer than two photos would see goes with it.
  void DeleteObservation(ImageId image_id, Point2DIdx index);

  // Triangulator::TriangulateImage along the verified matches. Returns the number of observations
  // added; tracks that change count as modified.
  size_t TriangulateImage(ImageId id);
  // Ascending ids of the points whose tracks were modified since ForgetModifiedPoints.
  std::vector<Point3DId> ModifiedPoints();
  void ForgetModifiedPoints();

  // Drops all poses and points and takes those of `model`. Its images must be there with the same
  // keypoints, and cameras that they came with or of their own. Its points get new ids.
  void ReplaceRegistered(const Reconstruction& model);

  // Moves the map into the frame of a model with the same photos, by their centres. No effect if
  // they share fewer than three.
  void AlignTo(const Reconstruction& model);

  // Drops all poses and points; cameras get their priors back.
  void Clear();

  // Ids of the photos in the order they came.
  const std::vector<ImageId>& photos() const { return photos_; }

  const Reconstruction& reconstruction() const { return *reconstruction_; }
  const CorrespondenceGraph& graph() const { return *graph_; }
  const CameraState& camera_state(CameraId id) const { return cameras_.at(id); }
  const std::map<CameraId, CameraState>& camera_states() const { return cameras_; }
  std::set<CameraId> FixedCameras() const;
  // Pairs of photos that are both there, in the order they came.
  const ImagePairs& pairs() const { return pairs_; }
  // The verified matches of a pair, keypoints of id1 first and ascending; empty if the two are no
  // pair. The graph has them by keypoint: to gather a pair's costs as much as all of a
  // photo's.
  FeatureMatches MatchesOfPair(ImageId id1, ImageId id2) const;

  // Mean colour of a track's observations.
  std::array<uint8_t, 3> MeanColour(const Track& track) const;
  // Colours each point with the mean of its observations. Visits all points.
  void ColourPoints();

  // A deep copy.
  std::unique_ptr<SceneMap> Clone() const;

 private:
  // Beyond the ids of the cameras that photos come with.
  static constexpr CameraId kFirstOwnCamera = CameraId{1} << 31;

  void ResetCamera(CameraId id);
  friend struct MapAccess;

  Status CheckPhoto(const PhotoInput& photo) const;
  Status CheckCamera(const PhotoInput& photo) const;
  void AddCamera(const PhotoInput& photo);
  Status CheckPair(ImageId image_id, const TwoViewPair& pair) const;
  Status Connect(ImageId image_id1, ImageId image_id2, const FeatureMatches& matches);

  int camera_model_id_;
  std::unique_ptr<Reconstruction> reconstruction_;
  std::unique_ptr<CorrespondenceGraph> graph_;
  std::unique_ptr<Triangulator> triangulator_;
  std::map<CameraId, CameraState> cameras_;
  std::map<ImageId, CameraId> given_cameras_;  // of photos that have their own
  std::unordered_map<ImageId, std::map<ImageId, int>> neighbours_;
  // For a photo that is not there: pairs of photos that are with it (their index first).
  std::unordered_map<ImageId, std::map<ImageId, FeatureMatches>> waiting_;
  std::unordered_map<ImageId, std::vector<std::array<uint8_t, 3>>> colours_;
  ImagePairs pairs_;
  // Matches by pair, with the keys of pairs_. An entry never changes, so clones share it.
  std::map<std::pair<ImageId, ImageId>, std::shared_ptr<const FeatureMatches>> matches_;
  std::vector<ImageId> photos_;
};

// Points that at least one of the images observes / images that observe at least one of the points,
// ascending.
std::vector<Point3DId> PointsSeenBy(const Reconstruction& model,
                                    const std::vector<ImageId>& images);
std::vector<Point3DId> PointsSeenBy(const SceneMap& map, const std::vector<ImageId>& images);
std::vector<ImageId> ObserversOf(const SceneMap& map, const std::vector<Point3DId>& points);

// A point with more observations than this has a long track. Another observation hardly moves it.
// Work on it for one photo must not grow with its length. COLMAP's limit in its local BA.
constexpr size_t kLongTrackLength = 15;
bool IsLongTrack(const SceneMap& map, Point3DId id);
std::vector<Point3DId> WithoutLongTracks(const SceneMap& map, const std::vector<Point3DId>& points);

// `ids` without `others`, all three ascending.
std::vector<Point3DId> Without(const std::vector<Point3DId>& ids,
                               const std::vector<Point3DId>& others);

}  // namespace skein
