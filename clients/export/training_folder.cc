#include "clients/export/training_folder.h"

#include <map>
#include <opencv2/core.hpp>
#include <vector>

#include "clients/export/image_file.h"
#include "clients/export/undistortion.h"
#include "export/model_writer.h"
#include "export/nerfstudio.h"
#include "export/written_names.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

class TrainingFolder {
 public:
  TrainingFolder(const Reconstruction& model, const PhotoSource& photos,
                 const std::function<void()>& on_photo, const fs::path& folder)
      : model_(model), photos_(photos), on_photo_(on_photo), folder_(folder) {}

  Status Write(const std::set<std::string>& formats) {
    Status status = CheckSizes();
    if (status.ok()) status = FindBorders();
    if (!status.ok()) return status;
    names_ = FlatNames(model_, has_borders_ ? ".png" : ".jpg");
    fs::create_directories(folder_ / "images");
    if (has_borders_) fs::create_directories(folder_ / "masks");
    for (const auto& [camera_id, image_ids] : PhotosByCamera()) {
      status = WritePhotos(camera_id, image_ids);
      if (!status.ok()) return status;
    }
    RenameImages(names_, &undistorted_);
    status = WriteNames(model_, names_, folder_ / "images.names.txt");
    if (status.ok() && formats.count(kNerfstudio) > 0) status = WriteTransforms();
    if (status.ok() && formats.count(kGaussianSplatting) > 0) status = WriteSparse();
    return status;
  }

 private:
  using PhotosOfCamera = std::map<CameraId, std::vector<ImageId>>;

  PhotosOfCamera PhotosByCamera() const {
    PhotosOfCamera photos;
    for (const ImageId id : model_.RegImageIds()) {
      photos[model_.Image(id).CameraId()].push_back(id);
    }
    return photos;
  }

  // A camera's size is believed once a photo has it: memory is taken by it.
  Status CheckSizes() const {
    for (const auto& [camera_id, image_ids] : PhotosByCamera()) {
      const std::string& name = model_.Image(image_ids.front()).Name();
      const Result<cv::Mat3b> photo = ReadPhoto(photos_, name, model_.Camera(camera_id));
      if (!photo.ok()) return photo.status();
    }
    return Status::Ok();
  }

  // Before the first photo is written: its name depends on it.
  Status FindBorders() {
    for (const auto& [camera_id, image_ids] : PhotosByCamera()) {
      if (!Undistortion::MayHaveBorders(model_.Camera(camera_id))) continue;
      const Result<Undistortion> undistortion = Undistortion::Of(model_.Camera(camera_id));
      if (!undistortion.ok()) return undistortion.status();
      has_borders_ = has_borders_ || undistortion->has_borders();
    }
    return Status::Ok();
  }

  Status WritePhotos(CameraId camera_id, const std::vector<ImageId>& image_ids) {
    const Result<Undistortion> undistortion = Undistortion::Of(model_.Camera(camera_id));
    if (!undistortion.ok()) return undistortion.status();
    undistorted_.Camera(camera_id) = undistortion->camera();
    if (has_borders_) {
      const Status written = WriteImage(undistortion->mask(), folder_ / MaskPath(camera_id));
      if (!written.ok()) return written;
    }
    for (const ImageId id : image_ids) {
      if (Status status = WritePhoto(*undistortion, id); !status.ok()) return status;
      on_photo_();
    }
    return Status::Ok();
  }

  Status WritePhoto(const Undistortion& undistortion, ImageId id) {
    Image& image = undistorted_.Image(id);
    const Result<cv::Mat3b> photo =
        ReadPhoto(photos_, image.Name(), model_.Camera(image.CameraId()));
    if (!photo.ok()) return photo.status();
    for (Point2DIdx i = 0; i < image.NumPoints2D(); ++i) {
      image.Point2D(i).SetXY(undistortion.Apply(image.Point2D(i).XY()));
    }
    cv::Mat pixels = undistortion.Apply(*photo);
    if (has_borders_) cv::merge(std::vector<cv::Mat>{pixels, undistortion.mask()}, pixels);
    return WriteImage(pixels, folder_ / "images" / names_.at(id));
  }

  static std::string MaskPath(CameraId camera_id) {
    return "masks/camera-" + std::to_string(camera_id) + ".png";
  }

  Status WriteTransforms() const {
    return WriteNerfstudio(undistorted_, folder_, [this](const Image& image) {
      return NerfstudioFiles{"images/" + image.Name(),
                             has_borders_ ? MaskPath(image.CameraId()) : ""};
    });
  }

  Status WriteSparse() const {
    const fs::path sparse = folder_ / "sparse" / "0";
    fs::create_directories(sparse);
    return WriteModel(undistorted_, "bin", sparse);
  }

  const Reconstruction& model_;
  const PhotoSource& photos_;
  const std::function<void()>& on_photo_;
  const fs::path folder_;
  Reconstruction undistorted_ = model_;
  WrittenNames names_;
  bool has_borders_ = false;
};

}  // namespace

Status WriteTrainingFolder(const Reconstruction& model, const std::set<std::string>& formats,
                           const PhotoSource& photos, const std::function<void()>& on_photo,
                           const fs::path& folder) {
  return TrainingFolder(model, photos, on_photo, folder).Write(formats);
}

}  // namespace skein
