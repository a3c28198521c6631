#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bundle/bundle.h"
#include "map/bundle_builder.h"
#include "mapping/local_adjustment.h"
#include "mapping/submap_options.h"

namespace skein {

// Bundle adjustments of a map, with what must follow each of them: completing and merging tracks,
// filtering, retriangulation.
class Adjuster {
 public:
  // `options` and `map` must outlive this.
  Adjuster(const SubmapOptions& options, std::shared_ptr<LocalAdjustment> local, SceneMap* map)
      : options_(options), local_(std::move(local)), map_(*map) {}

  // After a photo was registered. Returns the number of free images.
  int AdjustLocally(ImageId new_image);
  // Free images, their points, and held images that see these points.
  void AdjustImages(const std::vector<ImageId>& images);
  // Up to `max_rounds` global BAs, until hardly an observation changes after one. `final`: each
  // converges.
  void AdjustGlobally(int max_rounds, bool retriangulate, bool final);
  // The options of a global BA.
  BundleOptions GlobalBaOptions(bool final) const;

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
  const std::shared_ptr<LocalAdjustment>& local() const { return local_; }

 private:
  void AdjustPointsBeside(const BundleRequest& adjusted);
  // False, and nothing has changed, if the solver failed.
  bool AdjustAndFilter(const BundleRequest& request, const BundleOptions& options);
  void CompleteAround(ImageId new_image);
  double RunGlobalBa(const BundleOptions& options);

  const SubmapOptions& options_;
  const std::shared_ptr<LocalAdjustment> local_;
  SceneMap& map_;
  Size size_at_global_;
  std::vector<ImageId> adjusted_;
};

}  // namespace skein
