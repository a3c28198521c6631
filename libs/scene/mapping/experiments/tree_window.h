#pragma once

#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "mapping/experiments/association_tree.h"
#include "mapping/local_adjustment.h"

namespace skein {

// How the weights p of the association tree act on the window's poses (docs/methods/local_ba.md).
enum class TreeForm {
  kPaper,       // as the paper's Eq. 10-11 scale the normal equations; no limits
  kConsistent,  // a prior (1/p - 1) * H on a pose's increment, H its own information
  kEqual,       // not at all
};

// Limits of kConsistent and kEqual.
constexpr size_t kMaxTreeFree = 40;  // images, the new one included
constexpr size_t kMaxTreeHeld = 80;  // images
constexpr size_t kMaxTreePoints = 8000;

// A window over the paper's association tree (section 3.3.1). Ripples before the last are free with
// their weights. Held are the last ripple, what exceeds the limits, and the images that see most of
// the window's points. Over the limit of points half are the new photo's. Each other free image has
// its share of the rest; points that most free images see come first.
class TreeWindow : public LocalAdjustment {
 public:
  // `max_points`: for all forms but kPaper.
  explicit TreeWindow(TreeForm form, size_t max_points = kMaxTreePoints)
      : form_(form), max_points_(max_points) {}

  BundleRequest SelectWindow(const SceneMap& map, ImageId new_image) const override;
  bool LeavesPointsOut() const override { return true; }
  void AddSimilar(ImageId id, const std::vector<std::pair<uint32_t, double>>& distances) override;

 private:
  bool IsLimited() const { return form_ != TreeForm::kPaper; }
  void HoldObservers(const SceneMap& map, BundleRequest* request) const;

  const TreeForm form_;
  const size_t max_points_;
  SimilarityLists similar_;
};

// The forms of local BA that --local-ba takes: COLMAP's and the tree's.
struct LocalBaOptions {
  std::string form = "colmap";  // or paper, consistent, equal
  int colmap_images = 30;       // of colmap, the new one included
};

const std::vector<std::string>& LocalBaForms();

// Throws std::invalid_argument for an unknown form.
LocalAdjustmentMaker MakerOf(const LocalBaOptions& options);

}  // namespace skein
