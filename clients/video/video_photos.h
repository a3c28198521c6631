// The photos of a video, kept in a folder, so that an agent that dies has them when it starts
// again.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "clients/photo_folder.h"
#include "clients/progress_bar.h"
#include "clients/video/frame_picker.h"
#include "clients/video/video_source.h"
#include "event_loop/poll_loop.h"
#include "event_loop/worker_thread.h"

namespace skein {

// Reads the video on a thread of its own. A photo is a JPEG with the frame's time in its EXIF
// block: STEM-INDEX.jpg of a file, YYYYMMDD-HHMMSS-mmm.jpg (UTC) of a live source. A file gives the
// same photos each time. A live source that fails is opened again every 2 s. Loop's thread only.
class VideoPhotos {
 public:
  using OnPhotos = std::function<void(std::vector<PhotoFile>)>;

  // `known`: names in the folder that are not to be taken again. Throws std::runtime_error, with a
  // line for the user, when the source cannot be opened; on the loop's thread when the folder takes
  // no file.
  VideoPhotos(PollLoop& loop, const std::string& source, std::filesystem::path folder,
              const FramePickerOptions& options, std::set<std::string> known, OnPhotos on_photos);
  ~VideoPhotos();
  VideoPhotos(const VideoPhotos&) = delete;
  VideoPhotos& operator=(const VideoPhotos&) = delete;

  bool is_live() const { return is_live_; }
  // The file was read to its end, and all photos were handed to on_photos.
  bool done() const { return done_; }
  std::string Summary() const;

 private:
  struct Batch {
    std::vector<PhotoFile> photos;
    int64_t num_frames = 0;
    bool ended = false;
  };

  void ReadOn();
  void OnBatch(const Batch& batch);
  void OpenAgain();
  // On the worker's thread: Read, Keep, NameOf.
  Batch Read();
  void Keep(const VideoFrame& frame, Batch* batch);
  std::string NameOf(const VideoFrame& frame) const;

  PollLoop& loop_;
  const std::string source_name_;
  const std::filesystem::path folder_;
  const OnPhotos on_photos_;
  // Used by the worker alone while a job runs.
  std::optional<VideoSource> source_;
  FramePicker picker_;
  std::set<std::string> known_;

  bool is_live_ = false;
  bool done_ = false;
  int64_t num_frames_ = 0, num_photos_ = 0;
  std::unique_ptr<ProgressBar> bar_;  // of a file of known length
  PollLoop::TimerId retry_timer_ = 0;
  WorkerThread worker_;  // last: ends first
};

}  // namespace skein
