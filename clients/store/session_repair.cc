#include "clients/store/session_repair.h"

#include <algorithm>
#include <set>
#include <stdexcept>
#include <system_error>

#include "blobs/blob_store.h"
#include "clients/store/free_name.h"
#include "clients/store/session_writer.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"
#include "ledger/ledger_store.h"
#include "ledger/photo_file.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

constexpr const char* kLedgerSuffixes[] = {"", "-wal", "-shm"};

// A ledger that is being rewritten. What is there without ledger.db is complete.
fs::path NewLedger(const SessionPaths& paths) { return paths.Ledger().string() + ".new"; }

// Which facts of a ledger stay when others are lost.
class Keeper {
 public:
  explicit Keeper(const SessionCheck& check) : check_(check) {}

  bool Keeps(const Fact& fact) {
    for (const std::string& blob : BlobsOf(fact)) {
      if (check_.lost_blobs.count(blob) > 0) return false;
    }
    return std::visit([this](const auto& f) { return Keep(f); }, fact);
  }

 private:
  bool Keep(const image_t& f) { return images_.insert(f.image_id).second; }
  bool Keep(const features_t& f) {
    return images_.count(f.image_id) > 0 && described_.insert(f.image_id).second;
  }
  bool Keep(const candidates_t& f) {
    const bool known = AllDescribed(f.other_ids) && described_.count(f.image_id) > 0;
    return known && compared_.insert(f.image_id).second;
  }
  bool Keep(const matches_t& f) {
    std::vector<int64_t> others;
    for (const two_view_t& pair : f.pairs) others.push_back(pair.other_id);
    return compared_.count(f.image_id) > 0 && AllDescribed(others);
  }
  bool Keep(const failure_t& f) { return f.image_id == 0 || images_.count(f.image_id) > 0; }
  bool Keep(const configuration_t&) { return true; }
  template <class T>
  bool Keep(const T&) {
    return false;
  }
  bool AllDescribed(const std::vector<int64_t>& ids) const {
    return std::all_of(ids.begin(), ids.end(),
                       [this](int64_t id) { return described_.count(id) > 0; });
  }

  const SessionCheck& check_;
  std::set<int64_t> images_, described_, compared_;
};

class Repairer {
 public:
  Repairer(const SessionPaths& paths, SessionCheck check)
      : paths_(paths), check_(std::move(check)), blobs_(paths.Blobs()) {}

  Result<Repaired> Run() {
    for (const OddEntry& odd : check_.odd_entries) Remove(odd);
    if (check_.session_id.empty()) repaired_.done.push_back("the session gets a new id");
    const std::string id = check_.session_id.empty() ? RandomSessionId() : check_.session_id;
    RepairPhotos();
    for (const std::string& blob : check_.damaged_blobs) SetAside(blobs_.Path(blob));
    if (check_.MustRebuildLedger()) RebuildLedger(id);
    if (!check_.damaged_results.empty()) SetResultsAside();
    if (!check_.has_sound_session_file) WriteSession(id);
    for (const KeysDamage& damage : check_.damaged_keys) RepairKeys(damage);
    for (const std::string& upload : check_.damaged_uploads) {
      SetAside(paths_.root / upload);
      repaired_.photos_to_send.push_back(upload);
    }
    Require(SyncFileSystem(paths_.root));
    return repaired_;
  }

  // A repair that ended while it took out the old ledger, or before the new one was in its place.
  void FinishInterrupted() {
    for (const char* suffix : kLedgerSuffixes) EndMove(paths_.Ledger().string() + suffix);
    const fs::path fresh = NewLedger(paths_);
    if (!fs::exists(paths_.Ledger()) && fs::exists(fresh)) PutInPlace(fresh);
  }

 private:
  void SetAside(const fs::path& path) {
    if (!fs::exists(fs::symlink_status(path))) return;
    const fs::path name = path.lexically_relative(paths_.root);
    const fs::path aside = FreeName(paths_.root / "damaged" / name);
    Require(CreateFoldersBelow(paths_.root, aside.parent_path()));
    Require(RenameBelow(paths_.root, path, aside));
    repaired_.done.push_back(name.string() + " is in damaged/ now");
  }

  // A power loss may leave both names of a file that was moved to damaged/: it is not moved then.
  void EndMove(const fs::path& file) {
    for (const fs::path& aside : FilesUnder(paths_.root / "damaged")) {
      std::error_code missing;
      const bool is_second_name = !fs::is_symlink(file) && fs::equivalent(file, aside, missing);
      if (is_second_name) fs::remove(aside);
    }
  }

  // It has no content of its own; what a symbolic link leads to stays.
  void Remove(const OddEntry& odd) {
    const std::string name = odd.path.lexically_relative(paths_.root).string();
    std::error_code error;
    fs::remove(odd.path, error);
    if (error) {
      throw std::runtime_error(name + " is " + odd.kind + ", and cannot be removed: " +
                               error.message() + "; make it readable or remove it yourself");
    }
    repaired_.done.push_back(name + ", " + odd.kind + ", is removed");
  }

  void RepairPhotos() {
    for (const Fact& fact : check_.facts) {
      if (const auto* image = std::get_if<image_t>(&fact)) RepairPhoto(*image);
    }
  }

  // A file that is damaged as a blob, too, is a link to it: it is set aside with it.
  void RepairPhoto(const image_t& image) {
    const fs::path file = paths_.Image(image.agent, image.name);
    const Result<Bytes> blob = RequireDescriptors(blobs_.Get(image.blob_id));
    const Result<Bytes> copy =
        RequireDescriptors(ReadFileBelow(paths_.root, file, kMaxStoredFileBytes));
    const bool sound_copy = copy.ok() && HashBytes(copy->data(), copy->size()) == image.blob_id;
    if (blob.ok() && sound_copy) return;
    const std::string name = image.agent + "/" + image.name;
    if (!blob.ok() && !sound_copy) {
      SetAside(file);
      repaired_.photos_to_send.push_back(name);
      return;
    }
    if (!sound_copy) SetAside(file);
    Require(StorePhoto(paths_, image.agent, image.name, blob.ok() ? *blob : *copy));
    repaired_.done.push_back("photo " + name + " is restored from its second copy");
  }

  // The file itself goes first: without it the rest is done again by FinishInterrupted.
  void PutInPlace(const fs::path& fresh) {
    for (const char* suffix : kLedgerSuffixes) SetAside(paths_.Ledger().string() + suffix);
    Require(RenameBelow(paths_.root, fresh, paths_.Ledger()));
    RemoveLedger(fresh);
  }

  void RebuildLedger(const std::string& session_id) {
    const std::vector<Fact> facts = KeepFacts(check_);
    const fs::path fresh = NewLedger(paths_);
    RemoveLedger(fresh);
    Require(WriteLedger(fresh, session_id, facts, check_.ledger.notes));
    if (fs::exists(fresh.string() + "-wal")) {
      throw std::runtime_error("cannot write " + fresh.string() + ": is the disk full?");
    }
    Require(SyncFileSystem(paths_.root));
    PutInPlace(fresh);
    SetAside(paths_.Retrieval());  // it names positions in the ledger
    repaired_.done.push_back("the ledger is written anew, with " + std::to_string(facts.size()) +
                             " of the " + std::to_string(check_.facts.size()) +
                             " facts that can be read; maps are made anew");
    repaired_.services_must_run = true;
  }

  void SetResultsAside() {
    for (const fs::path& path : {paths_.Sparse(), paths_.Report(), paths_.Results()})
      SetAside(path);
    repaired_.services_must_run = true;
  }

  void RepairKeys(const KeysDamage& damage) {
    SetAside(damage.ends_all_keys ? paths_.Keys() : paths_.Keys() / damage.file);
    if (damage.is_made_anew) return;
    repaired_.done.push_back("invitations that hang on keys/" + damage.file +
                             " have ended: invite anew");
  }

  void WriteSession(const std::string& id) {
    Require(WriteSessionFile(paths_, id));
    repaired_.done.push_back("session.json is written anew");
  }

  const SessionPaths& paths_;
  const SessionCheck check_;
  BlobStore blobs_;
  Repaired repaired_;
};

// What cannot be read for another reason than damage is to be lost to nobody.
bool AreSame(const std::vector<Finding>& a, const std::vector<Finding>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const Finding& x, const Finding& y) {
    return x.what == y.what && x.problem == y.problem;
  });
}

}  // namespace

std::vector<Fact> KeepFacts(const SessionCheck& check) {
  Keeper keeper(check);
  std::vector<Fact> kept;
  for (const Fact& fact : check.facts) {
    if (keeper.Keeps(fact)) kept.push_back(fact);
  }
  return kept;
}

Result<Repaired> RepairSession(const SessionPaths& paths, const Progress& progress) {
  const Result<LedgerLock> lock = LedgerLock::Take(paths.Ledger());
  if (!lock.ok()) return lock.status();
  try {
    Repairer(paths, {}).FinishInterrupted();
    SessionCheck check = CheckSession(paths, progress);
    if (!check.IsWhole() && !AreSame(check.findings, CheckSession(paths, progress).findings)) {
      return Unavailable(
          "reading the folder twice gave two results: is the disk or the memory "
          "failing? Nothing was changed");
    }
    return Repairer(paths, std::move(check)).Run();
  } catch (const std::exception& error) {
    return Unavailable(error.what());
  }
}

}  // namespace skein
