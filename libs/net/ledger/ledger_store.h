#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/bytes.h"
#include "core/file_below.h"
#include "core/result.h"

struct sqlite3;

namespace skein {

// A committed fact, as stored. The payload is the encoded message, which the store doesn't read.
struct LedgerRecord {
  int64_t seq = 0;  // from 1, without gaps
  std::string fact_id;
  std::string kind;  // image, features, ...
  int64_t utime_us = 0;
  Bytes payload;
};

// A value that ingest remembers beside the facts, e.g. the camera of a photo's make and size.
struct LedgerNote {
  std::string kind;
  std::string key;
  std::string value;
};

// Keeps every other writer from a ledger while it lives: flock on PATH.lock. SQLite's exclusive
// mode would keep readers out, too.
class LedgerLock {
 public:
  // The error says who holds it, for the user.
  static Result<LedgerLock> Take(const std::filesystem::path& ledger);

 private:
  explicit LedgerLock(FileDescriptor file) : file_(std::move(file)) {}
  FileDescriptor file_;
};

// Readable part of a damaged ledger.
struct LedgerSurvey {
  std::vector<LedgerRecord> records;  // in order; without those that are damaged or missing
  std::vector<LedgerNote> notes;
  // A line each, for a person; empty: all is whole. Beyond kMaxDamage lines the last one counts.
  std::vector<std::string> damage;
  static constexpr size_t kMaxDamage = 1000;

  bool IsWhole() const { return damage.empty(); }
};

// The session's facts in order: an SQLite file in WAL mode with synchronous=FULL. Appended records
// survive a crash and a power loss. Each record has a SHA-256, which is checked whenever it is
// read. One process writes (a lock file ensures it), any number may read. One thread uses an
// object.
//
// The file is input, as the rest of a session folder. Before any other statement its schema is
// compared with the ledger's own. Triggers and views are off. Rows, the steps of a statement and
// what is told of damage are bounded. No symbolic link is followed (core/file_below.h).
class Ledger {
 public:
  // For the writer. Fails when another process has it open for writing, when it is no ledger, or
  // when its schema is newer. The error is one line for the user.
  static Result<std::unique_ptr<Ledger>> Open(const std::filesystem::path& path);
  // For readers; the file must exist. A row has at most kMaxRowBytes.
  static Result<std::unique_ptr<Ledger>> OpenReadOnly(const std::filesystem::path& path);
  // Reads a ledger that may be damaged, record by record. A file that cannot be opened gives an
  // empty survey, which names the damage.
  static LedgerSurvey Survey(const std::filesystem::path& path);
  ~Ledger();
  Ledger(const Ledger&) = delete;
  Ledger& operator=(const Ledger&) = delete;

  // Commits all or nothing, with one sync. The records must go on at head() + 1.
  // After an error (disk full, I/O) the ledger on disk is as before.
  Status Append(const std::vector<LedgerRecord>& records,
                const std::vector<LedgerNote>& notes = {});

  // Records from_seq..to_seq that exist, in order. These three fail at a damaged record.
  Result<std::vector<LedgerRecord>> Range(int64_t from_seq, int64_t to_seq) const;
  // Every record in order. Throws what `visit` throws.
  Status ForEach(const std::function<void(const LedgerRecord&)>& visit) const;
  // Key -> value of the notes of a kind.
  Result<std::map<std::string, std::string>> Notes(const std::string& kind) const;

  int64_t head() const { return head_seq_; }  // seq of the last record, 0 if none

  static constexpr int kMaxRowBytes = 4 << 20;  // a message has at most 32 KiB

 private:
  explicit Ledger(std::filesystem::path path) : path_(std::move(path)) {}
  Status Connect(int flags);
  Status CheckSchema(bool create);
  // Gives the statements that follow as many steps, and rows as many bytes, as a sound ledger of
  // this size may need.
  void AllowSteps() const;
  // False: rows have more bytes than the file, as they share pages.
  bool FitsFile(size_t row_bytes) const;
  Status Execute(const std::string& sql);
  Result<int64_t> QueryInteger(const std::string& sql) const;
  Status Insert(const std::vector<LedgerRecord>& records, const std::vector<LedgerNote>& notes);
  Status Select(int64_t from_seq, int64_t to_seq,
                const std::function<void(LedgerRecord)>& visit) const;
  Status ReadError() const;
  static Result<std::unique_ptr<Ledger>> OpenDamaged(const std::filesystem::path& path);
  void SurveyFacts(LedgerSurvey* survey) const;
  int64_t NextSeq(int64_t after_seq) const;
  // Throws std::bad_alloc if SQLite had none: what it did not read is not damaged.
  void RequireMemory() const;
  void SurveyNotes(LedgerSurvey* survey) const;
  void SurveyPages(LedgerSurvey* survey) const;

  const std::filesystem::path path_;
  sqlite3* db_ = nullptr;
  mutable int64_t steps_left_ = 0;  // of SQLite's virtual machine
  mutable int64_t row_bytes_left_ = 0;
  std::optional<LedgerLock> lock_;  // of the writer
  int64_t head_seq_ = 0;
};

}  // namespace skein
