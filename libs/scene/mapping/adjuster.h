#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bundle/bundle.h"
#include "map/bundle_builder.h"
#include "mapping/model_check.h"
#include "mapping/submap_options.h"

namespace skein {

// Work and time of global BAs.
struct GlobalBaCost {
  int num_rounds = 0;
  int num_iterations = 0;
  int num_decompositions = 0;
  double solve_s = 0;          // wall time, as the others
  double tracks_s = 0;         // completing, merging and filtering
  double retriangulate_s = 0;  // under-reconstructed pairs
};

// Bundle adjustments of a map, with what must follow each of them: completing and merging tracks,
// filtering, retriangulation.
class Adjuster {
 public:
  // Both must outlive this.
  Adjuster(const SubmapOptions& options, SceneMap* map) : options_(options), map_(*map) {}

  // After a photo was registered. Returns the number of free images.
  int AdjustLocally(ImageId new_image);
  // Free images, their points, and held images that see these points.
  void AdjustImages(const std::vector<ImageId>& images);
  // Up to `max_rounds` global BAs, until hardly an observation changes after one. `final`: then as
  // many that converge. If SubmapOptions::stop returns true, the BA ends with its present step,
  // after at least one.
  void AdjustGlobally(int max_rounds, bool retriangulate, bool final);
  // After a global BA: the models that the cameras' photos call for (camera_models.h), if the
  // options leave them open; then, which photos have intrinsics of their own (own_cameras.h). True
  // if a camera is another one now: another global BA must follow.
  bool ChooseIntrinsics();
  // The options of a global BA. The BA starts from the last decomposition (`factor_`).
  BundleOptions GlobalBaOptions(bool converge) const;
  // Notes a global BA that ran elsewhere: its decomposition, and its wall time.
  void NoteGlobalBa(std::shared_ptr<const BundleFactor> factor, double seconds) {
    factor_ = std::move(factor);
    last_global_ba_s_ = seconds;
  }
  // Notes the map's shape as a background BA found it; Check computes it otherwise.
  void NoteShape(const ShapeCheck& shape) { check_.shape = shape; }
  // `shape_is_known`: a background BA of the same photos has told it.
  void Check(bool shape_is_known);
  const ModelCheck& check() const { return check_; }
  // Wall time of the last global BA; 0 before the first.
  double last_global_ba_s() const { return last_global_ba_s_; }

  // Cost of the global BAs since the last call, without those in the background.
  GlobalBaCost TakeCost() { return std::exchange(cost_, {}); }

  // Images whose observations the last BA filtered, once.
  std::vector<ImageId> TakeAdjusted();

  // So few images that each BA takes in the whole map.
  bool IsMapSmall() const;
  // Enough since the last global BA for another.
  bool HasMapGrown() const;
  void NoteSize();
  // Cameras with two registered photos are no longer at their priors.
  void MarkCamerasRefined();

  // For checkpoints.
  struct Size {
    uint64_t num_images = 0;
    uint64_t num_points = 0;
  };
  const Size& size_at_global() const { return size_at_global_; }
  void set_size_at_global(const Size& size) { size_at_global_ = size; }

 private:
  void AdjustUntilStable(int max_rounds, double max_change, bool converge, bool final);
  double RunGlobalBa(bool converge, bool final);

  const SubmapOptions& options_;
  SceneMap& map_;
  Size size_at_global_;
  std::vector<ImageId> adjusted_;
  std::shared_ptr<const BundleFactor> factor_;  // of the last global BA
  double last_global_ba_s_ = 0;
  GlobalBaCost cost_;
  ModelCheck check_;
};

}  // namespace skein
