#include "ledger/ledger_store.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <unistd.h>

#include <limits>
#include <stdexcept>

namespace skein {
namespace {

constexpr int64_t kApplicationId = 0x534b4c47;  // "SKLG"
constexpr int64_t kSchemaVersion = 1;
constexpr char kSchema[] = R"(
  BEGIN IMMEDIATE;
  CREATE TABLE facts(seq INTEGER PRIMARY KEY, fact_id TEXT NOT NULL UNIQUE, kind TEXT NOT NULL,
                     utime_us INTEGER NOT NULL, payload BLOB NOT NULL);
  CREATE TABLE notes(kind TEXT NOT NULL, key TEXT NOT NULL, value TEXT NOT NULL,
                     PRIMARY KEY(kind, key)) WITHOUT ROWID;
  PRAGMA application_id = 1397443655;
  PRAGMA user_version = 1;
  COMMIT;
)";

// A prepared statement; throws std::runtime_error if the SQL doesn't fit the schema.
class Statement {
 public:
  Statement(sqlite3* db, const std::string& sql) : db_(db) {
    if (sqlite3_prepare_v2(db, sql.c_str(), -1, &statement_, nullptr) != SQLITE_OK) {
      throw std::runtime_error(std::string("ledger: ") + sqlite3_errmsg(db));
    }
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void Bind(int at, int64_t value) { sqlite3_bind_int64(statement_, at, value); }
  void Bind(int at, const std::string& text) {
    sqlite3_bind_text(statement_, at, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
  }
  void Bind(int at, const Bytes& bytes) {
    static const uint8_t kEmpty = 0;
    sqlite3_bind_blob64(statement_, at, bytes.empty() ? &kEmpty : bytes.data(), bytes.size(),
                        SQLITE_TRANSIENT);
  }
  int Step() { return sqlite3_step(statement_); }
  void Reset() { sqlite3_reset(statement_); }

  int64_t Integer(int column) const { return sqlite3_column_int64(statement_, column); }
  std::string Text(int column) const {
    const auto* data = static_cast<const char*>(sqlite3_column_blob(statement_, column));
    return data == nullptr ? "" : std::string(data, Size(column));
  }
  Bytes Blob(int column) const {
    const auto* data = static_cast<const uint8_t*>(sqlite3_column_blob(statement_, column));
    return data == nullptr ? Bytes() : Bytes(data, data + Size(column));
  }

 private:
  size_t Size(int column) const {
    return static_cast<size_t>(sqlite3_column_bytes(statement_, column));
  }

  sqlite3* db_;
  sqlite3_stmt* statement_ = nullptr;
};

}  // namespace

Result<std::unique_ptr<Ledger>> Ledger::Open(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger);
  if (Status status = ledger->Lock(path); !status.ok()) return status;
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

Ledger::~Ledger() {
  sqlite3_close(db_);
  if (lock_fd_ >= 0) close(lock_fd_);
}

// flock, not SQLite's exclusive mode: readers must be able to follow while ingest writes.
Status Ledger::Lock(const std::filesystem::path& path) {
  const std::string lock_path = path.string() + ".lock";
  lock_fd_ = open(lock_path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  if (lock_fd_ < 0) return Unavailable("cannot open " + lock_path + " for writing");
  if (flock(lock_fd_, LOCK_EX | LOCK_NB) == 0) return Status::Ok();
  return Unavailable(path.string() +
                     " is in use: another skein-ingest runs on this session; stop it first");
}

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
  Statement fact(db_, "INSERT INTO facts VALUES(?, ?, ?, ?, ?)");
  for (const LedgerRecord& record : records) {
    fact.Bind(1, record.seq);
    fact.Bind(2, record.fact_id);
    fact.Bind(3, record.kind);
    fact.Bind(4, record.utime_us);
    fact.Bind(5, record.payload);
    if (fact.Step() != SQLITE_DONE) return failed();
    fact.Reset();
  }
  Statement note(db_, "INSERT OR REPLACE INTO notes VALUES(?, ?, ?)");
  for (const LedgerNote& row : notes) {
    note.Bind(1, row.kind);
    note.Bind(2, row.key);
    note.Bind(3, row.value);
    if (note.Step() != SQLITE_DONE) return failed();
    note.Reset();
  }
  return Status::Ok();
}

Status Ledger::Select(const std::string& sql, int64_t from_seq, int64_t to_seq,
                      const std::function<void(LedgerRecord)>& visit) const {
  Statement statement(db_, sql);
  statement.Bind(1, from_seq);
  statement.Bind(2, to_seq);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    visit({statement.Integer(0), statement.Text(1), statement.Text(2), statement.Integer(3),
           statement.Blob(4)});
  }
  if (code == SQLITE_DONE) return Status::Ok();
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_));
}

Result<std::vector<LedgerRecord>> Ledger::Range(int64_t from_seq, int64_t to_seq) const {
  std::vector<LedgerRecord> records;
  const Status status =
      Select("SELECT * FROM facts WHERE seq BETWEEN ? AND ? ORDER BY seq", from_seq, to_seq,
             [&](LedgerRecord record) { records.push_back(std::move(record)); });
  if (!status.ok()) return status;
  return records;
}

Status Ledger::ForEach(const std::function<void(const LedgerRecord&)>& visit) const {
  return Select("SELECT * FROM facts WHERE seq BETWEEN ? AND ? ORDER BY seq", 0,
                std::numeric_limits<int64_t>::max(), visit);
}

Result<std::map<std::string, std::string>> Ledger::Notes(const std::string& kind) const {
  std::map<std::string, std::string> notes;
  Statement statement(db_, "SELECT key, value FROM notes WHERE kind = ?");
  statement.Bind(1, kind);
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) notes[statement.Text(0)] = statement.Text(1);
  if (code == SQLITE_DONE) return notes;
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_));
}

}  // namespace skein
