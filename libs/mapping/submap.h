#pragma once

#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "map/filters.h"
#include "map/scene_map.h"
#include "mapping/background_ba.h"
#include "mapping/initial_pair.h"
#include "mapping/local_window.h"
#include "mapping/misplaced.h"
#include "mapping/registration.h"

namespace skein {

struct SubmapOptions {
  std::string camera_model = "SIMPLE_RADIAL";
  RegistrationOptions registration;
  LocalWindowOptions local;
  FilterOptions filter;
  MisplacedOptions misplaced;
  // So many ambiguous photos say that the map holds one place twice: then they are registered where
  // most points agree, and misplaced ones show by their matches.
  int max_ambiguous = 3;
  colmap::IncrementalTriangulator::Options triangulation;
  int max_images_all_global = 12;  // up to here each photo's BA takes in the whole map
  double global_growth = 1.1;      // growth of images or points that calls for a global BA
  int min_observations = 15;       // of a registered photo; with less it is withdrawn
  // Part of the points that its matches tie it to that a registered photo must observe; looked at
  // after each global BA. Registration asks for registration.min_inlier_ratio of them.
  double min_observed_ratio = 0.15;
  int max_withdrawals = 4;      // of one photo; then it is rejected
  double stranger_ratio = 2.0;  // of observations in a place that looks alike to those here
  // A submap is torn where a photo has so many verified matches with registered ones, and less than
  // this part of them agrees with the poses, or it is not registered at all (its
  // matches in pairs below misplaced.min_pair_share left out).
  int min_torn_matches = 100;
  double min_agreeing_share = 0.85;
  double min_rebuild_gain = 0.005;  // in matches that agree, for the submap mapped anew to stay
  // Global BA beside registration, in a thread of its own. Off: in turn with it, and the result
  // depends only on the order of the calls.
  bool background = false;
  int num_threads = 1;
};

// What became of a photo.
struct PhotoEvent {
  enum class State { kRegistered, kDeferred, kRejected, kWithdrawn };
  int64_t image_id = 0;
  State state = State::kDeferred;
  std::string reason;  // of all but kRegistered
  int num_visible = 0;
  int num_inliers = 0;
  Eigen::Vector4d qvec{1, 0, 0, 0};  // cam_from_world, wxyz
  Eigen::Vector3d tvec{0, 0, 0};
  double mean_error_px = 0;  // of its observations after its BA
  int num_ba_images = 0;     // free images of its BA
  double register_s = 0, triangulate_s = 0, ba_s = 0, total_s = 0;
  double ba_cpu_s = 0;  // of the mapper's own thread
};

struct SubmapStatistics {
  int num_images = 0;
  int num_deferred = 0;
  int num_points = 0;
  double mean_reprojection_error_px = 0;
  double mean_track_length = 0;
};

// One submap: takes photos with their matches one after the other, registers those it can, keeps
// the others until a neighbour of theirs is registered. Owned by one thread; knows nothing of
// messages.
class Submap {
 public:
  using EventSink = std::function<void(const PhotoEvent&)>;

  explicit Submap(const SubmapOptions& options);

  // Photo, pairs and similar photos (with distances of global descriptors) go in first, in this
  // order; refusals leave the submap as it was.
  Status AddPhoto(const PhotoInput& photo) { return map_->AddPhoto(photo); }
  Status AddPairs(int64_t image_id, const TwoViewPairs& pairs) {
    is_consolidated_ = false;
    return map_->AddPairs(image_id, pairs);
  }
  void AddSimilar(int64_t image_id, const std::vector<std::pair<uint32_t, double>>& distances);

  // Starts the map from two photos that are there. On failure nothing is registered.
  InitialPairResult Start(const InitialPairOptions& options, int64_t image_id1, int64_t image_id2,
                          const EventSink& sink);

  // Puts a photo that is there into the queue; ignored when it is registered or rejected.
  void Enqueue(int64_t image_id);
  // Tries the queue's most promising photo; false if the queue was empty. Success puts those of its
  // neighbours into the queue that wait and see more points than when they were last tried.
  bool Step(const EventSink& sink);

  // Folds back a background BA that is done and goes on with what follows it: completing, merging,
  // filtering of all points and retriangulation, a bounded part at each call. Step does so too.
  // `at_rest`: no photo has come for a while, so that also a map that has grown less gets its
  // global BA. True while something is left to do.
  bool Maintain(bool at_rest, const EventSink& sink);

  // Every photo that waits once more, also those that were rejected, on a globally refined map, and
  // those out of it that contradict it, until no photo comes or goes (or a few rounds are over). A
  // submap that is torn even then is mapped anew, the photos that see most first, as if all had
  // come at once; of the two the one stays that more verified matches agree with.
  void Consolidate(const EventSink& sink);

  // Consolidate, then all points anew (retriangulation.h) and global BA until nothing changes much:
  // the finished model hangs on the photos and their matches, hardly on the order they came in.
  void Finish(const EventSink& sink);

  // Withdraws a photo for a reason from outside; it is tried again when a neighbour registers, as
  // often as others that were withdrawn. False, and nothing has changed, if no map would be left.
  // No effect on one that is not registered.
  bool TakeBack(int64_t image_id, const std::string& reason, const EventSink& sink);

  // Withdraws the photos that another submap, of a place that looks alike, holds more firmly. They
  // do not come back unless they show enough of this place to be told from the other.
  void LeaveStrangersTo(const colmap::Reconstruction& other, const EventSink& sink);

  // Tries all deferred photos again at the next steps.
  void RetryDeferred();

  // Replaces what is registered by a model whose images are all there, e.g. a merged one: poses,
  // points, cameras. On failure nothing has changed.
  Status ReplaceModel(const colmap::Reconstruction& model);

  // What a merger needs of the photos among `image_ids` that are registered here.
  SharedImages ExportShared(const std::vector<int64_t>& image_ids) const;

  // The registered photos as events, by id.
  std::vector<PhotoEvent> RegisteredEvents() const;

  // Visits all points.
  SubmapStatistics Statistics() const;
  SceneMap& map() { return *map_; }
  const SceneMap& map() const { return *map_; }
  const SubmapOptions& options() const { return options_; }

  // What was tried with a photo.
  struct Trial {
    int last_visible = 0;  // points visible when it was last tried
    int num_withdrawals = 0;
    bool deferred = false;  // told so
    bool rejected = false;
    bool looks_alike = false;  // withdrawn as of a place that looks alike
  };
  // For checkpoints.
  struct Side {
    std::map<ImageId, Trial> trials;
    SimilarityLists similar;
    uint64_t images_at_global = 0;
    uint64_t points_at_global = 0;
    ImageId first = 0;  // of the initial pair
  };
  const Side& side() const { return side_; }
  void set_side(const Side& side) { side_ = side; }

 private:
  struct Adjustment {
    int num_images = 0;
    double seconds = 0;
    double cpu_s = 0;
  };

  void RetryAll();
  void Settle(const EventSink& sink);
  bool IsTorn() const;
  bool StartFromBestPairOf(ImageId id);
  void Rebuild(const EventSink& sink);
  void TakeOver(Submap* anew, const EventSink& sink);
  bool TryPhoto(ImageId id, const EventSink& sink);
  bool LooksAlike(ImageId id) const;
  bool IsSuspect(ImageId id) const;
  RegistrationOptions OptionsOfTrial(ImageId id) const;
  void NoteAmbiguous(ImageId id);
  void Defer(const PoseEstimate& estimate, ImageId id, PhotoEvent event, const EventSink& sink);
  PhotoEvent RegisteredEvent(ImageId id, const PoseEstimate& estimate) const;
  void EnqueueNeighbours(ImageId id);
  int CountVisible(ImageId id) const;

  Adjustment Adjust(ImageId new_image);
  Adjustment AdjustLocally(ImageId new_image);
  // Moves the points that the images of a local BA see but the BA left out to where their
  // observations meet now that the poses have changed.
  void SettlePointsBeside(const BundleRequest& adjusted);
  BundleOptions GlobalBaOptions(bool last) const;
  // One global BA; returns the part of the observations that completion, merging and filtering
  // changed after it.
  double AdjustGlobally(const BundleOptions& options, int* num_images);
  void RefineGlobally(int max_rounds, bool retriangulate, bool final);
  void StartBackgroundBa();
  void FoldBackRefined(const RefinedBundle& refined);
  void MaintainPoints();
  void MaintainPairs();
  void MaintainImages(const EventSink& sink);
  void DropMaintenance();
  bool HasGrown() const;
  void NoteSize();
  void MarkCamerasRefined();
  void WithdrawWeak(const std::vector<ImageId>& images, const EventSink& sink);
  void WithdrawContradicted(const std::vector<ImageId>& images, const EventSink& sink);
  std::vector<ImageId> SuspectedLookAlikes() const;
  std::vector<ImageId> LoneLookAlikes();
  bool OthersAreMisplaced(ImageId on_trial, const EventSink& sink);
  void WithdrawForRetry(const std::vector<ImageId>& ids, const std::string& reason,
                        const EventSink& sink);
  bool WithdrawMisplaced(const EventSink& sink);
  bool Withdraw(ImageId id, const std::string& reason, const EventSink& sink);

  SubmapOptions options_;
  std::unique_ptr<SceneMap> map_;
  Side side_;
  std::map<ImageId, int> queue_;  // with the number of points it sees
  BackgroundBa background_;
  std::set<ImageId> ambiguous_;   // photos that wait for that reason
  bool is_doubtful_ = false;      // a sign of misplaced photos was seen since they were looked for
  size_t num_pairs_rebuilt_ = 0;  // verified pairs when it was last mapped anew
  bool is_consolidated_ = false;  // and no photo has come or gone since
  int rounds_at_rest_ = 0;        // global BAs that a map at rest is still owed
  std::vector<Point3DId> points_to_maintain_;
  std::vector<std::pair<ImageId, ImageId>> pairs_to_maintain_;
  std::vector<ImageId> images_to_maintain_;
  std::vector<ImageId> last_adjusted_;  // images whose observations the last BA filtered
};

}  // namespace skein
