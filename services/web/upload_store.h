// Photos on their way from a browser to ingest, in the session folder.
//
//   uploads/AGENT/SHA256.json   properties of the photo (UploadInfo), from its first byte on
//   uploads/AGENT/SHA256.part   the bytes that have come
//   uploads/AGENT/SHA256.photo  all bytes, with that hash, synced: may be offered to ingest
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/clock.h"
#include "core/result.h"

namespace skein {

struct UploadLimits {
  int64_t max_photo_bytes = int64_t{256} << 20;  // as ingest has it
  int64_t max_bytes = int64_t{8} << 30;          // sum of the size_bytes of all photos here
  int64_t min_free_bytes = 512'000'000;          // on the disk
};

// Properties of a photo, as the browser tells them.
struct UploadInfo {
  std::string name;
  int64_t size_bytes = 0;
  int64_t capture_utime_us = 0;  // 0: not known
  bool has_gps = false;          // whether the next two are set: WGS84
  double latitude_deg = 0, longitude_deg = 0;
  std::optional<double> altitude_m;  // needs has_gps
};

struct WaitingUpload {
  std::string agent;
  std::string blob_id;
  UploadInfo info;
  std::filesystem::path path;
};

// Thread-safe. A call that writes files may block, but does not block calls for other photos: files
// are written and deleted without the lock. A call for a photo whose files are being written
// returns kUnavailable. Files are deleted by jobs, one at a time for an agent. A photo has one
// receiver, the latest: Begin invalidates an earlier one, whose connection may be lost without
// notice.
//
// If max_bytes are taken, share = max_bytes / (number of agents that are here or want room).
// Eviction: if an agent is within its share, its new upload evicts an unfinished one of an agent
// beyond its share, least recently active first, whose phone begins it again. Whole photos stay. An
// agent beyond its share begins nothing while another one wants room.
class UploadStore {
 public:
  static constexpr size_t kMaxRefusals = 200;
  static constexpr int kMaxUnfinished = 16;  // of an agent; evicts the least recently active
  static constexpr int kMaxReceiving = 4;    // of an agent at a time, waiting for the disk or not
  static constexpr double kForgetAfterS = 86'400;  // inactive unfinished photos are then deleted
  // Time for which an agent counts as wanting room after a refusal for lack of room. Longer than
  // the pause of a phone between two attempts.
  static constexpr double kWantS = 60;

  // Destination of a photo's bytes from one connection.
  struct Receiver {
    std::string agent;
    std::string blob_id;
    int64_t ticket = 0;
  };
  struct Progress {
    int64_t received_bytes = 0;
    int64_t size_bytes = 0;
    bool is_stored = false;  // checked and durable
  };

  struct Refusal {
    int8_t cause = 0;  // failure_t's
    std::string reason;
  };

  // Runs a job, at once or on another thread.
  using RunJob = std::function<void(std::function<void()>)>;

  // Takes over the uploads that an earlier process left in `folder`. Throws std::runtime_error,
  // with a line for the user, if the folder cannot be read or made. All jobs must end before the
  // store is destroyed.
  UploadStore(std::filesystem::path folder, UploadLimits limits, RunJob run_job,
              Clock clock = MonotonicS);

  // Progress of a photo; nullopt if the store has no byte of it. Invalidates the photo's receiver,
  // so `received_bytes` stays true until the next Begin. Bytes that are being written do not count.
  std::optional<Progress> Look(const std::string& agent, const std::string& blob_id);

  // Returns a receiver for the bytes from `offset` on. kAlreadyExists: `offset` differs from
  // Progress::received_bytes. kInvalidArgument: the photo will never be taken. kResourceExhausted:
  // the photo is too large. kUnavailable: try again later.
  Result<Receiver> Begin(const std::string& agent, const std::string& blob_id,
                         const UploadInfo& info, int64_t offset);
  Result<Progress> Take(const Receiver& receiver, const Bytes& part);
  // Call it after the last byte. Ok: the photo is durable. kDataLoss: the bytes have another hash
  // and were deleted.
  Status Finish(const Receiver& receiver);
  void Leave(const Receiver& receiver);

  // Progress of all photos of an agent, by blob id.
  std::map<std::string, Progress> ProgressOf(const std::string& agent) const;
  // Whole photos, in the order in which they came.
  std::vector<WaitingUpload> Waiting() const;
  // Removes a photo that the ledger has. Returns before the files are deleted.
  void Remove(const std::string& agent, const std::string& blob_id);
  // Removes a photo that ingest refused. `Refusals` has the last kMaxRefusals refusals of an agent.
  void Refuse(const std::string& agent, const std::string& blob_id, const Refusal& refusal);
  // By blob.
  std::map<std::string, Refusal> Refusals(const std::string& agent) const;

  // Deletes unfinished photos that were inactive for kForgetAfterS. Returns before that.
  void Tick();
  // Sets a function that is called when a photo is whole, on any thread, without the store's lock.
  void OnWhole(std::function<void()> on_whole);

  // Reason why the photos of an agent are not offered to ingest now; "" if they are.
  void SetWaitReason(const std::string& agent, const std::string& reason);
  std::string WaitReason(const std::string& agent) const;

  int64_t bytes() const;

 private:
  struct Upload {
    UploadInfo info;
    int64_t received_bytes = 0;
    bool is_whole = false;
    int64_t ticket = 0;  // of its receiver
    bool receiving = false;
    // A thread writes its files without the lock: no other thread may write or evict them.
    bool busy = false;
    double moved_s = 0;
    int64_t order = 0;

    bool MayGo() const { return !is_whole && !busy; }
    bool Rests() const { return MayGo() && !receiving; }
    bool IsAtWork() const { return receiving || busy; }
  };
  using Key = std::pair<std::string, std::string>;  // agent, blob

  std::filesystem::path PathOf(const Key& key, const char* ending) const;
  void FindLeft();
  Status CheckBegin(const Key& key, const UploadInfo& info) const;
  Status CheckDisk(int64_t more_bytes) const;
  Result<Receiver> Reserve(const Key& key, const UploadInfo& info, int64_t offset,
                           const Status& disk, bool* is_new);
  Status MakeRoom(const Key& key, int64_t more_bytes, const Status& disk);
  Status MakeRoomInShare(const std::string& agent, int64_t more_bytes);
  std::optional<Key> LongestSilent(const std::set<std::string>& agents) const;
  Status CreateFiles(const Key& key, const UploadInfo& info) const;
  Status MakeWhole(const Key& key) const;
  Upload* FindReceiving(const Receiver& receiver);
  void Drop(const Key& key);
  void StartDeletes();
  void DeleteAllOf(const std::string& agent);
  std::vector<Key> DroppedOf(const std::string& agent) const;
  void DeleteFiles(const Key& key) const;
  int NumAtWork(const std::string& agent) const;

  const std::filesystem::path folder_;
  const UploadLimits limits_;
  const RunJob run_job_;
  const Clock clock_;
  mutable std::mutex mutex_;
  std::map<Key, Upload> uploads_;                    // guarded by mutex_
  std::set<Key> dropped_;                            // guarded by mutex_; their files are to go
  std::set<std::string> deleting_;                   // guarded by mutex_; agents that have a job
  std::map<std::string, double> wanted_s_;           // guarded by mutex_; room, by agent: when
  std::map<std::string, std::string> wait_reasons_;  // guarded by mutex_
  // By agent: blob and refusal, the latest last. Guarded by mutex_.
  std::map<std::string, std::deque<std::pair<std::string, Refusal>>> refusals_;
  int64_t next_ticket_ = 1;         // guarded by mutex_
  int64_t next_order_ = 1;          // guarded by mutex_
  std::function<void()> on_whole_;  // guarded by mutex_
};

// The session folder of an upload's file, SESSION/uploads/AGENT/FILE.
std::filesystem::path SessionOfUpload(const std::filesystem::path& file);

// Whether a browser's agent may have this name here: one that may stand in an invitation.
bool IsUploadAgent(const std::string& agent);

}  // namespace skein
