// An agent's photos, offered to ingest until each is decided.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "event_loop/worker_thread.h"
#include "node/node.h"

namespace skein {

struct PublisherOptions {
  std::string agent;
  double rate_hz = 0;   // photos a second; 0: as fast as ingest takes them
  double focal_px = 0;  // at full resolution, where EXIF tells none; 0: not known
};

struct PhotoToOffer {
  std::string name;  // valid or not: ingest decides
  // Its bytes. Called once, on another thread.
  std::function<Result<Bytes>()> read;
  // Fields that the photo's EXIF may lack.
  int64_t capture_utime_us = 0;  // 0: not known
  bool has_gps = false;          // whether the next two are set: WGS84
  double latitude_deg = 0, longitude_deg = 0;
  std::optional<double> altitude_m;  // needs has_gps
};

// Outcome of offering one photo.
struct PublishedPhoto {
  std::string name;
  std::string blob_id;  // "": it could not be read
  int8_t status = 0;    // image_ack_t's STORED, DUPLICATE or REFUSED
  int8_t cause = 0;     // of REFUSED: failure_t's
  std::string reason;
};

// A photo's bytes and their hash.
struct LoadedPhoto {
  std::string blob_id;
  BlobPtr bytes;
};

// Reads each photo on another thread, serves its bytes, and repeats its offer until ingest has
// decided. Ingest answers offers of known photos at once, so a second run skips them. Loop's thread
// only.
class Publisher {
 public:
  using OnPublished = std::function<void(const PublishedPhoto&)>;

  Publisher(Node& node, PublisherOptions options, OnPublished on_published);
  ~Publisher();
  Publisher(const Publisher&) = delete;
  Publisher& operator=(const Publisher&) = delete;

  void Add(std::vector<PhotoToOffer> photos);
  bool done() const { return waiting_.empty() && offered_.empty(); }
  // Last reason to wait that ingest gave, "" if none.
  const std::string& wait_reason() const { return wait_reason_; }

 private:
  struct Offered {
    image_offer_t offer;
    bool ready = false;  // read, and served
    double due_s = 0;
    double interval_s = 0;
  };

  void Tick();
  bool MayStart(double now_s) const;
  void Start(double now_s);
  Result<LoadedPhoto> Load(const std::function<Result<Bytes>()>& read) const;
  void OnRead(const std::string& name, const Result<LoadedPhoto>& loaded);
  void OnAck(const image_ack_t& ack);
  void Finish(const PublishedPhoto& photo);

  Node& node_;
  const PublisherOptions options_;
  const OnPublished on_published_;
  std::deque<PhotoToOffer> waiting_;
  std::map<std::string, Offered> offered_;  // by name
  double next_start_s_ = 0;
  std::string wait_reason_;
  Bus::SubscriptionId ack_subscription_ = 0;
  PollLoop::TimerId timer_ = 0;
  WorkerThread worker_;  // last: ends first
};

}  // namespace skein
