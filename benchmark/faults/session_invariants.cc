// What must hold of a session whatever died or hung on the way. Prints a line for each breach;
// exits with 1 if there is one.
//
//   session_invariants SESSION FOLDER...     FOLDER: the photos that an agent has sent
//
//  - each photo of the folders is in the ledger, once;
//  - each photo is registered, deferred, or failed with a reason;
//  - facts of a submap are of the epoch and the owner of its lease at that place of the ledger;
//  - ledger, photos, blobs and results are whole (as `skein check` says);
//  - each final model opens.
#include <cstdio>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "clients/store/session_check.h"
#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "geometry/model_poses.h"
#include "session/diagnosis.h"
#include "session/session_history.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

class Invariants {
 public:
  explicit Invariants(const SessionPaths& paths) : paths_(paths), check_(CheckSession(paths)) {}

  int Check(const std::vector<fs::path>& folders) {
    for (const Finding& finding : check_.findings) {
      if (finding.remedy != Finding::Remedy::kNone) Breach(finding.what + ": " + finding.problem);
    }
    for (const Fact& fact : check_.facts) CheckWriter(fact);
    for (const fs::path& folder : folders) CheckSent(folder);
    CheckPhotos();
    CheckModels();
    std::printf("%zu facts, %zu photos, %d breaches\n", check_.facts.size(), check_.num_photos,
                num_breaches_);
    return num_breaches_;
  }

 private:
  void Breach(const std::string& what) {
    std::printf("breach: %s\n", what.c_str());
    ++num_breaches_;
  }

  void CheckWriter(const Fact& fact) {
    if (const auto* lease = std::get_if<submap_lease_t>(&fact)) leases_[lease->submap_id] = *lease;
    if (const auto* f = std::get_if<registration_t>(&fact)) CheckLease(*f, f->submap_id, f->epoch);
    if (const auto* f = std::get_if<submap_model_t>(&fact)) CheckLease(*f, f->submap_id, f->epoch);
  }
  template <class T>
  void CheckLease(const T& fact, int64_t submap_id, int64_t epoch) {
    const submap_lease_t& lease = leases_[submap_id];
    if (lease.epoch == epoch && lease.owner == fact.header.author) return;
    Breach(fact.header.fact_id + " is of " + fact.header.author + " in epoch " +
           std::to_string(epoch) + ", the lease of " + lease.owner + " in " +
           std::to_string(lease.epoch));
  }

  void CheckSent(const fs::path& folder) {
    std::map<std::string, int> times;
    for (const Fact& fact : check_.facts) {
      if (const auto* image = std::get_if<image_t>(&fact)) ++times[image->blob_id];
    }
    for (const fs::path& file : FilesUnder(folder)) {
      const Result<Bytes> bytes = ReadFile(file.string());
      const int found = bytes.ok() ? times[HashBytes(bytes->data(), bytes->size())] : 0;
      if (found != 1) {
        Breach(file.string() + " is in the ledger " + std::to_string(found) + " times");
      }
    }
  }

  void CheckPhotos() {
    SessionRecord session;
    if (check_.ledger.IsWhole()) {
      for (const Fact& fact : check_.facts) session.Apply(fact);
    }
    for (const auto& [id, photo] : session.state.photos()) {
      if (session.state.IsRegistered(id) || photo.failed()) continue;
      if (Diagnose(session.state, photo).what.empty()) {
        Breach("photo " + session.state.NameOf(id) + " has no reason");
      }
    }
  }

  void CheckModels() {
    std::error_code error;
    for (const fs::directory_entry& model : fs::directory_iterator(paths_.Sparse(), error)) {
      const Result<ModelPoses> poses = ReadColmapPoses(model.path());
      if (!poses.ok()) Breach(model.path().string() + ": " + poses.error());
    }
  }

  const SessionPaths paths_;
  const SessionCheck check_;
  std::map<int64_t, submap_lease_t> leases_;
  int num_breaches_ = 0;
};

}  // namespace
}  // namespace skein

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: session_invariants SESSION FOLDER...\n");
    return 2;
  }
  skein::Invariants invariants(skein::SessionPaths{argv[1]});
  return invariants.Check({argv + 2, argv + argc}) == 0 ? 0 : 1;
}
