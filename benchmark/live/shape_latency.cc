// How late a large map's mapper tells of a new photo, with the points that the photo brings: from
// the end of the worker's job to the shape that has the photo. Between photos the map is tidied up
// all the time, as after a background adjustment.
//
//   shape_latency POINTS [PHOTOS=200]
//
// All photos see one place, so tracks are long. A line each for photos that are told as such, and
// as any other change of the map.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <utility>
#include <vector>

#include "core/clock.h"
#include "testing/shape_telling_mapper.h"
#include "testing/synthetic_scene.h"

namespace skein {
namespace {

constexpr int kNumNew = 10;
constexpr double kPhotoS = 4.0;  // a photo every so many seconds
constexpr double kTidyS = 0.1;   // a part of the upkeep

SyntheticScene Place(int num_points, int num_photos) {
  SyntheticOptions options;
  options.num_points = num_points;
  options.num_photos = num_photos + kNumNew;
  options.detection_rate = 0.06;
  options.max_pairs = 1;
  return MakeScene(options);
}

class Run {
 public:
  Run(const SyntheticScene& scene, int num_photos) : scene_(scene), num_old_(num_photos) {
    std::vector<ImageId> ids;
    for (int i = 1; i <= num_old_; ++i) ids.push_back(static_cast<ImageId>(i));
    Change(
        [&](SceneMap* map) {
          AddToMap(scene_, std::vector<TwoViewPairs>(scene_.photos.size()), map);
          RegisterAtTruth(scene_, ids, Eigen::Vector3d::Zero(), map);
        },
        true);
    mapper_.loop.RunUntil([this] { return num_pending_ == 0; }, 600);
    mapper_.loop.AddTimer(1, [this] { mapper_.LookAndTick(); });
    mapper_.loop.AddTimer(kTidyS, [this] {
      if (num_pending_ > 0) return;
      const auto move_one = [](SceneMap* map) {
        const auto& [id, point] = *map->reconstruction().Points3D().begin();
        map->SetPoint(id, point.XYZ() * 1.01);
      };
      Change(move_one, false);
    });
  }

  void Execute(bool told_as_new) {
    mapper_.loop.RunUntil([this] { return mapper_.told.num_images == num_old_; }, 60);
    std::vector<double> latencies_s;
    for (int i = 1; i < kNumNew; i += 2) {
      mapper_.loop.RunUntil([] { return false; }, kPhotoS + 0.37 * i);
      const auto id = static_cast<ImageId>(num_old_ + i);
      const auto add = [this, id](SceneMap* map) {
        RegisterAtTruth(scene_, {id, id + 1}, Eigen::Vector3d::Zero(), map);
      };
      mapper_.loop.RunUntil([this] { return num_pending_ == 0; }, 60);
      Change(add, told_as_new);
      mapper_.loop.RunUntil([this] { return num_pending_ == 0; }, 60);
      const Timer timer;
      mapper_.loop.RunUntil([&] { return mapper_.told.num_images == num_old_ + i + 1; }, 60);
      latencies_s.push_back(timer.ElapsedS());
    }
    std::sort(latencies_s.begin(), latencies_s.end());
    std::printf(
        "{\"told_as_new\": %s, \"photos\": %d, \"points\": %d, \"p50_s\": %.3f, \"max_s\": %.3f}\n",
        told_as_new ? "true" : "false", mapper_.told.num_images, mapper_.told.num_points,
        latencies_s[latencies_s.size() / 2], latencies_s.back());
  }

 private:
  // A job of the worker, after which the teller hears of it.
  void Change(std::function<void(SceneMap*)> change, bool has_new_photo) {
    ++num_pending_;
    mapper_.Change(std::move(change), [this, has_new_photo] {
      --num_pending_;
      mapper_.teller.NoteChange(has_new_photo);
    });
  }

  const SyntheticScene& scene_;
  const int num_old_;
  ShapeTellingMapper mapper_;
  int num_pending_ = 0;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "shape_latency POINTS [PHOTOS=200]\n");
    return 2;
  }
  const int num_photos = argc > 2 ? std::atoi(argv[2]) : 200;
  const skein::SyntheticScene scene = skein::Place(std::atoi(argv[1]), num_photos);
  for (const bool told_as_new : {false, true}) {
    skein::Run run(scene, num_photos);
    run.Execute(told_as_new);
  }
  return 0;
}
