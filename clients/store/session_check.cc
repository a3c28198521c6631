#include "clients/store/session_check.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "auth/session_keys.h"
#include "blobs/blob_store.h"
#include "core/checksum_list.h"
#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"
#include "ledger/ledger_record.h"
#include "ledger/write_ahead_log.h"
#include "session/needed_blobs.h"
#include "session/session_state.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

using Remedy = Finding::Remedy;

class Checker {
 public:
  Checker(const SessionPaths& paths, const Progress& progress)
      : paths_(paths), progress_(progress), store_(paths.Blobs()) {}

  SessionCheck Run() {
    CheckEntries();
    CheckSessionFile();
    CheckLedger();
    CheckBlobs();
    CheckNeeded();
    CheckPhotos();
    CheckRetrieval();
    CheckResults();
    CheckKeys();
    CheckUploads();
    if (num_more_ > 0) {
      check_.findings.push_back({"folder", std::to_string(num_more_) + " more findings", worst_});
    }
    return std::move(check_);
  }

 private:
  void Add(std::string what, std::string problem, Remedy remedy) {
    if (check_.findings.size() < SessionCheck::kMaxFindings) {
      check_.findings.push_back({std::move(what), std::move(problem), remedy});
      return;
    }
    ++num_more_;
    worst_ = std::max(worst_, remedy);
  }
  // "" if it cannot be read. Throws if this process has no descriptors left.
  std::string HashOfFile(const fs::path& file) const {
    const Result<std::string> hash = RequireDescriptors(HashFileBelow(paths_.root, file));
    return hash.ok() ? *hash : "";
  }
  // "" if there are less.
  std::string LastBytes(const fs::path& file, size_t size) const {
    const Result<FileDescriptor> opened =
        RequireDescriptors(OpenFileBelow(paths_.root, file, O_RDONLY));
    if (!opened.ok()) return "";
    std::string last(size, '\0');
    const off_t at = ::lseek(opened->get(), 0, SEEK_END) - static_cast<off_t>(size);
    const bool is_read =
        at >= 0 && ::pread(opened->get(), last.data(), size, at) == static_cast<ssize_t>(size);
    return is_read ? last : "";
  }
  std::string NameOf(const std::string& blob) const { return Relative(store_.Path(blob)); }
  std::string Relative(const fs::path& file) const {
    return file.lexically_relative(paths_.root).string();
  }
  void Count() {
    if (progress_ && num_files_ > 0) progress_(static_cast<double>(++num_read_) / num_files_);
  }

  void CheckEntries() {
    check_.odd_entries = OddEntriesUnder(paths_.root);
    for (const OddEntry& odd : check_.odd_entries) {
      Add(Relative(odd.path), "is " + odd.kind + ", which is not opened", Remedy::kRepair);
    }
  }

  void CheckSessionFile() {
    const Result<Session> session = RequireDescriptors(OpenSession(paths_.root));
    check_.has_sound_session_file = session.ok();
    if (session.ok()) {
      check_.session_id = session->session_id;
    } else {
      Add("session.json", session.error(), Remedy::kRepair);
    }
  }

  // Photos that it told of are taken in again.
  void CheckWriteAheadLog() {
    const fs::path log = paths_.Ledger().string() + "-wal";
    const std::string damage = DamageOfWriteAheadLog(log);
    if (!damage.empty()) Add("ledger.db-wal", damage, Remedy::kNone);
  }

  void CheckLedger() {
    CheckWriteAheadLog();
    check_.ledger = Ledger::Survey(paths_.Ledger());
    if (!check_.ledger.IsWhole()) HashOfFile(paths_.Ledger());
    for (const std::string& damage : check_.ledger.damage) {
      Add("ledger.db", damage, Remedy::kMakeAnew);
    }
    std::map<std::string, size_t> ids;
    for (const LedgerRecord& record : check_.ledger.records) {
      const Result<Fact> fact = DecodeRecord(record);
      if (fact.ok()) {
        check_.facts.push_back(*fact);
        ++ids[Header(*fact).session_id];
      } else {
        if (check_.ledger.damage.size() < LedgerSurvey::kMaxDamage) {
          check_.ledger.damage.push_back(fact.error());
        }
        Add("ledger.db", fact.error(), Remedy::kMakeAnew);
      }
    }
    CheckSessionId(ids);
  }

  void CheckSessionId(const std::map<std::string, size_t>& ids) {
    if (ids.empty() || ids.count(check_.session_id) > 0) return;
    const auto most = std::max_element(
        ids.begin(), ids.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
    if (check_.has_sound_session_file) {
      Add("session.json", "has the id " + check_.session_id + ", the ledger " + most->first,
          Remedy::kRepair);
    }
    check_.session_id = most->first;
    check_.has_sound_session_file = false;
  }

  void CheckBlobs() {
    const std::vector<fs::path> files = FilesUnder(paths_.Blobs());
    num_files_ = files.size() + 1;
    for (const fs::path& file : files) {
      Count();
      if (IsTemporaryName(file.filename().string())) continue;
      ++check_.num_blobs;
      const std::string name = file.filename().string();
      if (HashOfFile(file) != name) check_.damaged_blobs.insert(name);
    }
  }

  // A ledger that lacks facts is no state: each of its facts is needed then.
  std::set<std::string> Needed() const {
    std::set<std::string> needed;
    for (const Fact& fact : check_.facts) {
      if (std::holds_alternative<submap_model_t>(fact) || std::holds_alternative<merge_t>(fact))
        continue;
      for (const std::string& blob : BlobsOf(fact)) needed.insert(blob);
    }
    if (!check_.ledger.IsWhole()) return needed;
    SessionState state;
    for (const Fact& fact : check_.facts) state.Apply(fact);
    needed.merge(NeededBlobs(state));
    return needed;
  }

  void CheckNeeded() {
    const std::set<std::string> needed = Needed();
    std::set<std::string> photos;
    for (const Fact& fact : check_.facts) {
      if (const auto* image = std::get_if<image_t>(&fact)) photos.insert(image->blob_id);
    }
    for (const std::string& blob : needed) {
      if (photos.count(blob) > 0 || IsSound(blob)) continue;
      check_.lost_blobs.insert(blob);
      Add(NameOf(blob), store_.Has(blob) ? "is damaged" : "is missing", Remedy::kMakeAnew);
    }
    for (const std::string& blob : check_.damaged_blobs) {
      if (needed.count(blob) > 0) continue;
      Add(NameOf(blob), "is damaged, and not needed any more", Remedy::kRepair);
    }
  }

  bool IsSound(const std::string& blob) const {
    return store_.Has(blob) && check_.damaged_blobs.count(blob) == 0;
  }

  void CheckPhotos() {
    std::set<fs::path> known;
    for (const Fact& fact : check_.facts) {
      const auto* image = std::get_if<image_t>(&fact);
      if (image == nullptr) continue;
      ++check_.num_photos;
      known.insert(paths_.Image(image->agent, image->name));
      CheckPhoto(*image);
    }
    for (const fs::path& file : FilesUnder(paths_.Images())) {
      if (known.count(file) > 0 || IsTemporaryName(file.filename().string())) continue;
      Add(Relative(file), "is in no fact", Remedy::kNone);
    }
  }

  // It is there twice, as a link or a copy.
  void CheckPhoto(const image_t& image) {
    const fs::path file = paths_.Image(image.agent, image.name);
    const bool sound = HashOfFile(file) == image.blob_id;
    if (sound && IsSound(image.blob_id)) return;
    const bool lost = !sound && !IsSound(image.blob_id);
    Add(Relative(file),
        lost ? "is damaged or missing" : "one of its two copies is damaged or missing",
        lost ? Remedy::kSendAgain : Remedy::kRepair);
  }

  // Its last 64 bytes are the hash of what is before them.
  void CheckRetrieval() {
    for (const fs::path& file : FilesUnder(paths_.Retrieval())) {
      if (IsTemporaryName(file.filename().string())) continue;
      const Result<std::string> hash =
          RequireDescriptors(HashFileBelow(paths_.root, file, kHashSize));
      if (!hash.ok() || *hash != LastBytes(file, kHashSize))
        Add(Relative(file), "is damaged", Remedy::kNone);
    }
  }

  void CheckResults() {
    const Result<std::vector<std::string>> damaged =
        CheckChecksumList(paths_.root, paths_.Results().filename().string());
    if (damaged.ok()) {
      check_.damaged_results = *damaged;
    } else if (damaged.code() != StatusCode::kNotFound) {
      check_.damaged_results = {paths_.Results().filename().string()};
    } else if (fs::exists(paths_.Report())) {
      check_.damaged_results = {paths_.Results().filename().string()};
    }
    if (!check_.damaged_results.empty()) HashOfFile(paths_.Results());
    for (const std::string& file : check_.damaged_results) {
      Add(file, "is damaged or missing", Remedy::kMakeAnew);
    }
  }

  // Without a session's id no credential can be held against it, and the folder is told as it is.
  void CheckKeys() {
    check_.damaged_keys = CheckSessionKeys(paths_.Keys().string(), check_.session_id);
    for (const KeysDamage& damage : check_.damaged_keys) {
      Add("keys/" + damage.file, "is damaged",
          damage.is_made_anew ? Remedy::kNone : Remedy::kNewKeys);
    }
  }

  // Photos of browsers that ingest has not taken yet, by their hash.
  void CheckUploads() {
    for (const fs::path& file : FilesUnder(paths_.Uploads())) {
      if (file.extension() != ".photo" || HashOfFile(file) == file.stem()) continue;
      check_.damaged_uploads.push_back(Relative(file));
      Add(Relative(file), "is damaged", Remedy::kSendAgain);
    }
  }

  const SessionPaths& paths_;
  const Progress& progress_;
  const BlobStore store_;
  SessionCheck check_;
  size_t num_files_ = 0, num_read_ = 0;
  size_t num_more_ = 0;  // findings beyond kMaxFindings
  Remedy worst_ = Remedy::kNone;
};

}  // namespace

const char* TextOf(Finding::Remedy remedy) {
  switch (remedy) {
    case Remedy::kNone:
      return "nothing is lost, the services see to it";
    case Remedy::kRepair:
      return "`skein repair` makes it whole";
    case Remedy::kMakeAnew:
      return "`skein repair` takes it out, the services make it anew";
    case Remedy::kNewKeys:
      return "`skein repair` takes it out, the next start makes new ones: invite anew";
    case Remedy::kSendAgain:
      return "send the photo again";
  }
  return "";
}

SessionCheck CheckSession(const SessionPaths& paths, const Progress& progress) {
  return Checker(paths, progress).Run();
}

}  // namespace skein
