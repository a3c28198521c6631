#include "web/thumbnails.h"

#include <opencv2/imgcodecs.hpp>

#include "photo/image_view.h"

namespace skein {
namespace {

constexpr int kThumbnailQuality = 80;

}  // namespace

Result<Bytes> ThumbnailMaker::Make(const Bytes& photo, int exif_orientation, int max_side_px) {
  if (decoder_ == nullptr) {
    Result<std::unique_ptr<PhotoDecoder>> decoder = PhotoDecoder::Start();
    if (!decoder.ok()) return decoder.status();
    decoder_ = *std::move(decoder);
  }
  const Result<DecodedPhoto> decoded = decoder_->Decode(photo, max_side_px);
  if (!decoded.ok()) return decoded.status();
  const cv::Mat thumbnail = UprightView(ShrinkTo(decoded->image, max_side_px), exif_orientation);
  Bytes jpeg;
  if (!cv::imencode(".jpg", thumbnail, jpeg, {cv::IMWRITE_JPEG_QUALITY, kThumbnailQuality})) {
    return Unavailable("OpenCV could not encode a JPEG");
  }
  return jpeg;
}

std::shared_ptr<const Bytes> ThumbnailCache::Find(int64_t image_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto place = places_.find(image_id);
  if (place == places_.end()) return nullptr;
  recent_.splice(recent_.begin(), recent_, place->second);
  return place->second->second;
}

void ThumbnailCache::Add(int64_t image_id, std::shared_ptr<const Bytes> jpeg) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (jpeg->size() > max_bytes_ || places_.count(image_id) > 0) return;
  used_bytes_ += jpeg->size();
  recent_.emplace_front(image_id, std::move(jpeg));
  places_[image_id] = recent_.begin();
  while (used_bytes_ > max_bytes_) {
    used_bytes_ -= recent_.back().second->size();
    places_.erase(recent_.back().first);
    recent_.pop_back();
  }
}

size_t ThumbnailCache::size_bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return used_bytes_;
}

}  // namespace skein
