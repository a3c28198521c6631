// Finds the damage of a session folder. Reads everything once: the ledger's records, photos and
// blobs by their hash, results by their list of checksums, and keys.
#pragma once

#include <functional>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "auth/session_keys.h"
#include "core/file_below.h"
#include "core/result.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"
#include "ledger/session_folder.h"

namespace skein {

// A line for a person, with what becomes of it.
struct Finding {
  enum class Remedy {
    kNone,       // nothing is lost: it is made again by itself, or was not needed
    kRepair,     // `skein repair` makes it whole
    kMakeAnew,   // `skein repair` takes it out, and the services make it again
    kNewKeys,    // `skein repair` takes it out, and invitations that hang on it end
    kSendAgain,  // a photo that is nowhere else: its agent must send it again
  };
  std::string what;
  std::string problem;
  Remedy remedy = Remedy::kNone;
};

const char* TextOf(Finding::Remedy remedy);

struct SessionCheck {
  // At most kMaxFindings, and one that tells how many more there are.
  std::vector<Finding> findings;
  static constexpr size_t kMaxFindings = 1000;

  std::string session_id;  // session.json's, or else the ledger's; "" if neither tells
  bool has_sound_session_file = false;
  LedgerSurvey ledger;
  std::vector<Fact> facts;                   // of the sound records, in order
  std::set<std::string> damaged_blobs;       // files in blobs/ that are not what their name says
  std::set<std::string> lost_blobs;          // damaged or missing, needed, no photo
  std::vector<std::string> damaged_results;  // and the list itself

  std::vector<OddEntry> odd_entries;  // no regular files: opened by nobody
  std::vector<KeysDamage> damaged_keys;
  std::vector<std::string> damaged_uploads;  // paths in the folder

  size_t num_blobs = 0;
  size_t num_photos = 0;

  bool IsWhole() const { return findings.empty(); }
  // Facts must go, so that the services derive again what they tell.
  bool MustRebuildLedger() const { return !ledger.IsWhole() || !lost_blobs.empty(); }
};

// Throws std::runtime_error if a file could not be read because this process has no descriptors
// left: that says nothing of the file.
template <class T>
Result<T> RequireDescriptors(Result<T> read) {
  if (read.code() == StatusCode::kResourceExhausted) throw std::runtime_error(read.error());
  return read;
}

using Progress = std::function<void(double part)>;

// Whatever is wrong is a finding. The folder may be in use. Throws std::runtime_error where this
// process cannot look: it has no descriptors left.
SessionCheck CheckSession(const SessionPaths& paths, const Progress& progress = {});

}  // namespace skein
