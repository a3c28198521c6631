#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "map/scene_map.h"
#include "mapping/adjuster.h"
#include "mapping/consistency.h"
#include "mapping/found_poses.h"
#include "mapping/guest_photos.h"
#include "mapping/initial_pair.h"
#include "mapping/maintenance.h"
#include "mapping/photo_event.h"
#include "mapping/photo_trial.h"
#include "mapping/submap_options.h"
#include "mapping/waiting_photos.h"

namespace skein {

struct MapErrors;
struct MatchAgreement;

struct SubmapStatistics {
  int num_images = 0;
  int num_deferred = 0;
  int num_points = 0;
  double mean_reprojection_error_px = 0;
  double mean_track_length = 0;
  ModelCheck check;  // of the last background BA or finish
};

// State of a submap that a checkpoint holds besides its COLMAP model.
struct SubmapState {
  std::vector<int64_t> photos;  // registered or waiting, in the order they came
  std::map<CameraId, bool> is_camera_refined;
  std::map<ImageId, TrialRecord> trials;
  Adjuster::Size size_at_global;
  ImageId first = 0;  // of the initial pair
};

// One submap. Photos come with their matches one after the other; the submap registers those it
// can. Photos that wait are tried again when a neighbour of theirs is registered. Submap carries
// out the findings of its parts:
//   WaitingPhotos  what was tried with photos that are not registered, who is next
//   PhotoTrial     one photo's registration, step by step
//   Adjuster       local and global bundle adjustment
//   Consistency    photos that contradict the map
//   Maintenance    background bundle adjustment and what follows it
// Owned by one thread; knows nothing of messages.
class Submap {
 public:
  using EventSink = skein::EventSink;

  explicit Submap(const SubmapOptions& options);
  // With photos and pairs that are there already, none registered.
  Submap(const SubmapOptions& options, std::unique_ptr<SceneMap> map);

  // Adds a photo, then its pairs. A refusal leaves the submap unchanged.
  Status AddPhoto(const PhotoInput& photo) { return map_->AddPhoto(photo); }
  Status AddPairs(int64_t image_id, const TwoViewPairs& pairs);

  // Starts the map from two photos that are there. On failure nothing is registered.
  InitialPairResult Start(const InitialPairOptions& options, int64_t image_id1, int64_t image_id2,
                          const EventSink& sink);

  // Puts a photo that is there into the queue; ignored when it is registered, rejected or held
  // elsewhere.
  void Enqueue(int64_t image_id) { waiting_.Enqueue(image_id); }
  // Another submap holds the photo, or no longer: meanwhile it is not tried here.
  void SetHeldElsewhere(int64_t image_id, bool held);
  // From now on nothing is adjusted in the background, nor checked after it.
  void LeaveOutMaintenance() { is_maintained_ = false; }
  bool is_maintained() const { return is_maintained_; }
  // Whether a larger map of the same place grows beside this one. While it does, a failed trial is
  // no reason to map the photos anew here: the larger map does so.
  void SetHasLargerNeighbour(bool has) { has_larger_neighbour_ = has; }
  // The photo is never tried again, and leaves the queue.
  void LeaveOut(int64_t image_id) { waiting_.LeaveOut(image_id); }
  // Tries the queue's most promising photo; false if the queue was empty. After a success, waiting
  // neighbours that see more points than at their last trial enter the queue.
  bool Step(const EventSink& sink);

  // Folds back a finished background BA and continues with what follows, a bounded part at each
  // call (maintenance.h). Step does so, too. `idle_s`: since the last photo came. True while
  // something is left to do.
  bool Maintain(double idle_s, const EventSink& sink);

  // Merges a map, with photos that this map lacks, into this one; true if that succeeded. False:
  // nothing has changed. Null: never.
  using Absorb = std::function<bool(const Submap& anew)>;

  // Whether and how the map's own photos are mapped again where the map is inconsistent. A finish
  // maps them again for a large expected error, too, allowed or not.
  struct Again {
    // False: all photos of the place are mapped as a batch in this finish, here or in another
    // submap.
    bool is_allowed = true;
    Absorb absorb = nullptr;
  };

  // RefineUntilStable. A map that is inconsistent even then is mapped again (MapAsBatch).
  void Consolidate(const EventSink& sink, const Again& again);
  void Consolidate(const EventSink& sink) { Consolidate(sink, Again()); }

  // A place that is mapped as a batch.
  struct Batch {
    // True: all photos of the place are in this submap, and all are mapped, also those that another
    // submap holds. False: this map's own photos are mapped again, and only if the map contradicts
    // its matches.
    bool is_of_place = false;
    std::vector<std::vector<int64_t>> others;  // photos of each other submap of it, ascending
    Absorb absorb;
    // Photos are still to come: those with too little support can wait (supported_photos.h).
    bool is_growing = false;
  };
  // Maps the photos again, by all pairs at once (rebuild.h), with the intrinsics that were found.
  // Before that a map of a place that explains its matches grows by the photos that it lacks, one
  // by one. If it lacks only photos of visually similar places then, it is not mapped again. The
  // new map stays if more verified matches agree with it, or about as many while it has more
  // photos. Photos of another submap that show a visually similar place stay there. No photo may be
  // lost that no other map has. Else its photos may be absorbed, if nearly as many matches agree
  // with it. True if the map is another one now.
  bool MapAsBatch(const Batch& batch, const EventSink& sink);

  // Tries every photo that waits, also rejected ones, refines the map globally, and withdraws the
  // photos that contradict it. Ends when no photo comes or goes, or after a few rounds.
  void RefineUntilStable(const EventSink& sink);

  // Consolidate, then all points triangulated again (retriangulation.h) and global BA until nothing
  // changes much. The finished model hardly depends on the order of the photos. Points triangulated
  // again show what points that grew with the map hide: if the map is inconsistent with them, it is
  // mapped again as well. Points of two photos that do not fit are removed
  // (FilterPointsOfTwoPhotos). If the options say stop, the remaining parts are left out, here and
  // in the functions above.
  void Finish(const EventSink& sink, const Again& again);
  void Finish(const EventSink& sink) { Finish(sink, Again()); }
  // Roughly how long either takes, by the map's size and its last global BA. 0: nothing to do.
  double EstimateConsolidateS() const;
  double EstimateFinishS() const;

  // Withdraws a photo for a reason from outside. The photo is tried again when a neighbour
  // registers, as often as other withdrawn photos. False, and nothing has changed, if no map would
  // be left. No effect on a photo that is not registered.
  bool TakeBack(int64_t image_id, const Refusal& refusal, const EventSink& sink);

  // Withdraws the photos of which another submap, of a visually similar place, sees far more
  // points. Such photos come back only if they show enough of this place to be told from the other.
  void YieldPhotosTo(const Reconstruction& other, const EventSink& sink);

  // Tries all deferred photos again at the next steps.
  void RetryDeferred() { waiting_.RetryDeferred(); }

  // Notes that the map was just mapped again: another map may replace it only with more pairs.
  void NoteMappedAnew() { num_pairs_rebuilt_ = map_->pairs().size(); }

  // Replaces the registered part by a model, e.g. a merged one: poses, points, cameras. All of its
  // images must be in the submap. On failure nothing has changed.
  Status ReplaceModel(const Reconstruction& model);

  // State of a submap besides the model, as a checkpoint holds it, and the reverse, which replaces
  // all that is registered.
  SubmapState State() const;
  Status Restore(const Reconstruction& model, const SubmapState& state);

  // Poses of the photos among `image_ids` that are here, and the points that each sees, for a
  // merger. Photos that are here and not registered are placed as guests during the call.
  SharedImages ExportShared(const std::vector<int64_t>& image_ids);

  // Registers photos of another submap beside it: the two are compared through photos that both
  // hold. Their trials are as strict as they can be. Guests whose poses are known from the call
  // before (found_poses.h) come first. The guests stay until the returned object is destroyed.
  std::unique_ptr<GuestPhotos> PlaceGuests(const std::vector<int64_t>& image_ids);
  // The model's photos that are here and not registered, those with most matches to registered
  // ones and to those before them, at most `max_num`.
  std::vector<int64_t> FindGuests(const Reconstruction& other, int max_num) const;

  // Tells of photos that are registered and were not, and the reverse, with that reason. `before`:
  // those that were, ascending.
  void TellNewAndGone(const std::vector<ImageId>& before, const Refusal& refusal,
                      const EventSink& sink);

  // The registered photos as events, by id.
  std::vector<PhotoEvent> RegisteredEvents() const;

  // Visits all points.
  SubmapStatistics Statistics() const;
  SceneMap& map() { return *map_; }
  const SceneMap& map() const { return *map_; }
  const SubmapOptions& options() const { return options_; }
  const WaitingPhotos& waiting() const { return waiting_; }

 private:
  // Registration of one photo.
  bool TryPhoto(ImageId id, const EventSink& sink);
  void NoteTried(const PhotoTrial& trial);
  void Defer(const PhotoTrial& trial, const Refusal& refusal, const EventSink& sink);
  void Keep(const PhotoTrial& trial, const EventSink& sink);
  int AdjustNewImage(ImageId new_image);
  void AdjustGlobally(int max_rounds, bool retriangulate, bool final);
  void SettleIntrinsics();
  void TryAllWaiting(const EventSink& sink);

  // Both withdraw those of `images` that contradict the map: too few observations, or most matches.
  void WithdrawWeak(const std::vector<ImageId>& images, const EventSink& sink);
  void WithdrawContradicted(const std::vector<ImageId>& images, const EventSink& sink);
  bool WithdrawMisplaced(const EventSink& sink);
  bool WithdrawUntied(const EventSink& sink);
  void WithdrawForRetry(const std::vector<ImageId>& ids, const Refusal& refusal,
                        const EventSink& sink);
  bool Withdraw(ImageId id, const Refusal& refusal, const EventSink& sink);

  void AdjustWithPointsAnew(const EventSink& sink);
  bool MayHaveSmallerError() const;
  MapErrors Errors() const;
  void TakeSmallerError(const EventSink& sink);
  void BeginAnewIfSmall(const EventSink& sink);
  bool IsVerdictKnown(const Batch& batch) const;
  bool TakeFromBatch(const Batch& batch, Submap* anew, const MatchAgreement& now,
                     const EventSink& sink);
  bool HasOthers(const SceneMap& anew) const;
  bool LosesPhotos(const SceneMap& anew, const std::vector<std::vector<int64_t>>& others) const;
  std::set<ImageId> PhotosOfSimilarPlace(const SceneMap& anew,
                                         const std::vector<int64_t>& theirs) const;
  bool TakeOutSimilarPlaces(const std::vector<std::vector<int64_t>>& others, Submap* anew) const;
  bool MixesPlaces(const SceneMap& anew, const std::vector<std::vector<int64_t>>& others) const;
  // Whether another map may win a photo, or enough matches to stay; whether it stayed, as
  // `agreeing` matches agree with it.
  bool MayWin(const Batch& batch, const MatchAgreement& now) const;
  bool TakeIfBetter(Submap* anew, int64_t agreeing, const MatchAgreement& now,
                    const EventSink& sink);
  // Takes the place of this map, in its frame.
  void ReplaceByRebuilt(Submap* anew, const EventSink& sink);

  PhotoEvent RegisteredEvent(ImageId id, const PoseEstimate& estimate) const;

  const SubmapOptions options_;
  const std::unique_ptr<SceneMap> map_;
  WaitingPhotos waiting_;
  Adjuster adjuster_;
  Consistency consistency_;
  Maintenance maintenance_;
  FoundPoses found_poses_;     // of guests
  ImageId first_ = 0;          // of the initial pair
  bool is_maintained_ = true;  // see LeaveOutMaintenance
  bool has_larger_neighbour_ = false;
  size_t num_pairs_compared_ = 0;  // by TakeSmallerError
  bool may_be_misplaced_ = false;  // a sign of misplaced photos was seen since they were looked for
  // Parts of a finish that need not be repeated, as no photo has come or gone since:
  struct Settled {
    bool refined = false;         // a global BA has begun, or has been done
    bool shape_known = false;     // by a background BA
    bool checked = false;         // the refinement is complete, and no photo contradicts the map
    bool intrinsics = false;      // are those that the photos call for
    bool none_misplaced = false;  // nor is a group of photos misplaced
    bool all_tried = false;       // every waiting photo was tried against it
    bool consistent = false;      // the map is, as a whole
  };
  Settled settled_;
  size_t num_pairs_rebuilt_ = 0;  // verified pairs when that was last looked into
};

}  // namespace skein
