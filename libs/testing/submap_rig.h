// A submap fed with the photos of a synthetic scene.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "geometry/sim3_similarity.h"
#include "mapping/submap.h"
#include "testing/synthetic_scene.h"

namespace skein {

class SubmapRig {
 public:
  explicit SubmapRig(const SyntheticOptions& options, SubmapOptions submap = {})
      : scene(MakeScene(options)), map(submap) {}

  void Add(size_t photo) {
    ASSERT_TRUE(map.AddPhoto(scene.photos[photo]).ok());
    ASSERT_TRUE(map.AddPairs(scene.photos[photo].image_id, scene.pairs[photo]).ok());
  }
  Submap::EventSink Sink() {
    return [this](const PhotoEvent& event) { events.push_back(event); };
  }
  bool Start(size_t a, size_t b, double min_angle_deg = 8) {
    Add(a);
    Add(b);
    InitialPairOptions options;
    options.min_triangulation_angle_deg = min_angle_deg;
    return map.Start(options, a + 1, b + 1, Sink()).status.ok();
  }
  void Feed(size_t photo) {
    Add(photo);
    map.Enqueue(photo + 1);
    while (map.Step(Sink())) continue;
  }
  void FeedAll() {
    ASSERT_TRUE(Start(0, 2));
    for (size_t i = 0; i < scene.photos.size(); ++i) {
      if (i != 0 && i != 2) Feed(i);
    }
  }
  int NumRegistered() const { return map.Statistics().num_images; }
  // RMSE of positions in percent of the scene's size after a similarity.
  double PositionErrorPercent() const {
    std::vector<Eigen::Vector3d> from, to;
    for (const ImageId id : map.map().reconstruction().RegImageIds()) {
      from.push_back(map.map().reconstruction().Image(id).ProjectionCenter());
      to.push_back(scene.Center(id - 1));
    }
    const std::optional<Similarity> similarity = SimilarityFromPoints(from, to);
    if (!similarity) return HUGE_VAL;
    double sum = 0;
    for (size_t i = 0; i < from.size(); ++i) {
      sum += (similarity->Apply(from[i]) - to[i]).squaredNorm();
    }
    return 100 * std::sqrt(sum / from.size()) / 4.0;
  }
  double Focal() const { return map.map().reconstruction().Camera(1).Params(0); }

  SyntheticScene scene;
  Submap map;
  std::vector<PhotoEvent> events;
};

inline SyntheticOptions NoisyArc() {
  SyntheticOptions options;
  options.num_photos = 14;
  options.noise_px = 1;
  options.outlier_ratio = 0.1;
  return options;
}

// A map whose finish is to stop from the n-th question on; 0: never.
class StoppableRig {
 public:
  explicit StoppableRig(int stop_at = 0)
      : stop_at_(stop_at), rig_(NoisyArc(), StoppedBy([this] { return IsStopped(); })) {}

  SubmapRig& operator*() { return rig_; }
  SubmapRig* operator->() { return &rig_; }
  void StopAt(int n) {
    stop_at_ = n;
    num_asked_ = 0;
  }
  int num_asked() const { return num_asked_; }

 private:
  static SubmapOptions StoppedBy(std::function<bool()> stop) {
    SubmapOptions options;
    options.stop = std::move(stop);
    return options;
  }
  bool IsStopped() { return ++num_asked_ >= stop_at_ && stop_at_ > 0; }

  int stop_at_;
  int num_asked_ = 0;
  SubmapRig rig_;
};

}  // namespace skein
