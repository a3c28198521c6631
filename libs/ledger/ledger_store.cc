#include "ledger/ledger_store.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <unistd.h>

#include <limits>
#include <new>
#include <stdexcept>

#include "core/hash.h"
#include "ledger/sqlite_statement.h"

namespace skein {
namespace {

constexpr int64_t kApplicationId = 0x534b4c47;  // "SKLG"
constexpr int64_t kSchemaVersion = 3;
constexpr char kSchema[] = R"(
  BEGIN IMMEDIATE;
  CREATE TABLE facts(seq INTEGER PRIMARY KEY, fact_id TEXT NOT NULL UNIQUE, kind TEXT NOT NULL,
                     utime_us INTEGER NOT NULL, payload BLOB NOT NULL, checksum TEXT NOT NULL);
  CREATE TABLE notes(kind TEXT NOT NULL, key TEXT NOT NULL, value TEXT NOT NULL,
                     checksum TEXT NOT NULL, PRIMARY KEY(kind, key)) WITHOUT ROWID;
  PRAGMA application_id = 1397443655;
  PRAGMA user_version = 3;
  COMMIT;
)";
// Lookups in a row that find nothing, after which a ledger whose last record cannot be read ends,
// and the others go on at the next record that is there: the last one's number may be damaged.
constexpr int kMaxMissing = 10'000;

std::string ChecksumOf(const LedgerRecord& record) {
  ByteWriter writer;
  writer.Put(record.seq);
  writer.PutString(record.fact_id);
  writer.PutString(record.kind);
  writer.Put(record.utime_us);
  writer.PutBytes(record.payload);
  return HashBytes(writer.bytes().data(), writer.size());
}

std::string ChecksumOf(const LedgerNote& note) {
  ByteWriter writer;
  writer.PutString(note.kind);
  writer.PutString(note.key);
  writer.PutString(note.value);
  return HashBytes(writer.bytes().data(), writer.size());
}

// Of "SELECT * FROM facts".
Result<LedgerRecord> RecordOf(const Statement& row) {
  LedgerRecord record{row.Integer(0), row.Text(1), row.Text(2), row.Integer(3), row.Blob(4)};
  if (row.Text(5) == ChecksumOf(record)) return record;
  return DataLoss("ledger: fact " + std::to_string(record.seq) +
                  " is damaged on disk; `skein repair SESSION` rebuilds what can be");
}

// Of "SELECT * FROM notes".
Result<LedgerNote> NoteOf(const Statement& row) {
  LedgerNote note{row.Text(0), row.Text(1), row.Text(2)};
  if (row.Text(3) == ChecksumOf(note)) return note;
  return DataLoss("ledger: a note of kind '" + note.kind +
                  "' is damaged on disk; `skein repair SESSION` rebuilds what can be");
}

}  // namespace

Result<LedgerLock> LedgerLock::Take(const std::filesystem::path& ledger) {
  const std::string path = ledger.string() + ".lock";
  LedgerLock lock(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (lock.fd_ < 0) return Unavailable("cannot open " + path + " for writing");
  if (flock(lock.fd_, LOCK_EX | LOCK_NB) == 0) return lock;
  return Unavailable(ledger.string() +
                     " is in use: another skein-ingest runs on this session; stop it first");
}

LedgerLock& LedgerLock::operator=(LedgerLock&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

LedgerLock::~LedgerLock() {
  if (fd_ >= 0) close(fd_);
}

Result<std::unique_ptr<Ledger>> Ledger::Open(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger);
  Result<LedgerLock> lock = LedgerLock::Take(path);
  if (!lock.ok()) return lock.status();
  std::error_code error;
  if (!std::filesystem::exists(path, error) &&
      std::filesystem::exists(path.string() + ".new", error)) {
    return FailedPrecondition(path.string() +
                              ": a repair was interrupted; run `skein repair` again");
  }
  ledger->lock_ = *std::move(lock);
  Status status = ledger->Connect(path, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (status.ok()) status = ledger->CheckSchema(path.string(), true);
  if (status.ok()) status = ledger->Execute("PRAGMA journal_mode = WAL");
  if (status.ok()) status = ledger->Execute("PRAGMA synchronous = FULL");
  if (!status.ok()) return status;
  const auto head = ledger->QueryInteger("SELECT COALESCE(MAX(seq), 0) FROM facts");
  if (!head.ok()) return head.status();
  ledger->head_seq_ = *head;
  return ledger;
}

Result<std::unique_ptr<Ledger>> Ledger::OpenReadOnly(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger);
  Status status = ledger->Connect(path, SQLITE_OPEN_READONLY);
  if (status.ok()) status = ledger->CheckSchema(path.string(), false);
  if (!status.ok()) return status;
  const auto head = ledger->QueryInteger("SELECT COALESCE(MAX(seq), 0) FROM facts");
  if (!head.ok()) return head.status();
  ledger->head_seq_ = *head;
  return ledger;
}

Ledger::~Ledger() { sqlite3_close(db_); }

Status Ledger::Connect(const std::filesystem::path& path, int flags) {
  if (sqlite3_open_v2(path.c_str(), &db_, flags, nullptr) != SQLITE_OK) {
    return Unavailable("cannot open " + path.string() + ": " + sqlite3_errmsg(db_));
  }
  sqlite3_busy_timeout(db_, 5000);
  return Status::Ok();
}

Status Ledger::CheckSchema(const std::string& path, bool create) {
  const auto tables = QueryInteger("SELECT COUNT(*) FROM sqlite_master");
  if (!tables.ok()) return tables.status().Within(path + " is no ledger");
  if (*tables == 0 && create) return Execute(kSchema);
  const auto application = QueryInteger("PRAGMA application_id");
  const auto version = QueryInteger("PRAGMA user_version");
  if (!application.ok() || *application != kApplicationId) {
    return DataLoss(path + " is no Skein ledger");
  }
  if (!version.ok() || *version != kSchemaVersion) {
    return DataLoss(path + " has another schema version; use the Skein that wrote it");
  }
  return Status::Ok();
}

Status Ledger::Execute(const std::string& sql) {
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return Status::Ok();
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_));
}

Result<int64_t> Ledger::QueryInteger(const std::string& sql) const {
  try {
    Statement statement(db_, sql);
    if (statement.Step() == SQLITE_ROW) return statement.Integer(0);
  } catch (const std::runtime_error& error) {
    return Unavailable(error.what());
  }
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_));
}

Status Ledger::Append(const std::vector<LedgerRecord>& records,
                      const std::vector<LedgerNote>& notes) {
  for (size_t i = 0; i < records.size(); ++i) {
    if (records[i].seq != head_seq_ + 1 + static_cast<int64_t>(i)) {
      throw std::logic_error("ledger: record " + std::to_string(records[i].seq) + " out of order");
    }
  }
  Status status = Execute("BEGIN IMMEDIATE");
  if (status.ok()) status = Insert(records, notes);
  if (status.ok()) status = Execute("COMMIT");
  if (!status.ok()) {
    if (sqlite3_get_autocommit(db_) == 0) Execute("ROLLBACK");
    return status;
  }
  head_seq_ += static_cast<int64_t>(records.size());
  return Status::Ok();
}

Status Ledger::Insert(const std::vector<LedgerRecord>& records,
                      const std::vector<LedgerNote>& notes) {
  const auto failed = [this] { return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_)); };
  Statement fact(db_, "INSERT INTO facts VALUES(?, ?, ?, ?, ?, ?)");
  for (const LedgerRecord& record : records) {
    fact.Bind(1, record.seq);
    fact.Bind(2, record.fact_id);
    fact.Bind(3, record.kind);
    fact.Bind(4, record.utime_us);
    fact.Bind(5, record.payload);
    fact.Bind(6, ChecksumOf(record));
    if (fact.Step() != SQLITE_DONE) return failed();
    fact.Reset();
  }
  Statement note(db_, "INSERT OR REPLACE INTO notes VALUES(?, ?, ?, ?)");
  for (const LedgerNote& row : notes) {
    note.Bind(1, row.kind);
    note.Bind(2, row.key);
    note.Bind(3, row.value);
    note.Bind(4, ChecksumOf(row));
    if (note.Step() != SQLITE_DONE) return failed();
    note.Reset();
  }
  return Status::Ok();
}

Status Ledger::Select(int64_t from_seq, int64_t to_seq,
                      const std::function<void(LedgerRecord)>& visit) const {
  Statement statement(db_, "SELECT * FROM facts WHERE seq BETWEEN ? AND ? ORDER BY seq");
  statement.Bind(1, from_seq);
  statement.Bind(2, to_seq);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    Result<LedgerRecord> record = RecordOf(statement);
    if (!record.ok()) return record.status();
    visit(*std::move(record));
  }
  return code == SQLITE_DONE ? Status::Ok() : ReadError();
}

Result<std::vector<LedgerRecord>> Ledger::Range(int64_t from_seq, int64_t to_seq) const {
  std::vector<LedgerRecord> records;
  const Status status =
      Select(from_seq, to_seq, [&](LedgerRecord record) { records.push_back(std::move(record)); });
  if (!status.ok()) return status;
  return records;
}

Status Ledger::ForEach(const std::function<void(const LedgerRecord&)>& visit) const {
  return Select(0, std::numeric_limits<int64_t>::max(), visit);
}

Result<std::map<std::string, std::string>> Ledger::Notes(const std::string& kind) const {
  std::map<std::string, std::string> notes;
  Statement statement(db_, "SELECT * FROM notes WHERE kind = ?");
  statement.Bind(1, kind);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    const Result<LedgerNote> note = NoteOf(statement);
    if (!note.ok()) return note.status();
    notes[note->key] = note->value;
  }
  if (code == SQLITE_DONE) return notes;
  return ReadError();
}

Status Ledger::ReadError() const {
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_) +
                     "; `skein check SESSION` says what can be done");
}

LedgerSurvey Ledger::Survey(const std::filesystem::path& path) {
  LedgerSurvey survey;
  Result<std::unique_ptr<Ledger>> ledger = OpenReadOnly(path);
  // The head is the first thing to fail where the last page is damaged.
  if (!ledger.ok()) {
    survey.damage.push_back(ledger.error());
    ledger = OpenDamaged(path);
    if (!ledger.ok()) return survey;
  }
  try {
    (*ledger)->SurveyFacts(&survey);
    (*ledger)->SurveyNotes(&survey);
    (*ledger)->SurveyPages(&survey);
  } catch (const std::runtime_error& error) {
    survey.damage.push_back(error.what());
  }
  (*ledger)->RequireMemory();
  return survey;
}

Result<std::unique_ptr<Ledger>> Ledger::OpenDamaged(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger);
  const Status status = ledger->Connect(path, SQLITE_OPEN_READONLY);
  if (!status.ok()) return status;
  return ledger;
}

void Ledger::RequireMemory() const {
  if ((sqlite3_errcode(db_) & 0xff) == SQLITE_NOMEM) throw std::bad_alloc();
}

// 0 if there is none, or if it cannot be read.
int64_t Ledger::NextSeq(int64_t after_seq) const {
  Statement statement(db_, "SELECT COALESCE(MIN(seq), 0) FROM facts WHERE seq > ?");
  statement.Bind(1, after_seq);
  return statement.Step() == SQLITE_ROW ? statement.Integer(0) : 0;
}

// One lookup a record, so that a damaged page costs the records on it alone.
void Ledger::SurveyFacts(LedgerSurvey* survey) const {
  Statement statement(db_, "SELECT * FROM facts WHERE seq = ?");
  std::vector<std::string> damage;
  size_t num_before_gap = 0;
  int num_missing = 0;
  for (int64_t seq = 1; head_seq_ > 0 ? seq <= head_seq_ : num_missing < kMaxMissing; ++seq) {
    statement.Bind(1, seq);
    const int code = statement.Step();
    RequireMemory();
    if (code == SQLITE_ROW) {
      Result<LedgerRecord> record = RecordOf(statement);
      record.ok() ? survey->records.push_back(*std::move(record))
                  : damage.push_back(record.error());
      RequireMemory();
      num_before_gap = damage.size();
      num_missing = 0;
    } else {
      const std::string reason = code == SQLITE_DONE ? "is missing" : sqlite3_errmsg(db_);
      damage.push_back("ledger: fact " + std::to_string(seq) + ": " + reason);
      ++num_missing;
    }
    statement.Reset();
    if (head_seq_ > 0 && num_missing == kMaxMissing) {
      seq = NextSeq(seq) - 1;
      num_missing = 0;
      if (seq < 0) break;
    }
  }
  if (head_seq_ == 0) damage.resize(num_before_gap);
  survey->damage.insert(survey->damage.end(), damage.begin(), damage.end());
}

void Ledger::SurveyNotes(LedgerSurvey* survey) const {
  Statement statement(db_, "SELECT * FROM notes");
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    Result<LedgerNote> note = NoteOf(statement);
    note.ok() ? survey->notes.push_back(*std::move(note)) : survey->damage.push_back(note.error());
  }
  if (code != SQLITE_DONE) survey->damage.push_back(ReadError().error());
}

void Ledger::SurveyPages(LedgerSurvey* survey) const {
  Statement statement(db_, "PRAGMA integrity_check(10)");
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    if (statement.Text(0) != "ok") survey->damage.push_back("ledger: " + statement.Text(0));
  }
  if (code != SQLITE_DONE) survey->damage.push_back(ReadError().error());
}

}  // namespace skein
