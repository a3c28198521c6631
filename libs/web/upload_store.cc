#include "web/upload_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "core/log.h"
#include "photo/photo_name.h"
#include "transport/invitation.h"

namespace skein {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr char kInfo[] = ".json", kPart[] = ".part", kWhole[] = ".photo";
constexpr size_t kHashPartBytes = 1 << 20;

// A descriptor that is closed at the end.
class OpenedFile {
 public:
  OpenedFile(const fs::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
  ~OpenedFile() {
    if (fd_ >= 0) ::close(fd_);
  }
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;
  int fd() const { return fd_; }

 private:
  const int fd_;
};

Status DiskStatus(const fs::path& path, const char* what) {
  const int error = errno;
  const std::string line =
      "cannot " + std::string(what) + " " + path.string() + ": " + std::strerror(error);
  LogWarn("{}", line);
  if (error == ENOSPC || error == EDQUOT) return Unavailable("the server's disk is full");
  return Unavailable("the server cannot store photos now; its log says why");
}

Status WriteAt(const fs::path& path, int64_t offset, const Bytes& bytes) {
  const OpenedFile file(path, O_WRONLY | O_CREAT);
  if (file.fd() < 0) return DiskStatus(path, "open");
  size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t n = ::pwrite(file.fd(), bytes.data() + written, bytes.size() - written,
                               static_cast<off_t>(offset + static_cast<int64_t>(written)));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return DiskStatus(path, "write");
    written += static_cast<size_t>(n);
  }
  return Status::Ok();
}

// The hash of what is on the disk, after a sync.
Result<std::string> SyncedHash(const fs::path& path) {
  const OpenedFile file(path, O_RDONLY);
  if (file.fd() < 0) return DiskStatus(path, "open");
  if (::fsync(file.fd()) != 0) return DiskStatus(path, "sync");
  Hasher hasher;
  Bytes part(kHashPartBytes);
  while (true) {
    const ssize_t n = ::read(file.fd(), part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return DiskStatus(path, "read");
    if (n == 0) return hasher.Finish();
    hasher.Update(part.data(), static_cast<size_t>(n));
  }
}

std::string TextOfInfo(const UploadInfo& info) {
  json text = {{"name", info.name}, {"bytes", info.size_bytes}, {"taken", info.capture_utime_us}};
  if (info.has_gps) text["gps"] = {info.latitude_deg, info.longitude_deg, info.altitude_m};
  return text.dump();
}

std::optional<UploadInfo> ReadInfo(const fs::path& path) {
  const Result<Bytes> bytes = ReadFile(path.string());
  if (!bytes.ok()) return std::nullopt;
  try {
    const json text = json::parse(bytes->begin(), bytes->end());
    UploadInfo info;
    info.name = text.at("name");
    info.size_bytes = text.at("bytes");
    info.capture_utime_us = text.at("taken");
    info.has_gps = text.contains("gps");
    if (info.has_gps) {
      info.latitude_deg = text["gps"].at(0);
      info.longitude_deg = text["gps"].at(1);
      info.altitude_m = text["gps"].at(2);
    }
    return info;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

Status NotReceiving() {
  return Unavailable("another connection sends this photo now, or it made way for other phones'");
}

int64_t FileBytes(const fs::path& path) {
  std::error_code error;
  const uintmax_t size = fs::file_size(path, error);
  return error ? -1 : static_cast<int64_t>(size);
}

}  // namespace

bool IsUploadAgent(const std::string& agent) { return IsInvitedName(agent); }

UploadStore::UploadStore(fs::path folder, UploadLimits limits, Clock clock)
    : folder_(std::move(folder)), limits_(limits), clock_(std::move(clock)) {
  if (const Status made = CreateFolders(folder_); !made.ok()) {
    throw std::runtime_error(made.error());
  }
  FindLeft();
}

fs::path UploadStore::PathOf(const Key& key, const char* ending) const {
  return folder_ / key.first / (key.second + ending);
}

// What a crash left of a photo without its bytes, or of bytes without what is known of them, goes.
void UploadStore::FindLeft() {
  std::vector<std::pair<fs::file_time_type, Key>> whole;
  for (const fs::path& path : FilesUnder(folder_)) {
    const Key key{path.parent_path().filename().string(), path.stem().string()};
    const bool is_ours = path.parent_path().parent_path() == folder_ && IsUploadAgent(key.first) &&
                         IsBlobId(key.second);
    std::error_code ignored;
    if (!is_ours || path.extension() != kInfo) {
      const bool has_info = is_ours && fs::exists(PathOf(key, kInfo), ignored);
      if (!has_info) fs::remove(path, ignored);
      continue;
    }
    const std::optional<UploadInfo> info = ReadInfo(path);
    const int64_t whole_bytes = FileBytes(PathOf(key, kWhole));
    const int64_t part_bytes = FileBytes(PathOf(key, kPart));
    const bool is_whole = info && whole_bytes == info->size_bytes;
    if (!info || (!is_whole && (part_bytes < 0 || part_bytes > info->size_bytes))) {
      Forget(key);
      continue;
    }
    Upload& upload = uploads_[key];
    upload.info = *info;
    upload.is_whole = is_whole;
    upload.received_bytes = is_whole ? info->size_bytes : part_bytes;
    upload.moved_s = clock_();
    if (is_whole) whole.emplace_back(fs::last_write_time(PathOf(key, kWhole), ignored), key);
  }
  std::sort(whole.begin(), whole.end());
  for (const auto& [time, key] : whole) uploads_.at(key).order = next_order_++;
  if (!whole.empty()) LogInfo("{} uploaded photos are offered again", whole.size());
}

int UploadStore::Count(const std::string& agent, bool Upload::*what) const {
  int count = 0;
  for (auto at = uploads_.lower_bound({agent, ""});
       at != uploads_.end() && at->first.first == agent; ++at) {
    count += at->second.*what;
  }
  return count;
}

std::optional<UploadStore::Progress> UploadStore::Look(const std::string& agent,
                                                       const std::string& blob_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = uploads_.find({agent, blob_id});
  if (found == uploads_.end()) return std::nullopt;
  Upload& upload = found->second;
  if (!upload.finishing) {
    upload.ticket = next_ticket_++;
    upload.receiving = false;
  }
  return Progress{upload.received_bytes, upload.info.size_bytes, upload.is_whole};
}

Status UploadStore::CheckBegin(const Key& key, const UploadInfo& info) const {
  if (!IsUploadAgent(key.first))
    return InvalidArgument("this invitation's name cannot send photos");
  if (!IsBlobId(key.second)) {
    return InvalidArgument("name the photo by its SHA-256, 64 lower-case hexadecimal digits");
  }
  if (Status status = CheckPhotoName(info.name); !status.ok()) return status;
  if (info.size_bytes <= 0) return InvalidArgument("the photo is empty");
  if (info.size_bytes > limits_.max_photo_bytes) {
    return ResourceExhausted("the photo has " + std::to_string(info.size_bytes) +
                             " bytes, more than " + std::to_string(limits_.max_photo_bytes) +
                             ": send it smaller");
  }
  return Status::Ok();
}

Status UploadStore::MakeRoom(const Key& key, int64_t more_bytes) {
  std::set<std::string> agents = {key.first};
  std::map<double, Key> resting;
  int num_unfinished = 0;
  for (const auto& [other, upload] : uploads_) {
    agents.insert(other.first);
    if (other.first != key.first || upload.is_whole) continue;
    ++num_unfinished;
    if (!upload.receiving && !upload.finishing) resting.emplace(upload.moved_s, other);
  }
  if (static_cast<int>(agents.size()) > limits_.max_agents) {
    return Unavailable("too many phones send photos at a time: try again later");
  }
  if (num_unfinished >= limits_.max_unfinished) {
    if (resting.empty()) return Unavailable("too many photos at a time: send one after the other");
    const Key rested = resting.begin()->second;
    Forget(rested);
    uploads_.erase(rested);
  }
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  const bool is_full =
      !error && static_cast<int64_t>(space.available) < limits_.min_free_bytes + more_bytes;
  if (is_full) return Unavailable("the server's disk is full: photos wait on the phone");
  return MakeRoomInShare(key.first, more_bytes);
}

// The bytes that are still to come count, too.
Status UploadStore::MakeRoomInShare(const std::string& agent, int64_t more_bytes) {
  const double now_s = clock_();
  std::map<std::string, int64_t> bytes_of = {{agent, more_bytes}};
  int64_t bytes = more_bytes;
  for (const auto& [key, upload] : uploads_) {
    bytes_of[key.first] += upload.info.size_bytes;
    bytes += upload.info.size_bytes;
  }
  bool others_want = false;
  for (auto at = wanted_s_.begin(); at != wanted_s_.end();) {
    const bool wants = now_s - at->second <= limits_.want_s;
    if (wants) bytes_of.try_emplace(at->first, 0);
    others_want = others_want || (wants && at->first != agent);
    at = wants ? std::next(at) : wanted_s_.erase(at);
  }
  const int64_t share = limits_.max_bytes / static_cast<int64_t>(bytes_of.size());
  const Status full =
      Unavailable("too many photos wait on the server: they go on once it has taken some in");
  if (bytes_of[agent] > share)
    return bytes > limits_.max_bytes || others_want ? full : Status::Ok();
  while (bytes > limits_.max_bytes) {
    std::set<std::string> beyond;
    for (const auto& [other, sum] : bytes_of) {
      if (sum > share) beyond.insert(other);
    }
    const std::optional<Key> silent = LongestSilent(beyond);
    if (!silent) {
      wanted_s_[agent] = now_s;
      return full;
    }
    const int64_t freed = uploads_.at(*silent).info.size_bytes;
    bytes_of[silent->first] -= freed;
    bytes -= freed;
    Forget(*silent);
    uploads_.erase(*silent);
  }
  wanted_s_.erase(agent);
  return Status::Ok();
}

// Of the unfinished photos of these agents. One that is received counts, too: else a connection
// that sends a byte now and then would keep its place.
std::optional<UploadStore::Key> UploadStore::LongestSilent(
    const std::set<std::string>& agents) const {
  const Upload* longest = nullptr;
  std::optional<Key> silent;
  for (const auto& [key, upload] : uploads_) {
    const bool may_go = !upload.is_whole && !upload.finishing && agents.count(key.first) > 0;
    if (!may_go || (longest != nullptr && longest->moved_s <= upload.moved_s)) continue;
    longest = &upload;
    silent = key;
  }
  return silent;
}

Status UploadStore::Create(const Key& key, const UploadInfo& info) {
  if (Status room = MakeRoom(key, info.size_bytes); !room.ok()) return room;
  if (Status made = CreateFolders(folder_ / key.first); !made.ok()) {
    LogWarn("{}", made.error());
    return Unavailable("the server cannot store photos now; its log says why");
  }
  const std::string text = TextOfInfo(info);
  if (Status written = WriteFileAtomic(PathOf(key, kInfo).string(), text.data(), text.size());
      !written.ok()) {
    LogWarn("{}", written.error());
    return Unavailable("the server cannot store photos now; its log says why");
  }
  if (Status begun = WriteAt(PathOf(key, kPart), 0, {}); !begun.ok()) return begun;
  uploads_[key].info = info;
  return Status::Ok();
}

Result<UploadStore::Receiver> UploadStore::Begin(const std::string& agent,
                                                 const std::string& blob_id, const UploadInfo& info,
                                                 int64_t offset) {
  const Key key{agent, blob_id};
  if (Status fit = CheckBegin(key, info); !fit.ok()) return fit;
  const std::lock_guard<std::mutex> lock(mutex_);
  auto found = uploads_.find(key);
  const int64_t known = found == uploads_.end() ? 0 : found->second.received_bytes;
  const bool is_over =
      found != uploads_.end() && (found->second.is_whole || found->second.finishing);
  const bool is_same = found == uploads_.end() || found->second.info.size_bytes == info.size_bytes;
  if (!is_same) {
    return InvalidArgument("the photo of that SHA-256 has " +
                           std::to_string(found->second.info.size_bytes) + " bytes, not " +
                           std::to_string(info.size_bytes));
  }
  if (offset != known || is_over) {
    return AlreadyExists("the server has " + std::to_string(known) + " bytes of it: go on there");
  }
  const bool is_receiving = found != uploads_.end() && found->second.receiving;
  if (!is_receiving && Count(agent, &Upload::receiving) >= limits_.max_receiving) {
    return Unavailable("too many photos at a time: send one after the other");
  }
  if (found == uploads_.end()) {
    if (Status created = Create(key, info); !created.ok()) return created;
  }
  Upload& upload = uploads_.at(key);
  upload.receiving = true;
  upload.ticket = next_ticket_++;
  upload.moved_s = clock_();
  return Receiver{agent, blob_id, upload.ticket};
}

// Null: another one receives it now, or it made way.
UploadStore::Upload* UploadStore::FindReceiving(const Receiver& receiver) {
  const auto found = uploads_.find({receiver.agent, receiver.blob_id});
  if (found == uploads_.end() || found->second.ticket != receiver.ticket) return nullptr;
  return &found->second;
}

// The lock is held while the part is written: a photo's bytes stand in its file before they count.
Result<UploadStore::Progress> UploadStore::Take(const Receiver& receiver, const Bytes& part) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Upload* upload = FindReceiving(receiver);
  if (upload == nullptr) return NotReceiving();
  const auto size = static_cast<int64_t>(part.size());
  if (upload->received_bytes + size > upload->info.size_bytes) {
    return ResourceExhausted("more bytes came than the photo has: " +
                             std::to_string(upload->info.size_bytes));
  }
  const Key key{receiver.agent, receiver.blob_id};
  if (Status written = WriteAt(PathOf(key, kPart), upload->received_bytes, part); !written.ok()) {
    return written;
  }
  upload->received_bytes += size;
  upload->moved_s = clock_();
  return Progress{upload->received_bytes, upload->info.size_bytes, false};
}

Status UploadStore::Finish(const Receiver& receiver) {
  const Key key{receiver.agent, receiver.blob_id};
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    Upload* upload = FindReceiving(receiver);
    if (upload == nullptr) return NotReceiving();
    if (upload->received_bytes != upload->info.size_bytes) {
      return InvalidArgument("the photo is not whole yet");
    }
    upload->finishing = true;
  }
  const Result<std::string> hash = SyncedHash(PathOf(key, kPart));
  std::function<void()> on_whole;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    Upload& upload = uploads_.at(key);  // one that is finishing stays
    upload.finishing = upload.receiving = false;
    if (!hash.ok()) return hash.status();
    if (*hash != key.second) {
      Forget(key);
      uploads_.erase(key);
      return DataLoss("the bytes that came are not the photo's: it is sent again from the start");
    }
    std::error_code error;
    fs::rename(PathOf(key, kPart), PathOf(key, kWhole), error);
    if (error) return Unavailable("the server cannot store photos now: " + error.message());
    if (Status synced = SyncFolder(folder_ / key.first); !synced.ok()) return synced;
    upload.is_whole = true;
    upload.order = next_order_++;
    on_whole = on_whole_;
  }
  if (on_whole) on_whole();
  return Status::Ok();
}

void UploadStore::Leave(const Receiver& receiver) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Upload* upload = FindReceiving(receiver);
  if (upload == nullptr || upload->finishing) return;
  upload->receiving = false;
  upload->ticket = next_ticket_++;
}

std::map<std::string, UploadStore::Progress> UploadStore::ProgressOf(
    const std::string& agent) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::map<std::string, Progress> progress;
  for (auto at = uploads_.lower_bound({agent, ""});
       at != uploads_.end() && at->first.first == agent; ++at) {
    const Upload& upload = at->second;
    progress[at->first.second] = {upload.received_bytes, upload.info.size_bytes, upload.is_whole};
  }
  return progress;
}

std::vector<WaitingUpload> UploadStore::Waiting() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::vector<std::pair<int64_t, WaitingUpload>> ordered;
  for (const auto& [key, upload] : uploads_) {
    if (!upload.is_whole) continue;
    ordered.push_back({upload.order, {key.first, key.second, upload.info, PathOf(key, kWhole)}});
  }
  std::sort(ordered.begin(), ordered.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<WaitingUpload> waiting;
  for (auto& [order, upload] : ordered) waiting.push_back(std::move(upload));
  return waiting;
}

void UploadStore::Remove(const std::string& agent, const std::string& blob_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Forget({agent, blob_id});
  uploads_.erase({agent, blob_id});
}

// What is known of it goes last: what a crash leaves is found by it.
void UploadStore::Forget(const Key& key) {
  std::error_code ignored;
  for (const char* ending : {kPart, kWhole, kInfo}) fs::remove(PathOf(key, ending), ignored);
}

void UploadStore::Tick() {
  const std::lock_guard<std::mutex> lock(mutex_);
  const double now_s = clock_();
  for (auto at = uploads_.begin(); at != uploads_.end();) {
    const Upload& upload = at->second;
    const bool rests = !upload.is_whole && !upload.receiving && !upload.finishing &&
                       now_s - upload.moved_s > limits_.forget_after_s;
    if (rests) Forget(at->first);
    at = rests ? uploads_.erase(at) : std::next(at);
  }
}

void UploadStore::OnWhole(std::function<void()> on_whole) {
  const std::lock_guard<std::mutex> lock(mutex_);
  on_whole_ = std::move(on_whole);
}

void UploadStore::SetWaitReason(const std::string& agent, const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (reason.empty()) {
    wait_reasons_.erase(agent);
  } else {
    wait_reasons_[agent] = reason;
  }
}

std::string UploadStore::WaitReason(const std::string& agent) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = wait_reasons_.find(agent);
  return found == wait_reasons_.end() ? "" : found->second;
}

int64_t UploadStore::bytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  int64_t sum = 0;
  for (const auto& [key, upload] : uploads_) sum += upload.received_bytes;
  return sum;
}

}  // namespace skein
