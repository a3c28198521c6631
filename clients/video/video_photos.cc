#include "clients/video/video_photos.h"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "codecs/photo_encoding.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr double kBatchS = 0.3;
constexpr double kRetryS = 2;

std::string UtcName(int64_t utime_us) {
  const std::time_t seconds = utime_us / 1'000'000;
  std::tm tm{};
  gmtime_r(&seconds, &tm);
  char day[32], name[48];
  std::strftime(day, sizeof day, "%Y%m%d-%H%M%S", &tm);
  std::snprintf(name, sizeof name, "%s-%03d.jpg", day, static_cast<int>(utime_us / 1000 % 1000));
  return name;
}

}  // namespace

VideoPhotos::VideoPhotos(PollLoop& loop, const std::string& source, std::filesystem::path folder,
                         const FramePickerOptions& options, std::set<std::string> known,
                         OnPhotos on_photos)
    : loop_(loop),
      source_name_(source),
      folder_(std::move(folder)),
      on_photos_(std::move(on_photos)),
      picker_(options),
      known_(std::move(known)),
      worker_(loop) {
  Result<VideoSource> opened = VideoSource::Open(source);
  if (!opened.ok()) throw std::runtime_error(opened.error());
  source_ = *std::move(opened);
  is_live_ = source_->is_live();
  if (source_->NumFrames() > 0) bar_ = std::make_unique<ProgressBar>("video", source_->NumFrames());
  ReadOn();
}

VideoPhotos::~VideoPhotos() { loop_.CancelTimer(retry_timer_); }

void VideoPhotos::ReadOn() {
  worker_.Run([this] { return Read(); }, [this](const Batch& batch) { OnBatch(batch); });
}

VideoPhotos::Batch VideoPhotos::Read() {
  Batch batch;
  const Timer timer;
  while (!batch.ended && timer.ElapsedS() < kBatchS) {
    const std::optional<VideoFrame> frame = source_->Next();
    batch.ended = !frame;
    batch.num_frames += frame ? 1 : 0;
    const std::optional<VideoFrame> photo = frame ? picker_.Add(*frame) : picker_.Finish();
    if (photo) Keep(*photo, &batch);
  }
  return batch;
}

void VideoPhotos::Keep(const VideoFrame& frame, Batch* batch) {
  const std::string name = NameOf(frame);
  if (!known_.insert(name).second) return;
  ExifInfo info;
  info.capture_utime_us = frame.utime_us;
  info.width = frame.image.cols;
  info.height = frame.image.rows;
  const Bytes jpeg = EncodePhoto(frame.image, &info, kJpegQuality);
  const Status written = WriteFileAtomic((folder_ / name).string(), jpeg);
  if (!written.ok()) throw std::runtime_error(written.error());
  batch->photos.push_back({folder_ / name, name});
}

std::string VideoPhotos::NameOf(const VideoFrame& frame) const {
  if (is_live_) return UtcName(frame.utime_us);
  // Of a series of images, what stands before the number.
  std::string stem = std::filesystem::path(source_name_).stem().string();
  stem = stem.substr(0, stem.find('%'));
  char index[24];
  std::snprintf(index, sizeof index, "%s%06lld.jpg", stem.empty() ? "frame-" : "-",
                static_cast<long long>(frame.index));
  return stem + index;
}

void VideoPhotos::OnBatch(const Batch& batch) {
  num_frames_ += batch.num_frames;
  num_photos_ += static_cast<int64_t>(batch.photos.size());
  if (bar_) bar_->Add(batch.num_frames);
  if (!batch.photos.empty()) on_photos_(batch.photos);
  if (!batch.ended) return ReadOn();
  done_ = !is_live_;
  if (done_) return;
  LogWarn("{} gives no more frames; opening it again every {} s", source_name_, kRetryS);
  retry_timer_ = loop_.AddTimer(kRetryS, [this] { OpenAgain(); });
}

void VideoPhotos::OpenAgain() {
  if (worker_.num_pending() > 0) return;
  worker_.Run(
      [this] {
        Result<VideoSource> opened = VideoSource::Open(source_name_);
        if (opened.ok()) source_ = *std::move(opened);
        return opened.ok();
      },
      [this](bool opened) {
        if (!opened) return;
        LogInfo("{} gives frames again", source_name_);
        loop_.CancelTimer(std::exchange(retry_timer_, 0));
        ReadOn();
      });
}

std::string VideoPhotos::Summary() const {
  return "video: " + std::to_string(num_photos_) + " new photos of " + std::to_string(num_frames_) +
         " frames";
}

}  // namespace skein
