// Large maps without photos: what the live view's bytes, memory and times are measured with.
//
//   large_shape write SESSION POINTS
//   large_shape tell SESSION POINTS
//   large_shape cost POINTS [TRACK]
//
// write: a session folder with a submap whose model has so many points.
// tell: that submap's mapper, on LCM_DEFAULT_URL, tells such a shape until a signal. It writes the
//   folder, without a model, where there is none.
// cost: times of a shape's steps. The copies of the map: whole, and of what one photo more brings;
//   then the chunks: the first ones, with that photo, and when all points have moved.
//
// A walk along a street: 2,000 new points a photo, each seen by TRACK (4) photos in a row.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "blobs/blob_store.h"
#include "core/clock.h"
#include "core/hash.h"
#include "core/log.h"
#include "ledger/ledger_record.h"
#include "ledger/session_folder.h"
#include "map/shape_maker.h"
#include "node/node.h"
#include "sfm/model_io.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr int kPointsAPhoto = 2000;
constexpr int64_t kSubmap = 3;  // the seq of its seed
constexpr char kMapper[] = "mapper-1";

// Throws what went wrong.
template <class T>
T Take(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error());
  return std::move(*result);
}
void Require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.error());
}

// Point i is new in photo 1 + i / kPointsAPhoto.
class Street {
 public:
  explicit Street(int track) : track_(track) {
    Camera camera;
    camera.SetCameraId(1);
    camera.InitializeWithName("SIMPLE_RADIAL", 1200, 1600, 1200);
    model_.AddCamera(camera);
  }

  void Grow(int num_points) {
    std::uniform_real_distribution<double> any(0, 1);
    for (; num_points_ < num_points; ++num_points_) {
      const auto first = static_cast<ImageId>(1 + num_points_ / kPointsAPhoto);
      Track track;
      for (int i = 0; i < track_; ++i) {
        AddPhotosUpTo(first + i);
        const auto index =
            static_cast<Point2DIdx>(num_points_ % kPointsAPhoto + (track_ - 1 - i) * kPointsAPhoto);
        track.AddElement(first + i, index);
      }
      const Eigen::Vector3d xyz(first * 0.25 + any(random_), 3 * any(random_), 6 + any(random_));
      model_.AddPoint3D(xyz, track, {1, 2, 3});
    }
  }
  void MoveAll(double distance) {
    for (const Point3DId id : model_.Point3DIds()) {
      model_.Point3D(id).XYZ().x() += distance;
    }
  }
  const Reconstruction& model() const { return model_; }

 private:
  void AddPhotosUpTo(ImageId id) {
    for (; num_photos_ < id; ++num_photos_) {
      Image image;
      image.SetImageId(num_photos_ + 1);
      image.SetCameraId(1);
      image.SetName("walk/" + std::to_string(num_photos_ + 1) + ".jpg");
      image.SetPoints2D(std::vector<Eigen::Vector2d>(track_ * kPointsAPhoto, {800, 600}));
      image.SetTvec({-0.25 * num_photos_, 0, 0});
      model_.AddImage(image);
      model_.RegisterImage(image.ImageId());
    }
  }

  const int track_;
  int num_points_ = 0;
  ImageId num_photos_ = 0;
  std::mt19937 random_{1};
  Reconstruction model_;
};

Fact Committed(Fact fact, const std::string& session_id, int64_t seq) {
  Header(fact).session_id = session_id;
  Header(fact).seq = seq;
  Header(fact).utime_us = NowUs();
  Header(fact).fact_id = "large/" + std::to_string(seq);
  return fact;
}

image_t Photo(int64_t id) {
  image_t image{};
  image.image_id = id;
  image.camera_id = 1;
  image.agent = "walk";
  image.name = std::to_string(id) + ".jpg";
  image.width_px = 1600;
  image.height_px = 1200;
  image.orientation = 1;
  image.focal_px = 1200;
  image.blob_id = std::string(64, '0');
  return image;
}

// `model` is null: none.
void WriteSession(const fs::path& dir, const Reconstruction* model) {
  const Session session = Take(OpenOrCreateSession(dir));
  seed_t seed{};
  seed.submap_id = kSubmap;
  seed.image_id1 = 1;
  seed.image_id2 = 2;
  submap_lease_t lease{};
  lease.submap_id = kSubmap;
  lease.epoch = 1;
  lease.owner = kMapper;
  std::vector<Fact> facts = {Photo(1), Photo(2), seed, lease};
  if (model != nullptr) {
    submap_model_t told{};
    told.submap_id = kSubmap;
    told.epoch = 1;
    told.kind = submap_model_t::FINAL;
    told.num_images = static_cast<int32_t>(model->NumRegImages());
    told.num_points = static_cast<int32_t>(model->NumPoints3D());
    BlobStore blobs(session.paths.Blobs());
    told.model_blob = Take(blobs.Put(EncodeModelArchive(EncodeModel(*model))));
    facts.emplace_back(told);
  }
  std::vector<LedgerRecord> records;
  for (const Fact& fact : facts) {
    records.push_back(EncodeRecord(
        Committed(fact, session.session_id, static_cast<int64_t>(records.size()) + 1)));
  }
  Require(Take(Ledger::Open(session.paths.Ledger()))->Append(records));
}

struct Told {
  submap_shape_t message{};
  std::vector<std::pair<std::string, std::shared_ptr<const Bytes>>> blobs;
};

Told Encode(const MapShape& shape) {
  Told told;
  const auto keep = [&told](std::shared_ptr<const Bytes> bytes) {
    told.blobs.emplace_back(HashBytes(bytes->data(), bytes->size()), bytes);
    return told.blobs.back().first;
  };
  ShapeManifest manifest{shape.version, shape.photos, shape.cameras, {}};
  for (const auto& [id, chunk] : shape.chunks) {
    manifest.chunks.push_back({id, chunk.version, chunk.num_points, keep(chunk.points),
                               keep(chunk.tracks), chunk.tracks->size()});
  }
  const auto bytes = std::make_shared<const Bytes>(EncodeShapeManifest(manifest));
  told.message.submap_id = kSubmap;
  told.message.epoch = 1;
  told.message.owner = kMapper;
  told.message.version = static_cast<int64_t>(shape.version);
  told.message.num_images = static_cast<int32_t>(shape.photos.size());
  told.message.num_points = static_cast<int32_t>(shape.NumPoints());
  told.message.manifest_bytes = static_cast<int64_t>(bytes->size());
  told.message.manifest_blob = keep(bytes);
  return told;
}

int Write(const fs::path& dir, int num_points) {
  Street street(4);
  street.Grow(num_points);
  WriteSession(dir, &street.model());
  return 0;
}

int Tell(const fs::path& dir, int num_points) {
  if (!fs::exists(SessionPaths{dir}.Ledger())) WriteSession(dir, nullptr);
  NodeOptions options;
  options.service = "mapper";
  options.instance = kMapper;
  options.session_dir = dir;
  Told told = [num_points] {
    Street street(4);
    street.Grow(num_points);
    ShapeMaker maker;
    maker.Update(CopyForShape(street.model()), NowUs());
    return Encode(maker.shape());
  }();
  Node node(options);
  for (const auto& [id, bytes] : told.blobs) node.blobs().Keep(id, bytes);
  node.loop().AddTimer(1, [&] { node.Publish(kSubmapShapeChannel, told.message); });
  node.Run();
  return 0;
}

double UpdateS(const Reconstruction& model, ShapeMaker* maker) {
  const ShapeSource source = CopyForShape(model);
  const Timer timer;
  maker->Update(source, NowUs());
  return timer.ElapsedS();
}

int Cost(int num_points, int track) {
  Street street(track);
  street.Grow(num_points);
  const Timer copying;
  CopyForShape(street.model());
  const double copy_s = copying.ElapsedS();
  ShapeMaker maker;
  const double first_s = UpdateS(street.model(), &maker);
  street.Grow(num_points + kPointsAPhoto);
  const double photo_s = UpdateS(street.model(), &maker);
  street.MoveAll(1);
  const double moved_s = UpdateS(street.model(), &maker);
  const Timer encoding;
  Encode(maker.shape());
  std::printf(
      "{\"points\": %d, \"photos\": %zu, \"track\": %d, \"copy_s\": %.4f, \"first_s\": %.4f, "
      "\"photo_s\": %.4f, \"all_moved_s\": %.4f, \"hash_all_s\": %.4f}\n",
      num_points, street.model().NumRegImages(), track, copy_s, first_s, photo_s, moved_s,
      encoding.ElapsedS());
  return 0;
}

int Run(const std::vector<std::string>& args) {
  if (args.size() == 3 && args[0] == "write") return Write(args[1], std::stoi(args[2]));
  if (args.size() == 3 && args[0] == "tell") return Tell(args[1], std::stoi(args[2]));
  const bool is_cost = (args.size() == 2 || args.size() == 3) && args[0] == "cost";
  if (is_cost) return Cost(std::stoi(args[1]), args.size() == 3 ? std::stoi(args[2]) : 4);
  std::cerr << "large_shape write|tell SESSION POINTS, or large_shape cost POINTS [TRACK]\n";
  return 2;
}

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  try {
    skein::InitLog("large_shape", false);
    return skein::Run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::cerr << "large_shape: " << error.what() << "\n";
    return 1;
  }
}
