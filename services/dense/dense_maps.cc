#include "dense/dense_maps.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>
#include <random>
#include <utility>

#include "core/hash.h"
#include "core/statistics.h"
#include "dense/box_steps.h"
#include "depth/agreement.h"
#include "depth/consistency.h"
#include "depth/depth_scene.h"
#include "formats/dense.h"

namespace skein {

// How a depth map fits the sparse points that its photo sees.
struct DenseMaps::Fit {
  double ratio = 0;  // median of a point's depth over the map's
  double share = 0;  // of the points, of those that lie on the map at this ratio
};

namespace {

constexpr size_t kMinNeighbours = kMinAgreeing;
constexpr size_t kMinSamples = 8;     // sparse points with a depth, to tell a scale
constexpr double kScaleStep = 0.002;  // a fifth of what two maps may differ by
constexpr double kMisfit = 0.5;       // of the share of sparse points that fitted a new map
constexpr double kMaxShiftPx = 1;     // of a depth map, when the camera is refined
constexpr int kMaxSweepsForBetter = 2;
constexpr double kGrowth = 1.25;  // of the submap, before neighbours are looked at again
constexpr int kChunkBits = 16;    // of a chunk's id: its number in the photo

bool IsSame(const Camera& a, const Camera& b) {
  return a.ModelId() == b.ModelId() && a.Params() == b.Params() && a.Width() == b.Width() &&
         a.Height() == b.Height();
}

// Pixels of a depth map between where two calibrations of a camera show a direction, the most over
// the photo.
double ShiftPx(const Camera& a, const Camera& b, int size_px) {
  if (IsSame(a, b)) return 0;
  if (a.Width() != b.Width() || a.Height() != b.Height()) return HUGE_VAL;
  const double width = static_cast<double>(a.Width()), height = static_cast<double>(a.Height());
  double most = 0;
  for (const double x : {0.0, 0.5, 1.0}) {
    for (const double y : {0.0, 0.5, 1.0}) {
      const Eigen::Vector2d ray((x * width - a.PrincipalPointX()) / a.FocalLengthX(),
                                (y * height - a.PrincipalPointY()) / a.FocalLengthY());
      const double shift = (b.WorldToImage(ray) - a.WorldToImage(ray)).norm();
      if (std::isfinite(shift)) most = std::max(most, shift);
    }
  }
  return most * std::min(1.0, size_px / std::max(width, height));
}

struct CameraPoint {
  Eigen::Vector3d position;
  const DensePoint* point;
};

// Near points first, so that a chunk's box, and its step, is in proportion to its distance;
// shuffled within a chunk, so that a prefix is a sample.
std::vector<std::vector<CameraPoint>> Deal(const std::vector<DensePoint>& points,
                                           const DepthPose& pose, uint32_t seed) {
  std::vector<CameraPoint> all;
  all.reserve(points.size());
  for (const DensePoint& point : points) {
    all.push_back({pose.ToCamera(point.position), &point});
  }
  std::stable_sort(all.begin(), all.end(), [](const CameraPoint& a, const CameraPoint& b) {
    return a.position.z() < b.position.z();
  });
  std::mt19937 random(seed);
  std::vector<std::vector<CameraPoint>> chunks;
  for (size_t begin = 0; begin < all.size(); begin += ShapeChunk::kMaxPoints) {
    const size_t end = std::min(all.size(), begin + ShapeChunk::kMaxPoints);
    chunks.emplace_back(all.begin() + static_cast<int64_t>(begin),
                        all.begin() + static_cast<int64_t>(end));
    std::shuffle(chunks.back().begin(), chunks.back().end(), random);
  }
  return chunks;
}

uint8_t ConfidenceOf(const DensePoint& point) {
  const double confidence = 1 - point.relative_error / kMaxDepthDifference;
  return static_cast<uint8_t>(std::lround(255 * std::clamp(confidence, 0.0, 1.0)));
}

ShapeChunk ChunkOf(const std::vector<CameraPoint>& points, uint64_t version) {
  Eigen::AlignedBox3d box;
  for (const CameraPoint& point : points) box.extend(point.position);
  const BoxSteps steps(box);
  ShapeChunk chunk;
  chunk.version = version;
  Eigen::Vector3d::Map(chunk.origin.data()) = box.min();
  chunk.step = steps.step();
  for (const CameraPoint& point : points) {
    ShapePoint packed;
    packed.xyz = steps.Of(point.position);
    for (int i = 0; i < 3; ++i) packed.rgb[i] = point.point->colour[2 - i];
    packed.num_photos = ConfidenceOf(*point.point);
    chunk.points.push_back(packed);
  }
  return chunk;
}

}  // namespace

struct DenseMaps::Photo {
  int64_t submap_id = 0;  // 0: none that lives
  // Pixels and their camera; pixels.grey is empty where they are not here.
  DepthPhoto pixels;
  cv::Mat3b colours;
  Camera camera;
  Camera map_camera;  // of the pixels that the map was made of
  // The sweep's map, and the depths that others agree with; empty where there is none.
  DepthMap map, agreed;
  std::vector<uint32_t> neighbours;  // of the sweep, best first
  Fit fit;                           // when the map was new
  bool misfits = false;
  bool is_forgotten = false;  // its map was, for room
  int num_sweeps = 0;
  size_t looked_at = 0;  // photos of the submap when its neighbours were chosen
  DensePhotoPoints points;
  uint64_t revision = 0;    // of the depths that the points are of
  double sparse_depth = 0;  // median of what it sees, where its map was forgotten; 0: not known
  int64_t used = 0;

  bool has_pixels() const { return !pixels.grey.empty(); }
  bool has_map() const { return !map.depth.empty(); }
  int64_t bytes() const {
    return static_cast<int64_t>(pixels.grey.total() + 3 * colours.total() +
                                8 * (map.depth.total() + agreed.depth.total()));
  }
  void DropMaps() {
    pixels = {};
    colours.release();
    map = agreed = {};
  }
};

std::optional<DenseMaps::Fit> DenseMaps::FitOf(const DepthMap& map, const SparsePhoto& photo,
                                               const std::vector<Eigen::Vector3d>& points) {
  std::vector<double> ratios;
  for (const int i : photo.points) {
    const Eigen::Vector3d point = photo.cam_from_world.ToCamera(points[i]);
    if (!(point.z() > 0)) continue;
    const Eigen::Vector2d pixel = map.camera.Pixel(point.hnormalized());
    const bool is_inside =
        pixel.minCoeff() >= 0 && pixel.x() < map.depth.cols && pixel.y() < map.depth.rows;
    if (!is_inside) continue;
    const float depth = map.depth(static_cast<int>(pixel.y()), static_cast<int>(pixel.x()));
    if (depth > 0) ratios.push_back(point.z() / depth);
  }
  if (ratios.size() < kMinSamples) return std::nullopt;
  Fit fit;
  fit.ratio = UpperMedian(ratios);
  const auto fits = std::count_if(ratios.begin(), ratios.end(), [&](double ratio) {
    return std::abs(ratio / fit.ratio - 1) <= kMaxDepthDifference;
  });
  fit.share = static_cast<double>(fits) / static_cast<double>(ratios.size());
  return fit;
}

DenseMaps::DenseMaps(int size_px, int64_t max_bytes, std::function<void()> on_progress)
    : size_px_(size_px), max_bytes_(max_bytes), on_progress_(std::move(on_progress)) {}

DenseMaps::~DenseMaps() = default;

// ---- Shapes ----

Status DenseMaps::Update(const Shape& shape) {
  SparseScene& scene = scenes_[shape.submap_id];
  if (Status taken = scene.Update(shape); !taken.ok()) {
    DropSubmap(shape.submap_id);
    return taken;
  }
  no_task_.clear();
  for (auto& [id, photo] : photos_) {
    if (photo.submap_id == shape.submap_id && scene.Find(id) < 0) Leave(&photo);
  }
  for (size_t i = 0; i < scene.photos().size(); ++i) {
    TakePose(scene, static_cast<int>(i), shape.submap_id);
  }
  TakeOrphans();
  return Status::Ok();
}

void DenseMaps::Leave(Photo* photo) {
  photo->submap_id = 0;
  if (!photo->points.chunks.empty()) ++changes_;
}

// A photo that one submap gave up may be in another one, whose shape came before.
void DenseMaps::TakeOrphans() {
  for (const auto& [submap_id, scene] : scenes_) {
    for (size_t i = 0; i < scene.photos().size(); ++i) {
      const auto photo = photos_.find(scene.image_ids()[i]);
      const bool is_orphan = photo != photos_.end() && photo->second.submap_id == 0;
      if (is_orphan) TakePose(scene, static_cast<int>(i), submap_id);
    }
  }
  EraseEmpty();
}

// The photos that are in no submap, and of which nothing is kept.
void DenseMaps::EraseEmpty() {
  for (auto photo = photos_.begin(); photo != photos_.end();) {
    const bool is_empty = photo->second.submap_id == 0 && photo->second.bytes() == 0 &&
                          photo->second.points.chunks.empty();
    photo = is_empty ? photos_.erase(photo) : std::next(photo);
  }
}

void DenseMaps::TakePose(const SparseScene& scene, int index, int64_t submap_id) {
  const uint32_t id = scene.image_ids()[index];
  if (left_out_.count(id) > 0) return;
  Photo& photo = photos_[id];
  const bool is_new_here = photo.submap_id != submap_id;
  if (is_new_here && !photo.points.chunks.empty()) ++changes_;
  photo.submap_id = submap_id;
  const SparsePhoto& sparse = scene.photos()[index];
  photo.pixels.cam_from_world = photo.map.cam_from_world = photo.agreed.cam_from_world =
      sparse.cam_from_world;
  if (photo.has_map()) return FitScale(sparse, scene.points(), is_new_here, &photo);
  if (photo.points.chunks.empty()) return;
  const double depth = UpperMedian(DepthsOfPoints(sparse, scene.points()));
  if (is_new_here && depth > 0 && photo.sparse_depth > 0) {
    photo.points.scale *= depth / photo.sparse_depth;
  }
  photo.sparse_depth = depth;
}

// In another submap nothing is known of a map that has too few points to fit.
void DenseMaps::FitScale(const SparsePhoto& sparse, const std::vector<Eigen::Vector3d>& points,
                         bool is_new_here, Photo* photo) {
  const auto fit = FitOf(photo->map, sparse, points);
  const double scale = fit ? fit->ratio / photo->fit.ratio : 0;
  if (!(scale > 0) || !std::isfinite(scale)) {
    if (!is_new_here) return;
    photo->misfits = true;
    photo->points = {};
    return;
  }
  if (std::abs(scale - 1) > kScaleStep) {
    ScaleDepths(scale, &photo->map);
    ScaleDepths(scale, &photo->agreed);
    photo->points.scale *= scale;
    if (!photo->points.chunks.empty()) ++changes_;
  }
  photo->misfits = fit->share < kMisfit * photo->fit.share;
}

void DenseMaps::DropSubmap(int64_t submap_id) {
  scenes_.erase(submap_id);
  for (auto& [id, photo] : photos_) {
    if (photo.submap_id == submap_id) Leave(&photo);
  }
  TakeOrphans();
}

void DenseMaps::LeaveOut(uint32_t image_id) {
  left_out_.insert(image_id);
  dirty_.erase(image_id);
  if (const auto photo = photos_.find(image_id); photo != photos_.end()) {
    Leave(&photo->second);
    photos_.erase(photo);
  }
}

// ---- Tasks ----

std::optional<DenseTask> DenseMaps::Next() {
  for (auto photo = photos_.rbegin(); photo != photos_.rend(); ++photo) {
    on_progress_();
    if (!IsWaiting(photo->first, photo->second)) continue;
    if (auto task = TaskFor(photo->first, photo->second)) return task;
    no_task_.insert(photo->first);
  }
  for (auto& [id, photo] : photos_) {
    on_progress_();
    const bool may_change = photo.submap_id != 0 && photo.has_map() && no_task_.count(id) == 0;
    if (!may_change || (!IsOutdated(id, photo) && !FindsBetterNeighbours(id, &photo))) continue;
    no_task_.insert(id);  // one try a shape, whatever comes of it
    if (auto task = TaskFor(id, photo)) return task;
  }
  return std::nullopt;
}

bool DenseMaps::IsWaiting(uint32_t image_id, const Photo& photo) const {
  return photo.submap_id != 0 && !photo.has_map() && !photo.is_forgotten &&
         no_task_.count(image_id) == 0;
}

// The sparse points contradict the map, or the camera was refined.
bool DenseMaps::IsOutdated(uint32_t image_id, const Photo& photo) const {
  return photo.misfits || HasMoved(image_id, photo, photo.map_camera);
}

// `camera`: of what the photo has, against the one of now.
bool DenseMaps::HasMoved(uint32_t image_id, const Photo& photo, const Camera& camera) const {
  const SparseScene& scene = scenes_.at(photo.submap_id);
  return ShiftPx(camera, scene.CameraOf(scene.Find(image_id)), size_px_) > kMaxShiftPx;
}

// Looked at again whenever the submap has grown by a quarter.
bool DenseMaps::FindsBetterNeighbours(uint32_t image_id, Photo* photo) const {
  const SparseScene& scene = scenes_.at(photo->submap_id);
  const size_t size = scene.photos().size();
  if (photo->num_sweeps >= kMaxSweepsForBetter ||
      static_cast<double>(size) < kGrowth * static_cast<double>(photo->looked_at)) {
    return false;
  }
  photo->looked_at = size;
  const std::vector<uint32_t> now = Matched(NeighboursOf(scene, image_id));
  const std::vector<uint32_t> then = Matched(photo->neighbours);
  const auto num_new = std::count_if(now.begin(), now.end(), [&](uint32_t id) {
    return std::find(then.begin(), then.end(), id) == then.end();
  });
  return num_new >= static_cast<int>(kMinNeighbours);
}

std::vector<uint32_t> DenseMaps::Matched(std::vector<uint32_t> neighbours) {
  if (neighbours.size() > kNumMatched) neighbours.resize(kNumMatched);
  return neighbours;
}

std::vector<uint32_t> DenseMaps::NeighboursOf(const SparseScene& scene, uint32_t image_id) const {
  std::vector<uint32_t> ids;
  for (const int other : ChooseNeighbours(scene.photos(), scene.points(), scene.Find(image_id),
                                          kNumConfirming + left_out_.size())) {
    const uint32_t id = scene.image_ids()[other];
    const auto photo = photos_.find(id);  // none: left out
    const bool is_here =
        photo != photos_.end() && photo->second.submap_id == photos_.at(image_id).submap_id;
    if (is_here && ids.size() < kNumConfirming) ids.push_back(id);
  }
  return ids;
}

// nullopt: too few neighbours to confirm a depth.
std::optional<DenseTask> DenseMaps::TaskFor(uint32_t image_id, const Photo& photo) const {
  DenseTask task;
  task.image_id = image_id;
  task.neighbours = NeighboursOf(scenes_.at(photo.submap_id), image_id);
  if (task.neighbours.size() < kMinNeighbours) return std::nullopt;
  std::vector<uint32_t> shown = Matched(task.neighbours);
  shown.push_back(image_id);
  for (const uint32_t id : shown) {
    const Photo& other = photos_.at(id);
    if (!other.has_pixels() || HasMoved(id, other, other.camera)) task.wanted.push_back(id);
  }
  return task;
}

Status DenseMaps::SetPhoto(uint32_t image_id, const cv::Mat3b& image) {
  const auto found = photos_.find(image_id);
  if (found == photos_.end() || found->second.submap_id == 0) return Status::Ok();
  Photo& photo = found->second;
  const SparseScene& scene = scenes_.at(photo.submap_id);
  const int index = scene.Find(image_id);
  photo.camera = scene.CameraOf(index);
  try {
    const PhotoTable& table = TableOf(photo.camera);
    cv::Mat1b grey;
    cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    photo.pixels = table.Apply(grey, scene.photos()[index].cam_from_world);
    photo.colours = table.Apply(image);
    photo.used = ++clock_;
  } catch (const std::invalid_argument& error) {
    return InvalidArgument(error.what());
  }
  return Status::Ok();
}

const PhotoTable& DenseMaps::TableOf(const Camera& camera) {
  if (!table_ || !IsSame(table_camera_, camera)) {
    table_.emplace(LensOf(camera), size_px_);
    table_camera_ = camera;
  }
  return *table_;
}

// ---- Depth maps and points ----

void DenseMaps::Make(const DenseTask& task, int64_t utime_us) {
  if (MakeMap(task)) {
    for (const uint32_t id : Confirming(task.image_id)) dirty_.insert(id);
    Refine(task.image_id, utime_us);
  } else {
    no_task_.insert(task.image_id);
  }
  Forget();
}

// False: the photo or its neighbours are not here.
bool DenseMaps::MakeMap(const DenseTask& task) {
  const auto found = photos_.find(task.image_id);
  if (found == photos_.end() || found->second.submap_id == 0) return false;
  Photo& photo = found->second;
  std::vector<const DepthPhoto*> neighbours;
  for (const uint32_t id : Matched(task.neighbours)) {
    const auto other = photos_.find(id);
    const bool is_here = other != photos_.end() && other->second.submap_id == photo.submap_id &&
                         other->second.has_pixels();
    if (!is_here) continue;
    other->second.used = ++clock_;
    neighbours.push_back(&other->second.pixels);
  }
  const SparseScene& scene = scenes_.at(photo.submap_id);
  const SparsePhoto& sparse = scene.photos()[scene.Find(task.image_id)];
  const auto range = RangeOfPoints(sparse, scene.points());
  if (!range || !photo.has_pixels() || neighbours.size() < kMinNeighbours) return false;
  photo.map = *sweep_.Estimate(photo.pixels, neighbours, *range, [this] {
    on_progress_();
    return false;
  });
  photo.agreed = {};
  photo.map_camera = photo.camera;
  photo.neighbours = task.neighbours;
  photo.fit = FitOf(photo.map, sparse, scene.points()).value_or(Fit{1, 0});
  photo.misfits = false;
  photo.looked_at = scene.photos().size();
  ++photo.num_sweeps;
  photo.used = ++clock_;
  return true;
}

std::optional<uint32_t> DenseMaps::NextToRefine() {
  if (dirty_.empty()) return std::nullopt;
  return *dirty_.rbegin();
}

// The photo's neighbours, and the photos whose neighbour it is, as far as they have a depth map.
std::set<uint32_t> DenseMaps::Confirming(uint32_t image_id) const {
  const Photo& photo = photos_.at(image_id);
  std::set<uint32_t> ids(photo.neighbours.begin(), photo.neighbours.end());
  for (const auto& [id, other] : photos_) {
    const auto& theirs = other.neighbours;
    if (std::find(theirs.begin(), theirs.end(), image_id) != theirs.end()) ids.insert(id);
  }
  for (auto id = ids.begin(); id != ids.end();) {
    const auto other = photos_.find(*id);
    const bool confirms = other != photos_.end() && other->second.has_map() &&
                          other->second.submap_id == photo.submap_id;
    id = confirms ? std::next(id) : ids.erase(id);
  }
  return ids;
}

void DenseMaps::Refine(uint32_t image_id, int64_t utime_us) {
  dirty_.erase(image_id);
  const auto found = photos_.find(image_id);
  if (found == photos_.end()) return;
  Photo& photo = found->second;
  const bool has_colours = photo.colours.size() == photo.map.depth.size();
  if (photo.submap_id == 0 || !photo.has_map() || !has_colours) return;
  std::vector<const DepthMap*> maps, agreed;
  for (const uint32_t id : Confirming(image_id)) {
    const Photo& other = photos_.at(id);
    maps.push_back(&other.map);
    if (!other.agreed.depth.empty()) agreed.push_back(&other.agreed);
  }
  if (maps.size() < kMinNeighbours) return;
  photo.agreed = KeepAgreed(photo.map, maps);
  Publish(image_id, PointsOf(photo.agreed, photo.colours, agreed), utime_us, &photo);
}

void DenseMaps::Publish(uint32_t image_id, const std::vector<DensePoint>& points, int64_t utime_us,
                        Photo* photo) {
  photo->points = {};
  photo->points.share = static_cast<float>(static_cast<double>(points.size()) /
                                           static_cast<double>(photo->agreed.depth.total()));
  for (const auto& dealt : Deal(points, photo->agreed.cam_from_world, image_id)) {
    const auto version = static_cast<uint64_t>(utime_us);
    const uint64_t id = (uint64_t{image_id} << kChunkBits) | photo->points.chunks.size();
    auto bytes = std::make_shared<const Bytes>(EncodeShapeChunk(ChunkOf(dealt, version)));
    std::string blob_id = HashBytes(bytes->data(), bytes->size());
    photo->points.chunks.push_back(
        {id, version, static_cast<uint32_t>(dealt.size()), std::move(bytes), std::move(blob_id)});
  }
  photo->revision = ++changes_;
}

// Points stay: they are what is published.
void DenseMaps::Forget() {
  int64_t bytes = memory_bytes();
  while (bytes > max_bytes_) {
    auto oldest = photos_.end();
    for (auto photo = photos_.begin(); photo != photos_.end(); ++photo) {
      if (photo->second.bytes() == 0) continue;
      if (oldest == photos_.end() || photo->second.used < oldest->second.used) oldest = photo;
    }
    if (oldest == photos_.end()) return;
    bytes -= oldest->second.bytes();
    ForgetPixels(oldest->first, &oldest->second);
  }
}

// The next shape may be that of another submap, with another unit.
void DenseMaps::ForgetPixels(uint32_t image_id, Photo* photo) {
  photo->is_forgotten |= photo->has_map();
  if (photo->submap_id != 0) {
    const SparseScene& scene = scenes_.at(photo->submap_id);
    const SparsePhoto& sparse = scene.photos()[scene.Find(image_id)];
    photo->sparse_depth = UpperMedian(DepthsOfPoints(sparse, scene.points()));
  }
  photo->DropMaps();
}

// ---- Figures ----

std::map<uint32_t, DensePhotoPoints> DenseMaps::PointsOfSubmap(int64_t submap_id) const {
  std::map<uint32_t, DensePhotoPoints> points;
  for (const auto& [id, photo] : photos_) {
    if (photo.submap_id == submap_id && !photo.points.chunks.empty()) points[id] = photo.points;
  }
  return points;
}

std::map<uint32_t, ConfirmedMap> DenseMaps::ConfirmedOf(int64_t submap_id) const {
  std::map<uint32_t, ConfirmedMap> maps;
  const auto scene = scenes_.find(submap_id);
  if (scene == scenes_.end()) return maps;
  for (const auto& [id, photo] : photos_) {
    if (photo.submap_id != submap_id || photo.points.chunks.empty()) continue;
    const int index = scene->second.Find(id);
    if (index < 0) continue;
    ConfirmedMap& map = maps[id];
    map = {photo.agreed, photo.colours, photo.points.scale, photo.revision};
    map.map.cam_from_world = scene->second.photos()[index].cam_from_world;
  }
  return maps;
}

size_t DenseMaps::num_waiting() const {
  return std::count_if(photos_.begin(), photos_.end(),
                       [this](const auto& photo) { return IsWaiting(photo.first, photo.second); });
}

int64_t DenseMaps::memory_bytes() const {
  return std::accumulate(photos_.begin(), photos_.end(), int64_t{0},
                         [](int64_t sum, const auto& photo) { return sum + photo.second.bytes(); });
}

}  // namespace skein
