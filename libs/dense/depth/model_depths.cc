#include "depth/model_depths.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "core/threads.h"
#include "depth/consistency.h"
#include "depth/photo_table.h"

namespace skein {
namespace {

constexpr int64_t kSweepBytes = int64_t{2} << 30;  // of all threads

// Files that hold pixels; nullptr: memory does.
struct PixelFiles {
  std::unique_ptr<ScratchFile> working;  // of the photos and of the sweeps' maps
  std::unique_ptr<ScratchFile> kept;     // of the agreed maps, their masks and the colours
};

template <typename T>
cv::Mat_<T> KeepIn(ScratchFile* file, const cv::Mat_<T>& pixels) {
  return file == nullptr ? pixels : file->Keep(pixels);
}

DepthMap KeepIn(ScratchFile* file, DepthMap map) {
  map.depth = KeepIn(file, map.depth);
  map.error = KeepIn(file, map.error);
  return map;
}

// Photos of one camera follow each other, so that one table is enough.
std::vector<size_t> ByCamera(const DepthScene& scene) {
  std::vector<size_t> order(scene.photos.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return scene.cameras[a] < scene.cameras[b]; });
  return order;
}

bool IsFirstOfCamera(const DepthScene& scene, const std::vector<size_t>& order, size_t k) {
  return k == 0 || scene.cameras[order[k]] != scene.cameras[order[k - 1]];
}

Result<PixelFiles> MakePixelFiles(const DepthScene& scene, int size_px,
                                  const std::filesystem::path& folder) {
  const std::vector<size_t> order = ByCamera(scene);
  int64_t working = 0, kept = 0, pixels = 0;
  const auto bytes = [&](size_t a_pixel) {
    return ScratchFile::BytesFor(static_cast<int64_t>(a_pixel) * pixels);
  };
  for (size_t k = 0; k < order.size(); ++k) {
    if (IsFirstOfCamera(scene, order, k)) {
      const DepthCamera camera = PhotoTable::CameraOf(scene.lenses[order[k]], size_px);
      pixels = int64_t{camera.width} * camera.height;
      working += bytes(sizeof(uint8_t));  // DepthPhoto::valid
    }
    working += bytes(sizeof(uint8_t)) + 2 * bytes(sizeof(float));
    kept += bytes(sizeof(cv::Vec3b)) + 2 * bytes(sizeof(float)) + bytes(sizeof(uint8_t));
  }
  PixelFiles files;
  auto file = ScratchFile::Make(folder, working);
  if (!file.ok()) return file.status();
  files.working = *std::move(file);
  file = ScratchFile::Make(folder, kept);
  if (!file.ok()) return file.status();
  files.kept = *std::move(file);
  return files;
}

Status ReadPhotos(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                  const PixelFiles& files, DepthInput* input) {
  input->colours.resize(scene.photos.size());
  input->photos.resize(scene.photos.size());
  const std::vector<size_t> order = ByCamera(scene);
  std::optional<PhotoTable> table;
  cv::Mat1b valid;
  for (size_t k = 0; k < order.size(); ++k) {
    const size_t i = order[k];
    const Result<cv::Mat3b> pixels = photo(i);
    if (!pixels.ok()) return pixels.status();
    if (IsFirstOfCamera(scene, order, k)) {
      table.emplace(scene.lenses[i], size_px);
      valid = KeepIn(files.working.get(), table->valid());
    }
    input->colours[i] = KeepIn(files.kept.get(), table->Apply(*pixels));
    cv::Mat1b grey;
    cv::cvtColor(*pixels, grey, cv::COLOR_BGR2GRAY);
    DepthPhoto read = table->Apply(grey, scene.photos[i].cam_from_world);
    read.grey = KeepIn(files.working.get(), read.grey);
    read.valid = valid;
    input->photos[i] = std::move(read);
  }
  return Status::Ok();
}

Result<DepthInput> ReadInput(const DepthScene& scene, int size_px, const ScenePhoto& photo,
                             const PixelFiles& files) {
  DepthInput input;
  if (Status status = ReadPhotos(scene, size_px, photo, files, &input); !status.ok()) {
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

std::vector<DepthMap> SweepAll(const DepthInput& input, const std::function<void()>& on_photo,
                               ScratchFile* file) {
  std::vector<DepthMap> maps(input.photos.size());
  std::atomic<size_t> next{0};
  RunOnThreads(NumSweepThreads(input.photos), [&](int) {
    DepthSweep sweep;
    for (size_t i = next++; i < maps.size(); i = next++) {
      maps[i] = KeepIn(file, SweepPhoto(input, i, &sweep));
      on_photo();
    }
  });
  return maps;
}

std::vector<DepthMap> AgreedIn(ScratchFile* file, const std::vector<DepthMap>& maps,
                               const std::vector<std::vector<int>>& confirming) {
  std::vector<DepthMap> agreed(maps.size());
  ForEachOnThreads(NumHardwareThreads(), maps.size(), [&](size_t i) {
    agreed[i] = KeepIn(file, KeepAgreed(maps[i], MapsOf(maps, confirming[i])));
  });
  return agreed;
}

std::vector<cv::Mat1b> MasksIn(ScratchFile* file, const std::vector<DepthMap>& maps,
                               const std::vector<DepthMap>& agreed,
                               const std::vector<std::vector<int>>& confirming) {
  std::vector<cv::Mat1b> masks(maps.size());
  ForEachOnThreads(NumHardwareThreads(), maps.size(), [&](size_t i) {
    masks[i] = KeepIn(
        file, StaticMask(maps[i], MapsOf(maps, confirming[i]), MapsOf(agreed, confirming[i])));
  });
  return masks;
}

// All masks are made before a depth is left out, so the order of the maps does not matter.
CheckedDepths CheckIn(ScratchFile* file, const std::vector<DepthMap>& maps,
                      const std::vector<std::vector<int>>& confirming) {
  CheckedDepths checked;
  checked.maps = AgreedIn(file, maps, confirming);
  checked.masks = MasksIn(file, maps, checked.maps, confirming);
  for (size_t i = 0; i < maps.size(); ++i) {
    const cv::Mat1b is_contradicted = checked.masks[i] == 0;
    checked.maps[i].MakeHoles(is_contradicted);
    checked.counts.push_back(CountDepths(maps[i], checked.maps[i], checked.masks[i]));
  }
  return checked;
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
  return ReadInput(scene, size_px, photo, PixelFiles());
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

CheckedDepths CheckDepths(const std::vector<DepthMap>& maps,
                          const std::vector<std::vector<int>>& confirming) {
  return CheckIn(nullptr, maps, confirming);
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
                                    const std::function<void()>& on_photo,
                                    const std::filesystem::path& folder) {
  Result<PixelFiles> files = MakePixelFiles(scene, size_px, folder);
  if (!files.ok()) return files.status();
  Result<DepthInput> input = ReadInput(scene, size_px, photo, *files);
  if (!input.ok()) return input.status();
  const std::vector<DepthMap> maps = SweepAll(*input, on_photo, files->working.get());
  std::vector<std::vector<int>> confirming = input->Confirming();
  CheckedDepths checked = CheckIn(files->kept.get(), maps, confirming);
  return ModelDepths{std::move(checked), std::move(files->kept), std::move(input->colours),
                     std::move(confirming)};
}

}  // namespace skein
