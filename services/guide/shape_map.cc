#include "guide/shape_map.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

namespace skein {
namespace {

constexpr double kMaxSidePx = 1e6;

bool IsSound(const ShapeCamera& camera) {
  const auto is_side = [](double side) { return side >= 1 && side <= kMaxSidePx; };
  const auto is_focal = [](double focal) { return std::isfinite(focal) && focal > 0; };
  return is_side(static_cast<double>(camera.width)) &&
         is_side(static_cast<double>(camera.height)) && is_focal(camera.fx) &&
         is_focal(camera.fy) && std::isfinite(camera.cx) && std::isfinite(camera.cy);
}

CameraPose PoseOf(const ShapePhoto& photo) {
  const Eigen::Quaterniond rotation(photo.qvec[0], photo.qvec[1], photo.qvec[2], photo.qvec[3]);
  return {rotation.normalized(), Eigen::Vector3d::Map(photo.tvec.data())};
}

}  // namespace

Status ShapeMap::Update(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image,
                        int64_t max_points) {
  if (!HasAll(TakeCameras(shape))) *this = ShapeMap();
  const bool is_first = chunks_.empty();
  const bool has_new_photos = TakePhotos(shape, agent_of_image);
  const bool has_other_share = SetShare(shape, max_points);
  Status taken = TakeChunks(shape, is_first || has_other_share, has_new_photos);
  if (!taken.ok()) *this = ShapeMap();
  return taken;
}

bool ShapeMap::HasAll(const std::map<uint32_t, const ShapePhoto*>& photos) const {
  return std::all_of(photos_.begin(), photos_.end(),
                     [&](const auto& known) { return photos.count(known.first) > 0; });
}

// Returns the photos that make sense, by id.
std::map<uint32_t, const ShapePhoto*> ShapeMap::TakeCameras(const Shape& shape) {
  std::map<uint32_t, const ShapePhoto*> photos;
  std::set<uint32_t> sound;
  for (const ShapeCamera& camera : shape.cameras) {
    if (!IsSound(camera)) continue;
    sound.insert(camera.camera_id);
    const auto [index, is_new] =
        cameras_.try_emplace(camera.camera_id, static_cast<int32_t>(map_.cameras.size()));
    if (is_new) map_.cameras.emplace_back();
    map_.cameras[index->second] = {static_cast<int>(camera.width),
                                   static_cast<int>(camera.height),
                                   camera.fx,
                                   camera.fy,
                                   camera.cx,
                                   camera.cy};
  }
  for (const ShapePhoto& photo : shape.photos) {
    if (sound.count(photo.camera_id) > 0 && HasPose(photo)) photos[photo.image_id] = &photo;
  }
  return photos;
}

// True: there are new ones.
bool ShapeMap::TakePhotos(const Shape& shape, const std::map<int64_t, int32_t>& agent_of_image) {
  bool has_new = false;
  for (const auto& [id, photo] : TakeCameras(shape)) {
    const auto [index, is_new] = photos_.try_emplace(id, static_cast<uint32_t>(map_.photos.size()));
    if (is_new) map_.photos.emplace_back();
    has_new |= is_new;
    GuidedPhoto& guided = map_.photos[index->second];
    const auto agent = agent_of_image.find(id);
    guided.image_id = id;
    guided.camera = cameras_.at(photo->camera_id);
    guided.agent = agent == agent_of_image.end() ? 0 : agent->second;
    guided.cam_from_world = PoseOf(*photo);
  }
  return has_new;
}

// True: it is another one.
bool ShapeMap::SetShare(const Shape& shape, int64_t max_points) {
  constexpr double kHeld = 0.1;
  int64_t num_points = 0;
  for (const Shape::Chunk& chunk : shape.chunks) num_points += chunk.num_points;
  const double wanted = num_points > max_points
                            ? static_cast<double>(max_points) / static_cast<double>(num_points)
                            : 1;
  if (!chunks_.empty() && std::abs(wanted - share_) <= kHeld * share_) return false;
  return std::exchange(share_, wanted) != wanted;
}

Status ShapeMap::TakeChunks(const Shape& shape, bool all, bool has_new_photos) {
  std::map<uint64_t, Chunk> before = std::move(chunks_);
  chunks_.clear();
  for (const Shape::Chunk& shaped : shape.chunks) {
    if (shaped.points == nullptr || shaped.tracks == nullptr) {
      return NotFound("chunk " + std::to_string(shaped.id) + " is not here");
    }
    Chunk& chunk = chunks_[shaped.id];
    const auto known = before.find(shaped.id);
    if (known != before.end()) {
      chunk = std::move(known->second);
      before.erase(known);
    }
    if (!all && chunk.version == shaped.version && !(chunk.has_unknown_photos && has_new_photos)) {
      continue;
    }
    Result<std::vector<KeyedPoint>> points = Read(shaped, &chunk.has_unknown_photos);
    if (!points.ok()) return points.status();
    Take(std::move(*points), &chunk);
    chunk.version = shaped.version;
  }
  for (const auto& [id, chunk] : before) {
    for (const auto& [key, index] : chunk.indices) Remove(index);
  }
  return Status::Ok();
}

// Ascending.
Result<std::vector<ShapeMap::KeyedPoint>> ShapeMap::Read(const Shape::Chunk& shaped,
                                                         bool* has_unknown_photos) const {
  const Result<ShapeChunk> chunk = DecodeShapeChunk(*shaped.points);
  if (!chunk.ok()) return chunk.status();
  const Result<PointTracks> tracks = DecodePointTracks(*shaped.tracks);
  if (!tracks.ok()) return tracks.status();
  if (tracks->ends.size() != chunk->points.size()) {
    return DataLoss("chunk " + std::to_string(shaped.id) + ": not the tracks of its points");
  }
  *has_unknown_photos = false;
  std::vector<KeyedPoint> points;
  const auto count =
      static_cast<size_t>(std::ceil(share_ * static_cast<double>(chunk->points.size())));
  for (size_t i = 0; i < count; ++i) {
    GuidedPoint point;
    for (int axis = 0; axis < 3; ++axis) {
      point.xyz[axis] = chunk->origin[axis] + chunk->step * chunk->points[i].xyz[axis];
    }
    if (!point.xyz.allFinite()) continue;
    const uint32_t begin = i == 0 ? 0 : tracks->ends[i - 1];
    for (uint32_t k = begin; k < tracks->ends[i]; ++k) {
      const auto photo = photos_.find(tracks->observations[k].image_id);
      *has_unknown_photos |= photo == photos_.end();
      if (photo != photos_.end()) point.photos.push_back(photo->second);
    }
    if (point.photos.empty()) continue;
    std::sort(point.photos.begin(), point.photos.end());
    point.photos.erase(std::unique(point.photos.begin(), point.photos.end()), point.photos.end());
    const PointObservation& first = tracks->observations[begin];
    points.emplace_back(uint64_t{first.image_id} << 32 | first.point2D_idx, std::move(point));
  }
  std::stable_sort(points.begin(), points.end(),
                   [](const KeyedPoint& a, const KeyedPoint& b) { return a.first < b.first; });
  return points;
}

void ShapeMap::Take(std::vector<KeyedPoint> points, Chunk* chunk) {
  std::vector<std::pair<uint64_t, uint32_t>> before = std::move(chunk->indices);
  chunk->indices.clear();
  auto known = before.begin();
  for (auto& [key, point] : points) {
    for (; known != before.end() && known->first < key; ++known) Remove(known->second);
    const bool is_known = known != before.end() && known->first == key;
    const uint32_t index = is_known ? known->second : NewIndex();
    if (is_known) ++known;
    map_.points[index] = std::move(point);
    chunk->indices.emplace_back(key, index);
  }
  for (; known != before.end(); ++known) Remove(known->second);
}

uint32_t ShapeMap::NewIndex() {
  if (free_.empty()) {
    map_.points.emplace_back();
    return static_cast<uint32_t>(map_.points.size() - 1);
  }
  const uint32_t index = free_.back();
  free_.pop_back();
  return index;
}

void ShapeMap::Remove(uint32_t index) {
  map_.points[index].photos.clear();
  free_.push_back(index);
}

}  // namespace skein
