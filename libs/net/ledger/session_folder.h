#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "core/result.h"

namespace skein {

// The paths of a session folder.
struct SessionPaths {
  std::filesystem::path root;

  std::filesystem::path SessionFile() const { return root / "session.json"; }
  std::filesystem::path Ledger() const { return root / "ledger.db"; }
  std::filesystem::path Images() const { return root / "images"; }
  std::filesystem::path Image(const std::string& agent, const std::string& name) const {
    return root / "images" / agent / name;
  }
  std::filesystem::path Blobs() const { return root / "blobs"; }
  std::filesystem::path Retrieval() const { return root / "retrieval"; }
  std::filesystem::path Submap(int64_t submap_id) const {
    return root / "submaps" / std::to_string(submap_id);
  }
  std::filesystem::path Sparse() const { return root / "sparse"; }
  std::filesystem::path Uploads() const { return root / "uploads"; }
  std::filesystem::path Keys() const { return root / "keys"; }
  // Notes of launch.sh (clients/launched.h).
  std::filesystem::path LaunchedUrl() const { return root / "run" / "lcm_url"; }
  std::filesystem::path BrowserAddresses() const { return root / "run" / "web_public"; }
  std::filesystem::path Report() const { return root / "report.json"; }
  // Checksums of sparse/ and report.json.
  std::filesystem::path Results() const { return root / "results.sha256"; }
};

struct Session {
  std::string session_id;  // 16 lower-case hex digits, random
  SessionPaths paths;
};

// Opens DIR, creating it and DIR/session.json when absent. If several processes create it at once,
// all get the same id. A damaged or newer session.json is an error that says what to do.
Result<Session> OpenOrCreateSession(const std::filesystem::path& dir);

// As above, but the folder must hold a session.
Result<Session> OpenSession(const std::filesystem::path& dir);

// For the one process that writes the session. Notes in session.json where the folder lies. Fails
// if it is a copy: the folder from which it was copied is still there, with the same id. Two
// sessions of one id would take each other's messages for their own. A folder that was moved goes
// on.
Status ClaimSession(const Session& session);

// Rewrites DIR/session.json, for a session of that id.
Status WriteSessionFile(const SessionPaths& paths, const std::string& session_id);

std::string RandomSessionId();

}  // namespace skein
