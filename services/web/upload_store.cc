#include "web/upload_store.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>

#include "core/attempt.h"
#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"
#include "core/log.h"
#include "photo/photo_check.h"
#include "photo/photo_name.h"
#include "transport/invitation.h"

namespace skein {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

constexpr char kInfo[] = ".json", kPart[] = ".part", kWhole[] = ".photo";
constexpr size_t kHashPartBytes = 1 << 20;
constexpr size_t kMaxInfoBytes = 64 << 10;
constexpr size_t kMaxUploadAgents = 256;

// What a phone is told of a disk that refuses.
Status DiskStatus(const Status& failed) {
  LogWarn("{}", failed.error());
  if (failed.code == StatusCode::kResourceExhausted) {
    return Unavailable("the server's disk is full");
  }
  return Unavailable("the server cannot store photos now; its log says why");
}
Status DiskStatus(const fs::path& path, const char* what) {
  return DiskStatus(FileError(std::string("cannot ") + what, path.string(), errno));
}

// UPLOADS/AGENT/FILE of a session.
Result<FileDescriptor> OpenUpload(const fs::path& path, int flags) {
  Result<FileDescriptor> file = OpenFileBelow(SessionOfUpload(path), path, flags);
  if (!file.ok()) return DiskStatus(file.status());
  return file;
}

Status CreateFile(const fs::path& path) { return OpenUpload(path, O_WRONLY | O_CREAT).status(); }

Status WriteAt(const fs::path& path, int64_t offset, const Bytes& bytes) {
  const Result<FileDescriptor> file = OpenUpload(path, O_WRONLY);
  if (!file.ok()) return file.status();
  size_t written = 0;
  while (written < bytes.size()) {
    const ssize_t n = ::pwrite(file->get(), bytes.data() + written, bytes.size() - written,
                               static_cast<off_t>(offset + static_cast<int64_t>(written)));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return DiskStatus(path, "write");
    written += static_cast<size_t>(n);
  }
  return Status::Ok();
}

// The hash of what is on the disk, after a sync.
Result<std::string> SyncedHash(const fs::path& path) {
  const Result<FileDescriptor> file = OpenUpload(path, O_RDONLY);
  if (!file.ok()) return file.status();
  if (::fsync(file->get()) != 0) return DiskStatus(path, "sync");
  Hasher hasher;
  Bytes part(kHashPartBytes);
  while (true) {
    const ssize_t n = ::read(file->get(), part.data(), part.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return DiskStatus(path, "read");
    if (n == 0) return hasher.Finish();
    hasher.Update(part.data(), static_cast<size_t>(n));
  }
}

std::string TextOfInfo(const UploadInfo& info) {
  json text = {{"name", info.name}, {"bytes", info.size_bytes}, {"taken", info.capture_utime_us}};
  if (info.has_gps) text["gps"] = {info.latitude_deg, info.longitude_deg};
  if (info.has_gps && info.altitude_m) text["gps"].push_back(*info.altitude_m);
  return text.dump();
}

std::optional<UploadInfo> ReadInfo(const fs::path& path) {
  const Result<Bytes> bytes = ReadFileBelow(SessionOfUpload(path), path, kMaxInfoBytes);
  if (!bytes.ok()) return std::nullopt;
  try {
    const json text = json::parse(bytes->begin(), bytes->end());
    UploadInfo info;
    info.name = text.at("name");
    info.size_bytes = text.at("bytes");
    if (info.size_bytes <= 0 || info.size_bytes > kMaxPhotoBytes) return std::nullopt;
    info.capture_utime_us = text.at("taken");
    info.has_gps = text.contains("gps");
    if (info.has_gps) {
      info.latitude_deg = text["gps"].at(0);
      info.longitude_deg = text["gps"].at(1);
      if (text["gps"].size() > 2) info.altitude_m = text["gps"].at(2).get<double>();
    }
    return info;
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

Status StillAtIt() { return Unavailable("the server is still at this photo: try again"); }

Status NotReceiving() {
  return Unavailable("another connection sends this photo now, or it made way for other phones'");
}

int64_t FileBytes(const fs::path& path) {
  std::error_code error;
  const uintmax_t size = fs::file_size(path, error);
  return error ? -1 : static_cast<int64_t>(size);
}

}  // namespace

fs::path SessionOfUpload(const fs::path& file) {
  return file.parent_path().parent_path().parent_path();
}

bool IsUploadAgent(const std::string& agent) { return IsInvitedName(agent); }

UploadStore::UploadStore(fs::path folder, UploadLimits limits, RunJob run_job, Clock clock)
    : folder_(std::move(folder)),
      limits_(limits),
      run_job_(std::move(run_job)),
      clock_(std::move(clock)) {
  Status made = CreateFolders(folder_.parent_path());
  if (made.ok()) made = CreateFoldersBelow(folder_.parent_path(), folder_);
  if (!made.ok()) throw std::runtime_error(made.error());
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
      DeleteFiles(key);
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

int UploadStore::NumAtWork(const std::string& agent) const {
  int count = 0;
  for (auto at = uploads_.lower_bound({agent, ""});
       at != uploads_.end() && at->first.first == agent; ++at) {
    count += at->second.IsAtWork();
  }
  return count;
}

std::optional<UploadStore::Progress> UploadStore::Look(const std::string& agent,
                                                       const std::string& blob_id) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = uploads_.find({agent, blob_id});
  if (found == uploads_.end()) return std::nullopt;
  Upload& upload = found->second;
  upload.ticket = next_ticket_++;
  upload.receiving = false;
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

Status UploadStore::CheckDisk(int64_t more_bytes) const {
  std::error_code error;
  const fs::space_info space = fs::space(folder_, error);
  const bool is_full =
      !error && static_cast<int64_t>(space.available) < limits_.min_free_bytes + more_bytes;
  return is_full ? Unavailable("the server's disk is full: photos wait on the phone")
                 : Status::Ok();
}

Status UploadStore::MakeRoom(const Key& key, int64_t more_bytes, const Status& disk) {
  std::set<std::string> agents = {key.first};
  std::map<double, Key> resting;
  int num_unfinished = 0;
  for (const auto& [other, upload] : uploads_) {
    agents.insert(other.first);
    if (other.first != key.first || upload.is_whole) continue;
    ++num_unfinished;
    if (upload.Rests()) resting.emplace(upload.moved_s, other);
  }
  if (agents.size() > kMaxUploadAgents) {
    return Unavailable("too many phones send photos at a time: try again later");
  }
  if (num_unfinished >= kMaxUnfinished) {
    if (resting.empty()) return Unavailable("too many photos at a time: send one after the other");
    Drop(resting.begin()->second);
  }
  if (!disk.ok()) return disk;
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
    const bool wants = now_s - at->second <= kWantS;
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
    Drop(*silent);
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
    const bool may_go = upload.MayGo() && agents.count(key.first) > 0;
    if (!may_go || (longest != nullptr && longest->moved_s <= upload.moved_s)) continue;
    longest = &upload;
    silent = key;
  }
  return silent;
}

Status UploadStore::CreateFiles(const Key& key, const UploadInfo& info) const {
  const std::string text = TextOfInfo(info);
  const fs::path info_path = PathOf(key, kInfo), root = SessionOfUpload(info_path);
  Status made = CreateFoldersBelow(root, info_path.parent_path());
  if (made.ok()) made = WriteFileBelow(root, info_path, text.data(), text.size());
  if (made.ok()) return CreateFile(PathOf(key, kPart));
  LogWarn("{}", made.error());
  return Unavailable("the server cannot store photos now; its log says why");
}

Result<UploadStore::Receiver> UploadStore::Begin(const std::string& agent,
                                                 const std::string& blob_id, const UploadInfo& info,
                                                 int64_t offset) {
  const Key key{agent, blob_id};
  if (Status fit = CheckBegin(key, info); !fit.ok()) return fit;
  bool is_new = false;
  Result<Receiver> receiver = Reserve(key, info, offset, CheckDisk(info.size_bytes), &is_new);
  StartDeletes();
  if (!receiver.ok() || !is_new) return receiver;
  const Status created = Attempt([&] { return CreateFiles(key, info); });
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    uploads_.at(key).busy = false;  // one that is busy stays
    if (!created.ok()) Drop(key);
  }
  if (created.ok()) return receiver;
  StartDeletes();
  return created;
}

// Of a new photo: it is busy until its files are there.
Result<UploadStore::Receiver> UploadStore::Reserve(const Key& key, const UploadInfo& info,
                                                   int64_t offset, const Status& disk,
                                                   bool* is_new) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (dropped_.count(key) > 0) return StillAtIt();
  const auto found = uploads_.find(key);
  *is_new = found == uploads_.end();
  if (!*is_new && found->second.info.size_bytes != info.size_bytes) {
    return InvalidArgument("the photo of that SHA-256 has " +
                           std::to_string(found->second.info.size_bytes) + " bytes, not " +
                           std::to_string(info.size_bytes));
  }
  if (!*is_new && found->second.busy) return StillAtIt();
  const int64_t known = *is_new ? 0 : found->second.received_bytes;
  if (offset != known || (!*is_new && found->second.is_whole)) {
    return AlreadyExists("the server has " + std::to_string(known) + " bytes of it: go on there");
  }
  const bool is_receiving = !*is_new && found->second.receiving;
  if (!is_receiving && NumAtWork(key.first) >= kMaxReceiving) {
    return Unavailable("too many photos at a time: send one after the other");
  }
  if (*is_new) {
    if (Status room = MakeRoom(key, info.size_bytes, disk); !room.ok()) return room;
    uploads_[key].info = info;
    uploads_[key].busy = true;
  }
  Upload& upload = uploads_.at(key);
  upload.receiving = true;
  upload.ticket = next_ticket_++;
  upload.moved_s = clock_();
  return Receiver{key.first, key.second, upload.ticket};
}

// Null: another one receives it now, or it made way.
UploadStore::Upload* UploadStore::FindReceiving(const Receiver& receiver) {
  const auto found = uploads_.find({receiver.agent, receiver.blob_id});
  if (found == uploads_.end() || found->second.ticket != receiver.ticket) return nullptr;
  return &found->second;
}

// The part counts once it stands in its file, and only if its receiver is still the one.
Result<UploadStore::Progress> UploadStore::Take(const Receiver& receiver, const Bytes& part) {
  const Key key{receiver.agent, receiver.blob_id};
  const auto size = static_cast<int64_t>(part.size());
  int64_t offset = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    Upload* upload = FindReceiving(receiver);
    if (upload == nullptr) return NotReceiving();
    if (upload->busy) return StillAtIt();
    if (upload->received_bytes + size > upload->info.size_bytes) {
      return ResourceExhausted("more bytes came than the photo has: " +
                               std::to_string(upload->info.size_bytes));
    }
    upload->busy = true;
    offset = upload->received_bytes;
  }
  const Status written = Attempt([&] { return WriteAt(PathOf(key, kPart), offset, part); });
  const std::lock_guard<std::mutex> lock(mutex_);
  Upload& upload = uploads_.at(key);  // one that is busy stays
  upload.busy = false;
  if (!written.ok()) return written;
  if (upload.ticket != receiver.ticket) return NotReceiving();
  upload.received_bytes += size;
  upload.moved_s = clock_();
  return Progress{upload.received_bytes, upload.info.size_bytes, false};
}

// Checks all bytes; durable under its last name when this returns Ok.
Status UploadStore::MakeWhole(const Key& key) const {
  std::error_code error;
  const bool is_renamed = fs::exists(PathOf(key, kWhole), error);  // by a call whose sync failed
  const Result<std::string> hash = SyncedHash(PathOf(key, is_renamed ? kWhole : kPart));
  if (!hash.ok()) return hash.status();
  if (*hash != key.second) {
    return DataLoss("the bytes that came are not the photo's: it is sent again from the start");
  }
  if (!is_renamed) fs::rename(PathOf(key, kPart), PathOf(key, kWhole), error);
  if (error) return Unavailable("the server cannot store photos now: " + error.message());
  return SyncFolder(folder_ / key.first);
}

Status UploadStore::Finish(const Receiver& receiver) {
  const Key key{receiver.agent, receiver.blob_id};
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    Upload* upload = FindReceiving(receiver);
    if (upload == nullptr) return NotReceiving();
    if (upload->busy) return StillAtIt();
    if (upload->received_bytes != upload->info.size_bytes) {
      return InvalidArgument("the photo is not whole yet");
    }
    upload->busy = true;
  }
  const Status made = Attempt([&] { return MakeWhole(key); });
  bool deletes = false;
  std::function<void()> on_whole;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    Upload& upload = uploads_.at(key);  // one that is busy stays
    upload.busy = upload.receiving = false;
    if (made.ok()) {
      upload.is_whole = true;
      upload.order = next_order_++;
      on_whole = on_whole_;
    } else if (made.code == StatusCode::kDataLoss) {
      Drop(key);
      deletes = deleting_.insert(key.first).second;
    }
  }
  if (deletes) DeleteAllOf(key.first);  // not by a job: it is sent again at once
  if (on_whole) on_whole();
  return made;
}

void UploadStore::Leave(const Receiver& receiver) {
  const std::lock_guard<std::mutex> lock(mutex_);
  Upload* upload = FindReceiving(receiver);
  if (upload == nullptr) return;
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

// A photo that is busy is not whole: it came again, and goes its way.
void UploadStore::Remove(const std::string& agent, const std::string& blob_id) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto found = uploads_.find({agent, blob_id});
    if (found == uploads_.end() || found->second.busy) return;
    Drop(found->first);
  }
  StartDeletes();
}

void UploadStore::Refuse(const std::string& agent, const std::string& blob_id,
                         const Refusal& refusal) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    auto& refusals = refusals_[agent];
    refusals.emplace_back(blob_id, refusal);
    if (refusals.size() > kMaxRefusals) refusals.pop_front();
  }
  Remove(agent, blob_id);
}

std::map<std::string, UploadStore::Refusal> UploadStore::Refusals(const std::string& agent) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = refusals_.find(agent);
  std::map<std::string, Refusal> refusals;
  if (found == refusals_.end()) return refusals;
  for (const auto& [blob_id, refusal] : found->second) refusals[blob_id] = refusal;
  return refusals;
}

// With the lock; StartDeletes follows without it.
void UploadStore::Drop(const Key& key) {
  dropped_.insert(key);
  uploads_.erase(key);
}

void UploadStore::StartDeletes() {
  std::vector<std::string> agents;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const Key& key : dropped_) {
      if (deleting_.insert(key.first).second) agents.push_back(key.first);
    }
  }
  for (const std::string& agent : agents) run_job_([this, agent] { DeleteAllOf(agent); });
}

// Of an agent that is in deleting_, until nothing more is to go.
void UploadStore::DeleteAllOf(const std::string& agent) {
  while (true) {
    std::vector<Key> keys;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      keys = DroppedOf(agent);
      if (keys.empty()) {
        deleting_.erase(agent);
        return;
      }
    }
    for (const Key& key : keys) DeleteFiles(key);
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const Key& key : keys) dropped_.erase(key);
  }
}

std::vector<UploadStore::Key> UploadStore::DroppedOf(const std::string& agent) const {
  std::vector<Key> keys;
  for (auto at = dropped_.lower_bound({agent, ""}); at != dropped_.end() && at->first == agent;
       ++at) {
    keys.push_back(*at);
  }
  return keys;
}

// What is known of it goes last: what a crash leaves is found by it.
void UploadStore::DeleteFiles(const Key& key) const {
  std::error_code ignored;
  for (const char* ending : {kPart, kWhole, kInfo}) fs::remove(PathOf(key, ending), ignored);
}

void UploadStore::Tick() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    const double now_s = clock_();
    std::vector<Key> forgotten;
    for (const auto& [key, upload] : uploads_) {
      const bool rests = upload.Rests() && now_s - upload.moved_s > kForgetAfterS;
      if (rests) forgotten.push_back(key);
    }
    for (const Key& key : forgotten) Drop(key);
  }
  StartDeletes();
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
