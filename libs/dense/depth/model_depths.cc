#include "depth/model_depths.h"

#include <algorithm>
#include <atomic>
#include <map>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/threads.h"
#include "depth/consistency.h"

namespace skein {
namespace {

constexpr int64_t kSweepBytes = int64_t{2} << 30;  // of all threads

Status ReadPhotos(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                  DepthInput* input) {
  std::map<int, PhotoTable> tables;
  for (size_t i = 0; i < scene.photos.size(); ++i) {
    const Result<cv::Mat3b> pixels = photo(i);
    if (!pixels.ok()) return pixels.status();
    const auto table = tables.try_emplace(scene.cameras[i], scene.lenses[i], size_px).first;
    input->colours.push_back(table->second.Apply(*pixels));
    cv::Mat1b grey;
    cv::cvtColor(*pixels, grey, cv::COLOR_BGR2GRAY);
    input->photos.push_back(table->second.Apply(grey, scene.photos[i].cam_from_world));
  }
  return Status::Ok();
}

// As many as have room for their sweeps.
int NumSweepThreads(const std::vector<DepthPhoto>& photos) {
  int64_t most = 1;
  for (const DepthPhoto& photo : photos) {
    most = std::max(most, DepthSweepBytes(photo.camera.width, photo.camera.height, kMaxSweepSteps,
                                          kNumMatched));
  }
  return static_cast<int>(std::clamp<int64_t>(kSweepBytes / most, 1, NumHardwareThreads()));
}

std::vector<const DepthMap*> MapsOf(const std::vector<DepthMap>& maps,
                                    const std::vector<int>& indices) {
  std::vector<const DepthMap*> chosen;
  for (const int i : indices) chosen.push_back(&maps[i]);
  return chosen;
}

std::vector<DepthMap> SweepAll(const DepthInput& input, const std::function<void()>& on_photo) {
  std::vector<DepthMap> maps(input.photos.size());
  std::atomic<size_t> next{0};
  RunOnThreads(NumSweepThreads(input.photos), [&](int) {
    DepthSweep sweep;
    for (size_t i = next++; i < maps.size(); i = next++) {
      maps[i] = SweepPhoto(input, i, &sweep);
      on_photo();
    }
  });
  return maps;
}

}  // namespace

std::vector<std::vector<int>> DepthInput::Confirming() const {
  std::vector<std::vector<int>> confirming = neighbours;
  for (size_t i = 0; i < neighbours.size(); ++i) {
    for (const int other : neighbours[i]) {
      std::vector<int>& back = confirming[other];
      const int index = static_cast<int>(i);
      if (std::find(back.begin(), back.end(), index) == back.end()) back.push_back(index);
    }
  }
  return confirming;
}

Result<DepthInput> ReadDepthInput(const DepthScene& scene, int size_px, const ScenePhoto& photo) {
  DepthInput input;
  if (Status status = ReadPhotos(scene, size_px, photo, &input); !status.ok()) {
    return status;
  }
  input.neighbours.resize(scene.photos.size());
  ForEachOnThreads(NumHardwareThreads(), scene.photos.size(), [&](size_t i) {
    input.neighbours[i] =
        ChooseNeighbours(scene.photos, scene.points, static_cast<int>(i), kNumConfirming);
  });
  for (const SparsePhoto& sparse : scene.photos) {
    input.ranges.push_back(RangeOfPoints(sparse, scene.points));
  }
  return input;
}

DepthMap SweepPhoto(const DepthInput& input, size_t index, DepthSweep* sweep) {
  std::vector<const DepthPhoto*> matched;
  for (const int other : input.neighbours[index]) {
    if (matched.size() < kNumMatched) matched.push_back(&input.photos[other]);
  }
  // Without neighbours all pixels are holes, whatever the range.
  const std::optional<DepthRange>& range = input.ranges[index];
  if (!range) matched.clear();
  return *sweep->Estimate(input.photos[index], matched, range.value_or(DepthRange{1, 2}));
}

std::vector<DepthMap> AgreedMaps(const std::vector<DepthMap>& maps,
                                 const std::vector<std::vector<int>>& confirming) {
  std::vector<DepthMap> agreed(maps.size());
  ForEachOnThreads(NumHardwareThreads(), maps.size(),
                   [&](size_t i) { agreed[i] = KeepAgreed(maps[i], MapsOf(maps, confirming[i])); });
  return agreed;
}

double MeanCompleteness(const std::vector<DepthMap>& maps) {
  double sum = 0;
  for (const DepthMap& map : maps) sum += map.Completeness();
  return maps.empty() ? 0 : sum / static_cast<double>(maps.size());
}

std::vector<std::vector<DensePoint>> ModelDepths::Points() const {
  std::vector<std::vector<DensePoint>> points(maps.size());
  ForEachOnThreads(NumHardwareThreads(), maps.size(), [&](size_t i) {
    points[i] = PointsOf(maps[i], colours[i], MapsOf(maps, confirming[i]));
  });
  return points;
}

Result<ModelDepths> MakeModelDepths(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                                    const std::function<void()>& on_photo) {
  Result<DepthInput> input = ReadDepthInput(scene, size_px, photo);
  if (!input.ok()) return input.status();
  const std::vector<DepthMap> maps = SweepAll(*input, on_photo);
  input->photos.clear();
  std::vector<std::vector<int>> confirming = input->Confirming();
  std::vector<DepthMap> agreed = AgreedMaps(maps, confirming);
  return ModelDepths{std::move(agreed), std::move(input->colours), std::move(confirming)};
}

}  // namespace skein
