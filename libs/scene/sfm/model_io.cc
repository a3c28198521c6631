#include "sfm/model_io.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/utf8.h"
#include "sfm/camera.h"
#include "sfm/pose.h"

namespace skein {
namespace {

Bytes EncodeCameras(const Reconstruction& reconstruction) {
  ByteWriter writer;
  const std::vector<CameraId> ids = UsedCameras(reconstruction);
  writer.Put<uint64_t>(ids.size());
  for (const CameraId id : ids) {
    const Camera& camera = reconstruction.Camera(id);
    writer.Put<uint32_t>(id);
    writer.Put<int32_t>(camera.ModelId());
    writer.Put<uint64_t>(camera.Width());
    writer.Put<uint64_t>(camera.Height());
    for (const double param : camera.Params()) writer.Put(param);
  }
  return writer.Take();
}

void EncodeImage(const Image& image, ByteWriter* writer) {
  writer->Put<uint32_t>(image.ImageId());
  const Eigen::Vector4d qvec = NormalizeQuaternion(image.Qvec());
  for (int i = 0; i < 4; ++i) writer->Put(qvec[i]);
  for (int i = 0; i < 3; ++i) writer->Put(image.Tvec(i));
  writer->Put<uint32_t>(image.CameraId());
  writer->PutRaw(image.Name().c_str(), image.Name().size() + 1);
  writer->Put<uint64_t>(image.NumPoints2D());
  for (const Point2D& point : image.Points2D()) {
    writer->Put(point.X());
    writer->Put(point.Y());
    writer->Put<uint64_t>(point.Point3DId());
  }
}

Bytes EncodeImages(const Reconstruction& reconstruction) {
  ByteWriter writer;
  std::vector<ImageId> ids = reconstruction.RegImageIds();
  std::sort(ids.begin(), ids.end());
  writer.Put<uint64_t>(ids.size());
  for (const ImageId id : ids) EncodeImage(reconstruction.Image(id), &writer);
  return writer.Take();
}

Bytes EncodePoints(const Reconstruction& reconstruction) {
  ByteWriter writer;
  writer.Put<uint64_t>(reconstruction.NumPoints3D());
  for (const Point3DId id : AscendingPoints(reconstruction)) {
    const Point3D& point = reconstruction.Point3D(id);
    writer.Put<uint64_t>(id);
    for (int i = 0; i < 3; ++i) writer.Put(point.XYZ(i));
    for (int i = 0; i < 3; ++i) writer.Put<uint8_t>(point.Color(i));
    writer.Put(point.Error());
    writer.Put<uint64_t>(point.Track().Length());
    for (const TrackElement& element : point.Track().Elements()) {
      writer.Put<uint32_t>(element.image_id);
      writer.Put<uint32_t>(element.point2D_idx);
    }
  }
  return writer.Take();
}

// Readers return false on damage.
class Decoder {
 public:
  bool Cameras(const Bytes& bytes) { return ReadAll(bytes, &Decoder::Camera); }
  bool Images(const Bytes& bytes) { return ReadAll(bytes, &Decoder::Image); }
  bool Points(const Bytes& bytes) { return ReadAll(bytes, &Decoder::Point); }
  Reconstruction Take() { return std::move(model_); }

 private:
  // A count, then so many of these.
  bool ReadAll(const Bytes& bytes, bool (Decoder::*read)(ByteReader* reader)) {
    ByteReader reader(bytes);
    uint64_t count = 0;
    if (!reader.Get(&count)) return false;
    for (; count > 0; --count) {
      if (!(this->*read)(&reader)) return false;
    }
    return reader.remaining() == 0;
  }

  bool Camera(ByteReader* reader) {
    uint32_t id = 0;
    int32_t model = 0;
    uint64_t width = 0, height = 0;
    if (!reader->Get(&id) || !reader->Get(&model) || !reader->Get(&width) ||
        !reader->Get(&height) || !ExistsCameraModel(model)) {
      return false;
    }
    skein::Camera camera;
    camera.SetCameraId(id);
    camera.SetModelId(model);
    camera.SetWidth(width);
    camera.SetHeight(height);
    for (double& param : camera.Params()) {
      if (!reader->Get(&param)) return false;
    }
    if (!CanBeAdded(model_, camera)) return false;
    model_.AddCamera(camera);
    return true;
  }

  bool Image(ByteReader* reader) {
    uint32_t id = 0, camera_id = 0;
    Eigen::Vector4d qvec;
    Eigen::Vector3d tvec;
    std::string name;
    std::vector<Eigen::Vector2d> points;
    if (!reader->Get(&id) || !reader->GetRaw(qvec.data(), sizeof(double) * 4) ||
        !reader->GetRaw(tvec.data(), sizeof(double) * 3) || !reader->Get(&camera_id) ||
        !Name(reader, &name) || !Points2D(reader, &points)) {
      return false;
    }
    skein::Image image;
    image.SetImageId(id);
    image.SetCameraId(camera_id);
    image.SetQvec(qvec);
    image.SetTvec(tvec);
    image.SetName(name);
    image.SetPoints2D(points);
    if (!CanBeAdded(model_, image)) return false;
    image.SetQvec(NormalizeQuaternion(qvec));
    model_.AddImage(std::move(image));
    model_.RegisterImage(id);
    return true;
  }

  static bool Name(ByteReader* reader, std::string* name) {
    char c = 0;
    while (reader->Get(&c) && c != '\0') name->push_back(c);
    return c == '\0' && !name->empty();
  }

  // The points' ids are left to the tracks of points3D.bin.
  static bool Points2D(ByteReader* reader, std::vector<Eigen::Vector2d>* points) {
    uint64_t count = 0;
    if (!reader->Get(&count) || count > reader->remaining() / 24) return false;
    for (uint64_t i = 0; i < count; ++i) {
      double x = 0, y = 0;
      if (!reader->Get(&x) || !reader->Get(&y) || !reader->Skip(8)) return false;
      points->emplace_back(x, y);
    }
    return true;
  }

  bool Point(ByteReader* reader) {
    uint64_t id = 0, length = 0;
    double error = 0;
    Eigen::Vector3d xyz;
    Rgb color;
    if (!reader->Get(&id) || !reader->GetRaw(xyz.data(), sizeof(double) * 3) ||
        !reader->GetRaw(color.data(), 3) || !reader->Get(&error) || !reader->Get(&length) ||
        !xyz.allFinite() || length < 2 || length > reader->remaining() / 8) {
      return false;
    }
    Track track;
    track.Reserve(length);
    for (uint64_t i = 0; i < length; ++i) {
      TrackElement element;
      reader->Get(&element.image_id);
      reader->Get(&element.point2D_idx);
      track.AddElement(element);
    }
    if (!CanBeAdded(model_, track)) return false;
    const Point3DId added = model_.AddPoint3D(xyz, std::move(track), color);
    model_.Point3D(added).SetError(error);
    return true;
  }

  Reconstruction model_;
};

// done(name): the file is needed no more.
template <class Done>
Result<Reconstruction> DecodeParts(const ModelArchive& archive, Done done) {
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    if (archive.count(name) == 0) return DataLoss(std::string("model without ") + name);
  }
  Decoder decoder;
  if (!decoder.Cameras(archive.at("cameras.bin"))) return DataLoss("cameras.bin is damaged");
  if (!decoder.Images(archive.at("images.bin"))) return DataLoss("images.bin is damaged");
  done("images.bin");
  if (!decoder.Points(archive.at("points3D.bin"))) return DataLoss("points3D.bin is damaged");
  done("points3D.bin");
  return decoder.Take();
}

}  // namespace

std::vector<CameraId> UsedCameras(const Reconstruction& reconstruction) {
  std::set<CameraId> ids;
  for (const ImageId id : reconstruction.RegImageIds()) {
    ids.insert(reconstruction.Image(id).CameraId());
  }
  return {ids.begin(), ids.end()};
}

std::vector<Point3DId> AscendingPoints(const Reconstruction& reconstruction) {
  std::vector<Point3DId> ids;
  ids.reserve(reconstruction.NumPoints3D());
  for (const auto& [id, point] : reconstruction.Points3D()) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  return ids;
}

bool CanBeAdded(const Reconstruction& reconstruction, const Camera& camera) {
  return camera.CameraId() != kInvalidCameraId && !reconstruction.ExistsCamera(camera.CameraId()) &&
         IsCameraSide(camera.Width()) && IsCameraSide(camera.Height()) &&
         std::all_of(camera.Params().begin(), camera.Params().end(),
                     [](double param) { return std::isfinite(param); });
}

bool CanBeAdded(const Reconstruction& reconstruction, const Image& image) {
  return image.ImageId() != kInvalidImageId && !reconstruction.ExistsImage(image.ImageId()) &&
         reconstruction.ExistsCamera(image.CameraId()) && IsImageName(image.Name()) &&
         image.Qvec().allFinite() && image.Tvec().allFinite() && image.Qvec().norm() >= 1e-6;
}

bool CanBeAdded(const Reconstruction& reconstruction, const Track& track) {
  const auto is_free = [&](const TrackElement& element) {
    return reconstruction.ExistsImage(element.image_id) &&
           element.point2D_idx < reconstruction.Image(element.image_id).NumPoints2D() &&
           !reconstruction.Image(element.image_id).Point2D(element.point2D_idx).HasPoint3D();
  };
  std::vector<std::pair<ImageId, Point2DIdx>> keypoints;
  keypoints.reserve(track.Length());
  for (const TrackElement& element : track.Elements()) {
    if (!is_free(element)) return false;
    keypoints.emplace_back(element.image_id, element.point2D_idx);
  }
  std::sort(keypoints.begin(), keypoints.end());
  return std::adjacent_find(keypoints.begin(), keypoints.end()) == keypoints.end();
}

bool IsImageName(const std::string& name) {
  const auto is_control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  if (!IsUtf8(name) || std::any_of(name.begin(), name.end(), is_control)) return false;
  for (size_t begin = 0; begin <= name.size();) {
    const size_t end = std::min(name.find('/', begin), name.size());
    const std::string part = name.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return false;
    begin = end + 1;
  }
  return true;
}

ModelArchive EncodeModel(const Reconstruction& reconstruction) {
  return {{"cameras.bin", EncodeCameras(reconstruction)},
          {"images.bin", EncodeImages(reconstruction)},
          {"points3D.bin", EncodePoints(reconstruction)}};
}

Result<Reconstruction> DecodeModel(const ModelArchive& archive) {
  return DecodeParts(archive, [](const char*) {});
}

Result<Reconstruction> DecodeModel(ModelArchive&& archive) {
  return DecodeParts(archive, [&](const char* name) { archive.at(name) = Bytes(); });
}

Image WithoutPoints(const Image& image) {
  Image bare;
  bare.SetImageId(image.ImageId());
  bare.SetCameraId(image.CameraId());
  bare.SetName(image.Name());
  bare.SetQvec(NormalizeQuaternion(image.Qvec()));
  bare.SetTvec(image.Tvec());
  std::vector<Eigen::Vector2d> pixels;
  pixels.reserve(image.NumPoints2D());
  for (const Point2D& point2D : image.Points2D()) pixels.push_back(point2D.XY());
  bare.SetPoints2D(pixels);
  return bare;
}

Reconstruction CopyRegistered(const Reconstruction& reconstruction) {
  Reconstruction copy;
  for (const CameraId id : UsedCameras(reconstruction)) {
    copy.AddCamera(reconstruction.Camera(id));
  }
  std::vector<ImageId> ids = reconstruction.RegImageIds();
  std::sort(ids.begin(), ids.end());
  for (const ImageId id : ids) {
    copy.AddImage(WithoutPoints(reconstruction.Image(id)));
    copy.RegisterImage(id);
  }
  for (const Point3DId id : AscendingPoints(reconstruction)) {
    const Point3D& point = reconstruction.Point3D(id);
    const Point3DId added = copy.AddPoint3D(point.XYZ(), point.Track(), point.Color());
    copy.Point3D(added).SetError(point.Error());
  }
  return copy;
}

}  // namespace skein
