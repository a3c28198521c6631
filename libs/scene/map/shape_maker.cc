#include "map/shape_maker.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "sfm/camera.h"

namespace skein {
namespace {

constexpr size_t kMaxScaleSamples = 4096;
constexpr double kStepsAnExtent = 16384;
constexpr double kExtentShare = 0.9;   // of the points within the extent
constexpr double kNearExtents = 1.75;  // within a box of 65,535 steps
constexpr double kMaxCoordinate = 65535;
constexpr int kSmallShare = 8;  // a chunk with less than 1/8 of its points is dissolved

// splitmix64: a bijection whose values look random.
uint64_t Scramble(uint64_t id) {
  id += 0x9e3779b97f4a7c15;
  id = (id ^ (id >> 30)) * 0xbf58476d1ce4e5b9;
  id = (id ^ (id >> 27)) * 0x94d049bb133111eb;
  return id ^ (id >> 31);
}

double MaxDistance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  double distance = 0;
  for (int i = 0; i < 3; ++i) distance = std::max(distance, std::abs(a[i] - b[i]));
  return distance;
}

double Quantile(std::vector<double> values, double share) {
  const auto at = values.begin() + static_cast<int64_t>(share * (values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

ShapeCamera CameraOf(const Camera& camera) {
  ShapeCamera shape{camera.CameraId(), camera.Width(), camera.Height()};
  const std::vector<size_t>& focal = camera.FocalLengthIdxs();
  shape.fx = camera.Params(focal.front());
  shape.fy = camera.Params(focal.back());
  shape.cx = camera.PrincipalPointX();
  shape.cy = camera.PrincipalPointY();
  shape.model_id = camera.ModelId();
  shape.params = camera.Params();
  return shape;
}

void CopyPhotos(const Reconstruction& reconstruction, ShapeSource* source) {
  std::vector<ImageId> ids = reconstruction.RegImageIds();
  std::sort(ids.begin(), ids.end());
  std::map<CameraId, ShapeCamera> cameras;
  for (const ImageId id : ids) {
    const Image& image = reconstruction.Image(id);
    const Eigen::Vector4d& q = image.Qvec();
    const Eigen::Vector3d& t = image.Tvec();
    source->photos.push_back({id, image.CameraId(), {q[0], q[1], q[2], q[3]}, {t[0], t[1], t[2]}});
    cameras.emplace(image.CameraId(), CameraOf(reconstruction.Camera(image.CameraId())));
  }
  for (const auto& [id, camera] : cameras) source->cameras.push_back(camera);
}

void CopyPoint(Point3DId id, const Point3D& point, const std::array<uint8_t, 3>& rgb,
               ShapeSource* source) {
  source->points.push_back({id, {point.X(), point.Y(), point.Z()}, rgb});
  for (const TrackElement& element : point.Track().Elements()) {
    source->tracks.observations.push_back({element.image_id, element.point2D_idx});
  }
  source->tracks.ends.push_back(static_cast<uint32_t>(source->tracks.observations.size()));
}

template <class ColourOf>
ShapeSource CopyAll(const Reconstruction& reconstruction, ColourOf colour_of) {
  ShapeSource source;
  CopyPhotos(reconstruction, &source);
  source.points.reserve(reconstruction.NumPoints3D());
  source.tracks.ends.reserve(reconstruction.NumPoints3D());
  for (const auto& [id, point] : reconstruction.Points3D()) {
    CopyPoint(id, point, colour_of(id, point), &source);
  }
  return source;
}

}  // namespace

uint64_t ShapeSource::MaxId() const {
  uint64_t max_id = 0;
  for (const Point& point : points) max_id = std::max(max_id, point.id);
  return max_id;
}

ShapeSource CopyForShape(const SceneMap& map, uint64_t coloured_up_to) {
  return CopyAll(map.reconstruction(), [&](Point3DId id, const Point3D& point) {
    return id > coloured_up_to ? map.MeanColour(point.Track()) : std::array<uint8_t, 3>{};
  });
}

ShapeSource CopyForShape(const Reconstruction& reconstruction) {
  return CopyAll(reconstruction, [](Point3DId, const Point3D& point) {
    return std::array<uint8_t, 3>{point.Color(0), point.Color(1), point.Color(2)};
  });
}

ShapeSource CopyNewForShape(const SceneMap& map, const std::vector<ImageId>& known,
                            uint64_t above) {
  const Reconstruction& model = map.reconstruction();
  ShapeSource source;
  CopyPhotos(model, &source);
  std::set<Point3DId> ids;
  for (const ShapePhoto& photo : source.photos) {
    if (std::binary_search(known.begin(), known.end(), photo.image_id)) continue;
    for (const Point2D& observation : model.Image(photo.image_id).Points2D()) {
      if (observation.HasPoint3D() && observation.Point3DId() > above) {
        ids.insert(observation.Point3DId());
      }
    }
  }
  for (const Point3DId id : ids) {
    const Point3D& point = model.Point3D(id);
    CopyPoint(id, point, map.MeanColour(point.Track()), &source);
  }
  return source;
}

int64_t MapShape::NumPoints() const {
  int64_t num_points = 0;
  for (const auto& [id, chunk] : chunks) num_points += chunk.num_points;
  return num_points;
}

bool ShapeMaker::Update(const ShapeSource& source, int64_t utime_us) {
  std::vector<Known> points = ById(source);
  Scale(points);
  Match(&points);
  bool changed = Dissolve(&points);
  for (Known& point : points) {
    if (point.chunk == 0) Assign(&point);
  }
  const uint64_t version = std::max(shape_.version + 1, static_cast<uint64_t>(utime_us));
  changed |= MakeChanged(source, &points, version);
  known_ = std::move(points);
  changed |= shape_.photos != source.photos || !(shape_.cameras == source.cameras);
  if (!changed) return false;
  shape_.photos = source.photos;
  shape_.cameras = source.cameras;
  shape_.version = version;
  return true;
}

bool ShapeMaker::UpdateWith(const ShapeSource& news, ShapeSource* source, int64_t utime_us) {
  const size_t num_points = source->points.size();
  const size_t num_observations = source->tracks.observations.size();
  source->points.insert(source->points.end(), news.points.begin(), news.points.end());
  source->tracks.observations.insert(source->tracks.observations.end(),
                                     news.tracks.observations.begin(),
                                     news.tracks.observations.end());
  for (const uint32_t end : news.tracks.ends) {
    source->tracks.ends.push_back(static_cast<uint32_t>(num_observations) + end);
  }
  source->photos = news.photos;
  source->cameras = news.cameras;
  const bool changed = Update(*source, utime_us);
  source->points.resize(num_points);
  source->tracks.observations.resize(num_observations);
  source->tracks.ends.resize(num_points);
  return changed;
}

// Centre and extent follow the map once it has grown to twice what it was, or shrunk to a half, so
// that what is near or far does not change with every photo.
void ShapeMaker::Scale(const std::vector<Known>& points) {
  if (points.empty()) return;
  const size_t stride = 1 + points.size() / kMaxScaleSamples;
  std::vector<const Known*> sample;
  for (size_t i = 0; i < points.size(); i += stride) sample.push_back(&points[i]);
  std::vector<double> values(sample.size());
  std::array<double, 3> centre{};
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < sample.size(); ++i) values[i] = sample[i]->xyz[axis];
    centre[axis] = Quantile(values, 0.5);
  }
  for (size_t i = 0; i < sample.size(); ++i) values[i] = MaxDistance(sample[i]->xyz, centre);
  const double extent = std::max(Quantile(values, kExtentShare), 1e-12);
  const bool moved = MaxDistance(centre, centre_) > extent_ / 2;
  if (step_ > 0 && !moved && extent < 2 * extent_ && extent > extent_ / 2) return;
  centre_ = centre;
  extent_ = extent;
  step_ = std::exp2(std::ceil(std::log2(extent / kStepsAnExtent)));
}

bool ShapeMaker::IsFar(const std::array<double, 3>& xyz) const {
  return MaxDistance(xyz, centre_) > kNearExtents * extent_;
}

std::vector<ShapeMaker::Known> ShapeMaker::ById(const ShapeSource& source) {
  std::vector<Known> points(source.points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    const ShapeSource::Point& point = source.points[i];
    points[i] = {point.id, point.xyz, point.rgb, 0, static_cast<uint32_t>(i)};
  }
  std::sort(points.begin(), points.end(),
            [](const Known& a, const Known& b) { return a.id < b.id; });
  return points;
}

// Adds what is known of the points; marks the chunks of those that moved or went.
void ShapeMaker::Match(std::vector<Known>* points) {
  auto old = known_.begin();
  const auto leave = [this](const Known& gone) {
    ChunkState& chunk = chunks_.at(gone.chunk);
    --chunk.num_points;
    chunk.changed = true;
  };
  for (Known& point : *points) {
    for (; old != known_.end() && old->id < point.id; ++old) leave(*old);
    if (old == known_.end() || old->id != point.id) continue;
    ChunkState& chunk = chunks_.at(old->chunk);
    point.chunk = old->chunk;
    point.rgb = old->rgb;
    chunk.changed |= MaxDistance(point.xyz, old->xyz) > chunk.step;
    ++old;
  }
  for (; old != known_.end(); ++old) leave(*old);
  // What has not moved far keeps the position that its chunk was made of.
  old = known_.begin();
  for (Known& point : *points) {
    while (old != known_.end() && old->id < point.id) ++old;
    if (old == known_.end()) break;
    if (old->id == point.id && !chunks_.at(point.chunk).changed) point.xyz = old->xyz;
  }
}

// The few points of chunks that most have left are made again. True if a chunk has gone.
bool ShapeMaker::Dissolve(std::vector<Known>* points) {
  const auto is_small = [this](uint64_t id) {
    return id != open_near_ && id != open_far_ &&
           chunks_.at(id).num_points * kSmallShare < chunk_points_;
  };
  for (Known& point : *points) {
    if (point.chunk != 0 && is_small(point.chunk)) point.chunk = 0;
  }
  bool any = false;
  for (auto chunk = chunks_.begin(); chunk != chunks_.end();) {
    if (is_small(chunk->first)) {
      any |= shape_.chunks.erase(chunk->first) > 0;
      chunk = chunks_.erase(chunk);
    } else {
      ++chunk;
    }
  }
  return any;
}

void ShapeMaker::Assign(Known* point) {
  uint64_t& open = IsFar(point->xyz) ? open_far_ : open_near_;
  if (open == 0 || chunks_.at(open).num_points >= chunk_points_) {
    open = next_chunk_++;
    chunks_[open] = {};
  }
  ChunkState& chunk = chunks_.at(open);
  ++chunk.num_points;
  chunk.changed = true;
  point->chunk = open;
}

bool ShapeMaker::MakeChanged(const ShapeSource& source, std::vector<Known>* points,
                             uint64_t version) {
  std::map<uint64_t, std::vector<Known*>> changed;
  for (const auto& [id, chunk] : chunks_) {
    if (chunk.changed) changed[id].reserve(static_cast<size_t>(chunk.num_points));
  }
  if (changed.empty()) return false;
  for (Known& point : *points) {
    const auto members = changed.find(point.chunk);
    if (members != changed.end()) members->second.push_back(&point);
  }
  for (auto& [id, members] : changed) {
    if (members.empty()) {
      shape_.chunks.erase(id);
      chunks_.at(id).changed = false;
    } else {
      MakeChunk(id, source, std::move(members), version);
    }
  }
  return true;
}

void ShapeMaker::MakeChunk(uint64_t id, const ShapeSource& source, std::vector<Known*> points,
                           uint64_t version) {
  std::sort(points.begin(), points.end(),
            [](const Known* a, const Known* b) { return Scramble(a->id) < Scramble(b->id); });
  std::array<double, 3> low = source.points[points.front()->index].xyz, high = low;
  for (Known* point : points) {
    point->xyz = source.points[point->index].xyz;
    for (int i = 0; i < 3; ++i) {
      low[i] = std::min(low[i], point->xyz[i]);
      high[i] = std::max(high[i], point->xyz[i]);
    }
  }
  ShapeChunk chunk;
  chunk.version = version;
  chunk.step = step_;
  while (MaxDistance(low, high) > (kMaxCoordinate - 1) * chunk.step) chunk.step *= 2;
  for (int i = 0; i < 3; ++i) chunk.origin[i] = std::floor(low[i] / chunk.step) * chunk.step;
  PointTracks tracks;
  for (const Known* point : points) {
    ShapePoint encoded;
    for (int i = 0; i < 3; ++i) {
      const double steps = std::round((point->xyz[i] - chunk.origin[i]) / chunk.step);
      encoded.xyz[i] = static_cast<uint16_t>(std::clamp(steps, 0.0, kMaxCoordinate));
    }
    const uint32_t begin = point->index == 0 ? 0 : source.tracks.ends[point->index - 1];
    const uint32_t end = source.tracks.ends[point->index];
    encoded.rgb = point->rgb;
    encoded.num_photos = static_cast<uint8_t>(std::min<uint32_t>(255, end - begin));
    chunk.points.push_back(encoded);
    tracks.observations.insert(tracks.observations.end(),
                               source.tracks.observations.begin() + begin,
                               source.tracks.observations.begin() + end);
    tracks.ends.push_back(static_cast<uint32_t>(tracks.observations.size()));
  }
  chunks_.at(id) = {chunk.step, static_cast<int>(points.size()), false};
  shape_.chunks[id] = {version, static_cast<uint32_t>(points.size()),
                       std::make_shared<const Bytes>(EncodeShapeChunk(chunk)),
                       std::make_shared<const Bytes>(EncodePointTracks(tracks))};
}

}  // namespace skein
