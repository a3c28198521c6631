#include "dense/live_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "core/hash.h"
#include "core/log.h"
#include "core/statistics.h"
#include "dense/box_steps.h"
#include "depth/coloured_map.h"
#include "formats/mesh_chunk.h"
#include "surface/surface_nets.h"
#include "surface/surface_volume.h"

namespace skein {
namespace {

constexpr int kCubeBlocks = 4;          // 32 voxels
constexpr int kMostLevel = 6;           // a map of 400 x 300 has 7 x 5 pixels then
constexpr double kMostVoxelChange = 2;  // of the ground sampling distance, until voxels follow
constexpr int kMapsBetweenMeshes = 8;   // while many wait
constexpr size_t kFramePhotos = 32;
// A chunk's id: the cube's index along each axis, 17 bits each, as browsers have integers of 53.
constexpr int kAxisBits = 17;
constexpr int kMostCube = 1 << (kAxisBits - 1);

int CubeOf(int block) { return (block - (block < 0 ? kCubeBlocks - 1 : 0)) / kCubeBlocks; }

bool HasId(const BlockIndex& cube) {
  const auto fits = [](int i) { return i >= -kMostCube && i < kMostCube; };
  return fits(cube.x) && fits(cube.y) && fits(cube.z);
}

uint64_t IdOf(const BlockIndex& cube) {
  const auto part = [](int i) { return static_cast<uint64_t>(i + kMostCube); };
  return part(cube.x) | part(cube.y) << kAxisBits | part(cube.z) << (2 * kAxisBits);
}

// Cubes whose triangles depend on a block: a vertex on the next block's samples, a triangle on the
// vertices of blocks below.
void AddCubesAround(const BlockIndex& block, std::set<BlockIndex>* cubes) {
  for (int i = 0; i < 27; ++i) {
    const BlockIndex near = block.Plus(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
    cubes->insert({CubeOf(near.x), CubeOf(near.y), CubeOf(near.z)});
  }
}

template <class T>
cv::Mat_<T> EverySecond(const cv::Mat_<T>& pixels) {
  cv::Mat_<T> half((pixels.rows + 1) / 2, (pixels.cols + 1) / 2);
  for (int y = 0; y < half.rows; ++y) {
    for (int x = 0; x < half.cols; ++x) half(y, x) = pixels(2 * y, 2 * x);
  }
  return half;
}

// Pixel (x, y) of the result is pixel (2 x, 2 y), so x + 0.5 = (2 x + 0.5) / 2 + 0.25.
ConfirmedMap Halved(const ConfirmedMap& of) {
  ConfirmedMap half = of;
  half.map.depth = EverySecond(of.map.depth);
  half.map.error = EverySecond(of.map.error);
  half.colours = EverySecond(of.colours);
  DepthCamera& camera = half.map.camera;
  camera.width = half.map.depth.cols;
  camera.height = half.map.depth.rows;
  camera.focal_px /= 2;
  camera.principal_point_px = (camera.principal_point_px.array() / 2 + 0.25).matrix();
  return half;
}

void SetScale(double scale, ConfirmedMap* map) {
  if (scale == map->scale) return;
  ScaleDepths(scale / map->scale, &map->map);
  map->scale = scale;
}

// How far points at the map's corners move from one pose and scale to another. `depth`: at scale 1.
double Movement(const ConfirmedMap& from, const ConfirmedMap& to, double depth) {
  const DepthCamera& camera = from.map.camera;
  double most = 0;
  for (const double x : {0.0, 1.0}) {
    for (const double y : {0.0, 1.0}) {
      const Eigen::Vector3d point =
          depth * camera.Ray({x * camera.width, y * camera.height}).homogeneous();
      const Eigen::Vector3d moved = to.map.cam_from_world.ToWorld(to.scale * point) -
                                    from.map.cam_from_world.ToWorld(from.scale * point);
      most = std::max(most, moved.norm());
    }
  }
  return most;
}

int64_t BytesOf(const ConfirmedMap& map) {
  return static_cast<int64_t>(8 * map.map.depth.total() + 3 * map.colours.total());
}

ColouredMap Coloured(const ConfirmedMap& map) { return {&map.map, &map.colours, nullptr}; }

// Requires a triangle.
MeshChunk ChunkOf(const SurfaceMesh& mesh, uint64_t version) {
  Eigen::AlignedBox3d box;
  for (const MeshVertex& vertex : mesh.vertices) box.extend(vertex.position.cast<double>());
  const BoxSteps steps(box);
  MeshChunk chunk;
  chunk.version = version;
  Eigen::Vector3d::Map(chunk.origin.data()) = mesh.origin + box.min();
  chunk.step = steps.step();
  for (const MeshVertex& vertex : mesh.vertices) {
    chunk.vertices.push_back({steps.Of(vertex.position.cast<double>()), vertex.colour});
  }
  for (size_t i = 0; i < mesh.indices.size(); i += 3) {
    chunk.triangles.push_back({static_cast<uint16_t>(mesh.indices[i]),
                               static_cast<uint16_t>(mesh.indices[i + 1]),
                               static_cast<uint16_t>(mesh.indices[i + 2])});
  }
  return chunk;
}

}  // namespace

class LiveMesh::Submap {
 public:
  explicit Submap(int64_t max_bytes) : max_bytes_(max_bytes) {}

  void Update(const std::map<uint32_t, ConfirmedMap>& maps);
  // `is_changed`: the chunks are others. False: nothing was to do.
  bool Step(int64_t utime_us, bool* is_changed);
  void Coarsen();
  // A map found no room in the volume.
  bool is_full() const { return is_full_; }
  bool CanCoarsen() const { return level_ < kMostLevel; }
  SubmapMesh Mesh() const;
  double voxel() const { return volume_ == nullptr ? 0 : volume_->voxel(); }
  int64_t Bytes() const;
  int64_t NumTriangles() const;

 private:
  struct Photo {
    std::optional<ConfirmedMap> told;   // other depths, which a step prepares
    ConfirmedMap newest;                // of the level; without pixels until one is prepared
    std::optional<ConfirmedMap> added;  // as it is in the volume
    double pixel = 0, depth = 0;        // at scale 1: its width on the surface, and the median
    bool leaves = false;
  };
  struct Chunk {
    DenseManifest::Mesh::Chunk entry;
    std::shared_ptr<const skein::Bytes> bytes;
  };
  using Chunks = std::map<BlockIndex, Chunk>;

  static void Take(const ConfirmedMap& map, Photo* photo);
  bool PrepareOne();
  bool HasMoved(const Photo& photo) const;
  bool HaveMostMoved() const;
  double GroundSamplingDistanceOfAll() const;
  bool ChooseVoxel();
  void Begin();
  bool RemoveOne();
  bool AddOne();
  bool MakeOne(int64_t utime_us, bool* is_changed);
  void NoteStale();
  void MakeChunk(const BlockIndex& cube, int64_t utime_us, Chunks* chunks);
  void SetFrame();

  const int64_t max_bytes_;  // of the volume
  double finest_ = 0;        // ground sampling distance that the voxel follows
  int level_ = 0;
  std::unique_ptr<SurfaceVolume> volume_;
  std::map<uint32_t, Photo> photos_;
  std::set<BlockIndex> stale_;  // cubes whose chunks are to be made
  uint64_t noted_ = 0;          // version of the volume of which `stale_` knows
  int num_added_ = 0;           // maps, since chunks were made
  bool is_full_ = false;
  bool is_refilled_ = false;  // `next_` takes the place of `chunks_` when all maps are in
  Chunks chunks_, next_;
  double chunks_voxel_ = 0;
  std::vector<DenseManifest::Mesh::FramePhoto> frame_;  // of `chunks_`
  uint64_t last_version_ = 0;
};

// ---- Maps ----

void LiveMesh::Submap::Update(const std::map<uint32_t, ConfirmedMap>& maps) {
  for (auto& [id, photo] : photos_) photo.leaves = maps.count(id) == 0;
  for (const auto& [id, map] : maps) {
    const auto known = photos_.find(id);
    if (known == photos_.end() && !map.has_pixels()) continue;
    Take(map, known == photos_.end() ? &photos_[id] : &known->second);
  }
  if (!is_refilled_ && HaveMostMoved()) Begin();
}

// Depths that were forgotten before they came to the volume have none in it.
void LiveMesh::Submap::Take(const ConfirmedMap& map, Photo* photo) {
  ConfirmedMap& known = photo->told ? *photo->told : photo->newest;
  if (known.has_pixels() && known.revision == map.revision) {
    SetScale(map.scale, &known);
    known.map.cam_from_world = map.map.cam_from_world;
  } else if (map.has_pixels()) {
    photo->told = map;
  } else {
    photo->leaves = true;
  }
}

// The newest first. False: there is none.
bool LiveMesh::Submap::PrepareOne() {
  for (auto photo = photos_.rbegin(); photo != photos_.rend(); ++photo) {
    Photo& of = photo->second;
    if (!of.told) continue;
    of.newest = *std::exchange(of.told, std::nullopt);
    of.depth = of.newest.map.MedianDepth() / of.newest.scale;
    of.pixel = of.depth / of.newest.map.camera.focal_px.x();
    for (int i = 0; i < level_; ++i) of.newest = Halved(of.newest);
    return true;
  }
  return false;
}

bool LiveMesh::Submap::HasMoved(const Photo& photo) const {
  return photo.added && (photo.added->revision != photo.newest.revision ||
                         Movement(*photo.added, photo.newest, photo.depth) > volume_->voxel());
}

bool LiveMesh::Submap::HaveMostMoved() const {
  int num_moved = 0, num_in = 0;
  for (const auto& [id, photo] : photos_) {
    num_in += photo.added.has_value();
    num_moved += HasMoved(photo);
  }
  return 2 * num_moved > num_in;
}

double LiveMesh::Submap::GroundSamplingDistanceOfAll() const {
  std::vector<double> sizes;
  for (const auto& [id, photo] : photos_) {
    if (photo.pixel > 0) sizes.push_back(photo.pixel * photo.newest.scale);
  }
  return UpperMedian(std::move(sizes));
}

// False: no map has a surface.
bool LiveMesh::Submap::ChooseVoxel() {
  const double size = GroundSamplingDistanceOfAll();
  if (!(size > 0)) return volume_ != nullptr;
  const double change = finest_ > 0 ? size / finest_ : 0;
  if (change < 1 / kMostVoxelChange || change > kMostVoxelChange) {
    finest_ = size;
    Begin();
  }
  return true;
}

// A new volume, to be filled with all maps.
void LiveMesh::Submap::Begin() {
  SurfaceOptions options;
  options.voxel = std::ldexp(finest_, level_);
  options.max_bytes = max_bytes_;
  options.num_threads = 1;
  volume_ = std::make_unique<SurfaceVolume>(options);
  for (auto& [id, photo] : photos_) photo.added.reset();
  stale_.clear();
  next_.clear();
  noted_ = 0;
  num_added_ = 0;
  is_full_ = false;
  is_refilled_ = !chunks_.empty();
}

void LiveMesh::Submap::Coarsen() {
  ++level_;
  for (auto& [id, photo] : photos_) {
    if (photo.newest.has_pixels()) photo.newest = Halved(photo.newest);
  }
  if (volume_ != nullptr) Begin();
}

// ---- Steps ----

bool LiveMesh::Submap::Step(int64_t utime_us, bool* is_changed) {
  // The first voxel follows all maps that came.
  if (PrepareOne() && volume_ == nullptr) return true;
  if (!ChooseVoxel()) return false;
  const bool is_turn = num_added_ < kMapsBetweenMeshes || is_refilled_;
  if (is_turn && AddOne()) return true;
  if (is_turn && RemoveOne()) return true;
  return MakeOne(utime_us, is_changed);
}

// The newest first. A map that was taken out for its movement comes back before another one goes.
bool LiveMesh::Submap::AddOne() {
  for (auto photo = photos_.rbegin(); photo != photos_.rend(); ++photo) {
    auto& [id, of] = *photo;
    if (of.added || of.leaves || !of.newest.has_pixels()) continue;
    if (volume_->Add(Coloured(of.newest)).ok()) {
      of.added = of.newest;
      ++num_added_;
    } else {
      is_full_ = CanCoarsen();
      of.leaves = !is_full_;
    }
    return true;
  }
  return false;
}

bool LiveMesh::Submap::RemoveOne() {
  for (auto photo = photos_.begin(); photo != photos_.end(); ++photo) {
    Photo& of = photo->second;
    if (!of.leaves && !HasMoved(of)) continue;
    if (of.added) volume_->Remove(Coloured(*of.added));
    of.added.reset();
    if (of.leaves) photos_.erase(photo);
    return true;
  }
  return false;
}

void LiveMesh::Submap::NoteStale() {
  for (const BlockIndex& block : volume_->ChangedSince(noted_)) AddCubesAround(block, &stale_);
  noted_ = volume_->version();
}

bool LiveMesh::Submap::MakeOne(int64_t utime_us, bool* is_changed) {
  if (noted_ != volume_->version()) NoteStale();
  if (stale_.empty()) {
    const bool was_full = num_added_ >= kMapsBetweenMeshes;
    num_added_ = 0;
    if (!is_refilled_) return was_full;
    chunks_ = std::exchange(next_, {});
    is_refilled_ = false;
  } else {
    const BlockIndex cube = *stale_.begin();
    stale_.erase(stale_.begin());
    MakeChunk(cube, utime_us, is_refilled_ ? &next_ : &chunks_);
    if (is_refilled_) return true;
  }
  SetFrame();
  *is_changed = true;
  return true;
}

void LiveMesh::Submap::MakeChunk(const BlockIndex& cube, int64_t utime_us, Chunks* chunks) {
  const BlockIndex first{kCubeBlocks * cube.x, kCubeBlocks * cube.y, kCubeBlocks * cube.z};
  const SurfaceMesh mesh = MeshOfCube(*volume_, first, kCubeBlocks);
  if (mesh.indices.empty() || !HasId(cube)) {
    chunks->erase(cube);
    return;
  }
  last_version_ = std::max(static_cast<uint64_t>(utime_us), last_version_ + 1);
  const MeshChunk made = ChunkOf(mesh, last_version_);
  auto bytes = std::make_shared<const skein::Bytes>(EncodeMeshChunk(made));
  std::string blob = HashBytes(bytes->data(), bytes->size());
  (*chunks)[cube] = {{IdOf(cube), last_version_, static_cast<uint32_t>(made.vertices.size()),
                      static_cast<uint32_t>(made.triangles.size()), std::move(blob)},
                     std::move(bytes)};
}

// Evenly over the photos that are in the volume, with the poses that they have there.
void LiveMesh::Submap::SetFrame() {
  std::vector<std::pair<uint32_t, const DepthPose*>> poses;
  for (const auto& [id, photo] : photos_) {
    if (photo.added) poses.emplace_back(id, &photo.added->map.cam_from_world);
  }
  chunks_voxel_ = volume_->voxel();
  frame_.clear();
  const size_t count = std::min(poses.size(), kFramePhotos);
  for (size_t i = 0; i < count; ++i) {
    const auto& [id, pose] = poses[i * poses.size() / count];
    const Eigen::Quaterniond q(pose->rotation);
    const Eigen::Vector3d& t = pose->translation;
    frame_.push_back({id, {q.w(), q.x(), q.y(), q.z()}, {t.x(), t.y(), t.z()}});
  }
}

// ---- Figures ----

SubmapMesh LiveMesh::Submap::Mesh() const {
  SubmapMesh mesh;
  if (chunks_.empty()) return mesh;
  mesh.list.voxel = chunks_voxel_;
  mesh.list.frame = frame_;
  for (const auto& [cube, chunk] : chunks_) {
    mesh.list.chunks.push_back(chunk.entry);
    mesh.blobs[chunk.entry.blob] = chunk.bytes;
  }
  return mesh;
}

// A map in the volume shares its pixels with the newest one, unless that has others. A map that a
// step prepares counts as it will be.
int64_t LiveMesh::Submap::Bytes() const {
  int64_t bytes = volume_ == nullptr ? 0 : volume_->Bytes();
  for (const auto& [id, photo] : photos_) {
    bytes += BytesOf(photo.newest) + (photo.told ? BytesOf(*photo.told) >> (2 * level_) : 0);
    const bool has_own = photo.added && photo.added->map.depth.data != photo.newest.map.depth.data;
    if (has_own) bytes += BytesOf(*photo.added);
  }
  return bytes;
}

int64_t LiveMesh::Submap::NumTriangles() const {
  int64_t sum = 0;
  for (const auto& [cube, chunk] : is_refilled_ ? next_ : chunks_) {
    sum += chunk.entry.num_triangles;
  }
  return sum;
}

// ---- All submaps ----

LiveMesh::LiveMesh(const LiveMeshOptions& options) : options_(options) {}

LiveMesh::~LiveMesh() = default;

void LiveMesh::Update(int64_t submap_id, const std::map<uint32_t, ConfirmedMap>& maps) {
  if (IsLeftOut(submap_id)) return;
  std::unique_ptr<Submap>& submap = submaps_[submap_id];
  if (submap == nullptr) submap = std::make_unique<Submap>(options_.max_bytes);
  submap->Update(maps);
}

void LiveMesh::Drop(int64_t submap_id) {
  if (submaps_.erase(submap_id) > 0) ++changes_;
}

void LiveMesh::LeaveOut(int64_t submap_id) {
  Drop(submap_id);
  left_out_.insert(submap_id);
}

bool LiveMesh::Step(int64_t submap_id, int64_t utime_us) {
  const auto submap = submaps_.find(submap_id);
  if (submap == submaps_.end()) return false;
  bool is_changed = false;
  const bool is_done = submap->second->Step(utime_us, &is_changed);
  changes_ += is_changed;
  if (is_done) KeepLimits();
  return is_done;
}

void LiveMesh::KeepLimits() {
  for (const auto& [id, submap] : submaps_) {
    if (submap->is_full()) return Coarsen(id, "memory");
  }
  if (memory_bytes() > options_.max_bytes) return CoarsenLargest(&Submap::Bytes, "memory");
  if (num_triangles() > options_.max_triangles) {
    CoarsenLargest(&Submap::NumTriangles, "triangles");
  }
}

void LiveMesh::CoarsenLargest(int64_t (Submap::*amount)() const, const char* limit) {
  int64_t largest = -1, id = 0;
  for (const auto& [submap_id, submap] : submaps_) {
    const int64_t of_submap = (submap.get()->*amount)();
    if (!submap->CanCoarsen() || of_submap <= largest) continue;
    largest = of_submap;
    id = submap_id;
  }
  if (largest >= 0) Coarsen(id, limit);
}

void LiveMesh::Coarsen(int64_t submap_id, const char* limit) {
  submaps_.at(submap_id)->Coarsen();
  LogInfo("submap {}: its mesh reached the limit of {}: voxels become twice as wide", submap_id,
          limit);
}

SubmapMesh LiveMesh::MeshOfSubmap(int64_t submap_id) const {
  const auto submap = submaps_.find(submap_id);
  return submap == submaps_.end() ? SubmapMesh() : submap->second->Mesh();
}

int64_t LiveMesh::memory_bytes() const {
  int64_t sum = 0;
  for (const auto& [id, submap] : submaps_) sum += submap->Bytes();
  return sum;
}

int64_t LiveMesh::num_triangles() const {
  int64_t sum = 0;
  for (const auto& [id, submap] : submaps_) sum += submap->NumTriangles();
  return sum;
}

double LiveMesh::VoxelOf(int64_t submap_id) const {
  const auto submap = submaps_.find(submap_id);
  return submap == submaps_.end() ? 0 : submap->second->voxel();
}

}  // namespace skein
