#include "clients/store/session_clone.h"

#include <set>

#include "blobs/blob_store.h"
#include "clients/store/session_writer.h"
#include "core/checksum_list.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "ledger/ledger_record.h"
#include "ledger/photo_file.h"
#include "session/needed_blobs.h"
#include "session/session_state.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

// Kinds of the notes that ingest keeps beside the facts are its own: all are copied.
struct Contents {
  std::vector<Fact> facts;
  std::vector<LedgerNote> notes;
  std::set<std::string> blobs;  // that it needs, without photos
};

Result<Contents> ReadContents(const SessionPaths& paths) {
  const LedgerSurvey survey = Ledger::Survey(paths.Ledger());
  if (!survey.IsWhole()) return DataLoss(survey.damage.front()).Within("run `skein repair` first");
  Contents contents;
  contents.notes = survey.notes;
  SessionState state;
  for (const LedgerRecord& record : survey.records) {
    const Result<Fact> fact = DecodeRecord(record);
    if (!fact.ok()) return fact.status();
    state.Apply(*fact);
    contents.facts.push_back(*fact);
  }
  contents.blobs = NeededBlobs(state);
  for (const auto& [id, photo] : state.photos()) contents.blobs.erase(photo.image.blob_id);
  return contents;
}

class Cloner {
 public:
  Cloner(const SessionPaths& from, const SessionPaths& to, const Progress& progress)
      : from_(from), to_(to), progress_(progress), source_(from.Blobs()), target_(to.Blobs()) {}

  Session Run(const Contents& contents) {
    const Session session{RandomSessionId(), to_};
    Require(CreateFolders(to_.root));
    num_files_ = contents.blobs.size() + contents.facts.size();
    for (const std::string& blob : contents.blobs) Copy(blob);
    for (const Fact& fact : contents.facts) {
      Count();
      if (const auto* image = std::get_if<image_t>(&fact)) Copy(*image);
    }
    CopyResults();
    CopyFiles(from_.Uploads(), to_.Uploads());
    Require(WriteLedger(to_.Ledger(), session.session_id, contents.facts, contents.notes));
    Require(SyncFileSystem(to_.root));
    // Last: without it the folder is no session.
    Require(WriteSessionFile(to_, session.session_id));
    return session;
  }

 private:
  void Count() {
    if (progress_) progress_(static_cast<double>(++num_done_) / static_cast<double>(num_files_));
  }

  void Copy(const std::string& blob) {
    Count();
    const Result<Bytes> bytes = source_.Get(blob);
    Require(bytes.status());
    Require(target_.Put(*bytes).status());
  }

  void Copy(const image_t& image) {
    const Result<Bytes> bytes = source_.Get(image.blob_id);
    Require(bytes.status().Within("photo " + image.agent + "/" + image.name));
    Require(StorePhoto(to_, image.agent, image.name, *bytes));
  }

  void CopyFiles(const fs::path& from, const fs::path& to) {
    Require(CopyFilesBelow(from_.root, from, to_.root, to, kMaxStoredFileBytes));
  }

  // Where a finish writes them just now, they are left out.
  void CopyResults() {
    if (!IsFileBelow(from_.root, from_.Results())) return;
    CopyFiles(from_.Sparse(), to_.Sparse());
    CopyFiles(from_.Report(), to_.Report());
    CopyFiles(from_.Results(), to_.Results());
    const auto damaged = CheckChecksumList(to_.root, to_.Results().filename().string());
    if (damaged.ok() && damaged->empty()) return;
    for (const fs::path& path : {to_.Sparse(), to_.Report(), to_.Results()}) fs::remove_all(path);
  }

  const SessionPaths& from_;
  const SessionPaths& to_;
  const Progress& progress_;
  const BlobStore source_;
  BlobStore target_;
  size_t num_files_ = 0, num_done_ = 0;
};

}  // namespace

Result<Session> CloneSession(const SessionPaths& from, const fs::path& to,
                             const Progress& progress) {
  if (fs::exists(to)) return AlreadyExists(to.string() + " exists; name a folder that does not");
  const Result<Session> session = OpenSession(from.root);
  if (!session.ok()) return session.status();
  const Result<Contents> contents = ReadContents(from);
  if (!contents.ok()) return contents.status();
  try {
    return Cloner(from, SessionPaths{to}, progress).Run(*contents);
  } catch (const std::exception& error) {
    return Unavailable(error.what()).Within("cloning to " + to.string() + " stopped, remove it");
  }
}

}  // namespace skein
