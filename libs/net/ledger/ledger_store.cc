#include "ledger/ledger_store.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>

#include <algorithm>
#include <cctype>
#include <cstring>
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
// Lookups in a row that fail, after which a ledger whose last record cannot be read ends, and the
// others go on at the next record that is there: the last one's number may be damaged.
constexpr int kMaxMissing = 10'000;
constexpr int kMaxAllMissing = 100'000;

// Steps of SQLite's virtual machine for a statement: a row takes some 50, and 100 bytes or more.
constexpr int64_t kStepsOfAny = 10'000'000;
constexpr int64_t kStepsPerByte = 10;
constexpr int kStepsPerCall = 10'000;
constexpr size_t kChecksumBytes = 64;
// Another process may append so many bytes while rows are read.
constexpr int64_t kMoreRowBytes = 64 << 20;

// At the end of a rollback journal that names another file, which SQLite reads and removes.
constexpr char kSuperJournalMagic[] = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
constexpr size_t kMagicBytes = 8;
constexpr size_t kMaxJournalBytes = size_t{4} << 30;

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

// An entry of sqlite_master. White space in its SQL counts as one blank.
struct SchemaEntry {
  std::string type, name, table, sql;
  bool operator==(const SchemaEntry& other) const {
    return type == other.type && name == other.name && table == other.table && sql == other.sql;
  }
};

std::string WithSingleBlanks(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const bool is_blank = std::isspace(static_cast<unsigned char>(c)) != 0;
    if (!is_blank) result += c;
    if (is_blank && !result.empty() && result.back() != ' ') result += ' ';
  }
  return result;
}

// At most `max_entries` of them. Throws std::runtime_error if they cannot be read.
std::vector<SchemaEntry> ReadSchema(sqlite3* db, size_t max_entries) {
  Statement rows(db, "SELECT type, name, tbl_name, sql FROM sqlite_master ORDER BY rowid");
  std::vector<SchemaEntry> entries;
  int code = SQLITE_ROW;
  while (entries.size() < max_entries && (code = rows.Step()) == SQLITE_ROW) {
    entries.push_back({rows.Text(0), rows.Text(1), rows.Text(2), WithSingleBlanks(rows.Text(3))});
  }
  if (code != SQLITE_ROW && code != SQLITE_DONE) throw std::runtime_error(sqlite3_errmsg(db));
  return entries;
}

// As SQLite itself writes it down.
const std::vector<SchemaEntry>& OwnSchema() {
  static const std::vector<SchemaEntry> kOwn = [] {
    sqlite3* db = nullptr;
    const bool is_made = sqlite3_open(":memory:", &db) == SQLITE_OK &&
                         sqlite3_exec(db, kSchema, nullptr, nullptr, nullptr) == SQLITE_OK;
    const std::unique_ptr<sqlite3, decltype(&sqlite3_close)> closer(db, &sqlite3_close);
    if (!is_made) throw std::bad_alloc();
    return ReadSchema(db, 100);
  }();
  return kOwn;
}

// "" if the two are the same.
std::string FirstDifference(const std::vector<SchemaEntry>& found) {
  const std::vector<SchemaEntry>& own = OwnSchema();
  for (const SchemaEntry& entry : found) {
    if (std::find(own.begin(), own.end(), entry) == own.end()) {
      return "holds a " + entry.type + " that Skein did not make: " + entry.name.substr(0, 64);
    }
  }
  return found.size() == own.size() ? "" : "lacks a table or an index";
}

bool HasTable(const std::vector<SchemaEntry>& schema, const char* name) {
  return std::any_of(schema.begin(), schema.end(), [name](const SchemaEntry& entry) {
    return entry.type == "table" && entry.name == name;
  });
}

bool NamesAnotherFile(const Bytes& journal) {
  return journal.size() >= kMagicBytes && std::memcmp(journal.data() + journal.size() - kMagicBytes,
                                                      kSuperJournalMagic, kMagicBytes) == 0;
}

// What SQLite opens by itself beside the file.
Status CheckFilesOf(const std::filesystem::path& path) {
  const std::filesystem::path root = path.parent_path();
  for (const char* suffix : {"", "-wal", "-shm", "-journal"}) {
    const Status file = CheckFileBelow(root, path.string() + suffix);
    if (!file.ok() && file.code == StatusCode::kInvalidArgument) return file;
  }
  const Result<Bytes> journal = ReadFileBelow(root, path.string() + "-journal", kMaxJournalBytes);
  if (journal.code() == StatusCode::kNotFound) return Status::Ok();
  if (!journal.ok()) return journal.status();
  return NamesAnotherFile(*journal) ? DataLoss(path.string() + "-journal names another file")
                                    : Status::Ok();
}

int CountSteps(void* steps_left) {
  int64_t& left = *static_cast<int64_t*>(steps_left);
  left -= kStepsPerCall;
  return left < 0 ? 1 : 0;
}

void AddDamage(std::string line, LedgerSurvey* survey, size_t* num_more) {
  if (survey->damage.size() < LedgerSurvey::kMaxDamage) {
    survey->damage.push_back(std::move(line));
  } else {
    ++*num_more;
  }
}

}  // namespace

Result<LedgerLock> LedgerLock::Take(const std::filesystem::path& ledger) {
  Result<FileDescriptor> file =
      OpenFileBelow(ledger.parent_path(), ledger.string() + ".lock", O_RDWR | O_CREAT);
  if (!file.ok()) return file.status();
  if (flock(file->get(), LOCK_EX | LOCK_NB) == 0) return LedgerLock(*std::move(file));
  return Unavailable(ledger.string() +
                     " is in use: another skein-ingest runs on this session; stop it first");
}

Result<std::unique_ptr<Ledger>> Ledger::Open(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger(path));
  Result<LedgerLock> lock = LedgerLock::Take(path);
  if (!lock.ok()) return lock.status();
  std::error_code error;
  if (!std::filesystem::exists(path, error) &&
      std::filesystem::exists(path.string() + ".new", error)) {
    return FailedPrecondition(path.string() +
                              ": a repair was interrupted; run `skein repair` again");
  }
  ledger->lock_ = *std::move(lock);
  Status status = ledger->Connect(SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
  if (status.ok()) status = ledger->CheckSchema(true);
  if (status.ok()) status = ledger->Execute("PRAGMA journal_mode = WAL");
  if (status.ok()) status = ledger->Execute("PRAGMA synchronous = FULL");
  if (!status.ok()) return status;
  const auto head = ledger->QueryInteger("SELECT COALESCE(MAX(seq), 0) FROM facts");
  if (!head.ok()) return head.status();
  ledger->head_seq_ = *head;
  return ledger;
}

Result<std::unique_ptr<Ledger>> Ledger::OpenReadOnly(const std::filesystem::path& path) {
  std::unique_ptr<Ledger> ledger(new Ledger(path));
  Status status = ledger->Connect(SQLITE_OPEN_READONLY);
  if (status.ok()) status = ledger->CheckSchema(false);
  if (!status.ok()) return status;
  const auto head = ledger->QueryInteger("SELECT COALESCE(MAX(seq), 0) FROM facts");
  if (!head.ok()) return head.status();
  ledger->head_seq_ = *head;
  return ledger;
}

Ledger::~Ledger() { sqlite3_close(db_); }

// The folder is the caller's word: its own symbolic links are resolved, as SQLite would refuse
// them.
Status Ledger::Connect(int flags) {
  if (Status files = CheckFilesOf(path_); !files.ok()) return files;
  std::error_code error;
  const std::filesystem::path folder = path_.parent_path().empty() ? "." : path_.parent_path();
  const std::filesystem::path canonical = std::filesystem::canonical(folder, error);
  if (error) return NotFound("cannot open " + path_.string() + ": " + error.message());
  const std::string file = canonical / path_.filename();
  if (sqlite3_open_v2(file.c_str(), &db_, flags | SQLITE_OPEN_NOFOLLOW, nullptr) != SQLITE_OK) {
    return Unavailable("cannot open " + path_.string() + ": " + sqlite3_errmsg(db_));
  }
  sqlite3_busy_timeout(db_, 5000);
  sqlite3_db_config(db_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
  sqlite3_db_config(db_, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
  sqlite3_db_config(db_, SQLITE_DBCONFIG_ENABLE_TRIGGER, 0, nullptr);
  sqlite3_db_config(db_, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
  sqlite3_limit(db_, SQLITE_LIMIT_LENGTH, kMaxRowBytes);
  sqlite3_limit(db_, SQLITE_LIMIT_ATTACHED, 0);
  sqlite3_progress_handler(db_, kStepsPerCall, CountSteps, &steps_left_);
  AllowSteps();
  return Status::Ok();
}

void Ledger::AllowSteps() const {
  int64_t bytes = 0;
  for (const char* suffix : {"", "-wal"}) {
    std::error_code error;
    const uintmax_t size = std::filesystem::file_size(path_.string() + suffix, error);
    if (!error) bytes += static_cast<int64_t>(size);
  }
  steps_left_ = kStepsOfAny + kStepsPerByte * bytes;
  row_bytes_left_ = kMoreRowBytes + bytes;
}

bool Ledger::FitsFile(size_t row_bytes) const {
  row_bytes_left_ -= static_cast<int64_t>(row_bytes);
  return row_bytes_left_ >= 0;
}

Status Ledger::CheckSchema(bool create) {
  const std::string path = path_.string();
  std::vector<SchemaEntry> schema;
  try {
    schema = ReadSchema(db_, OwnSchema().size() + 1);
  } catch (const std::runtime_error& error) {
    return Unavailable(path + " is no ledger: " + error.what());
  }
  if (schema.empty() && create) return Execute(kSchema);
  const std::string difference = FirstDifference(schema);
  if (!difference.empty()) return DataLoss(path + " " + difference);
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
  AllowSteps();
  if (sqlite3_exec(db_, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK) return Status::Ok();
  return Unavailable(std::string("ledger: ") + sqlite3_errmsg(db_));
}

Result<int64_t> Ledger::QueryInteger(const std::string& sql) const {
  AllowSteps();
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
  AllowSteps();
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
  AllowSteps();
  Statement statement(db_, "SELECT * FROM facts WHERE seq BETWEEN ? AND ? ORDER BY seq");
  statement.Bind(1, from_seq);
  statement.Bind(2, to_seq);
  int64_t last_seq = std::numeric_limits<int64_t>::min();
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    Result<LedgerRecord> record = RecordOf(statement);
    if (!record.ok()) return record.status();
    // Pages of a tree that lead to one another would never end.
    if (record->seq <= last_seq || !FitsFile(record->payload.size())) {
      return DataLoss(
          "ledger: pages of facts lead to one another; `skein check SESSION` tells more");
    }
    last_seq = record->seq;
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
  AllowSteps();
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
  std::unique_ptr<Ledger> ledger(new Ledger(path));
  const Status status = ledger->Connect(SQLITE_OPEN_READONLY);
  if (!status.ok()) return status;
  try {
    const std::vector<SchemaEntry> schema = ReadSchema(ledger->db_, 100);
    if (HasTable(schema, "facts") && HasTable(schema, "notes")) return ledger;
  } catch (const std::runtime_error&) {
    ledger->RequireMemory();
  }
  return DataLoss(path.string() + " holds no facts that can be read");
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
  AllowSteps();
  Statement statement(db_, "SELECT * FROM facts WHERE seq = ?");
  size_t num_more = 0, num_damage_before_gap = survey->damage.size();
  int num_missing = 0, num_all_missing = 0;
  const auto lost = [&](int64_t seq, const std::string& reason) {
    AddDamage("ledger: fact " + std::to_string(seq) + ": " + reason, survey, &num_more);
  };
  for (int64_t seq = 1; head_seq_ > 0 ? seq <= head_seq_ : num_missing < kMaxMissing; ++seq) {
    statement.Bind(1, seq);
    const int code = statement.Step();
    RequireMemory();
    if (code == SQLITE_ROW) {
      Result<LedgerRecord> record = RecordOf(statement);
      if (record.ok() && !FitsFile(record->payload.size())) {
        lost(seq, "facts share pages; what follows is not looked up");
        break;
      }
      if (!record.ok()) AddDamage(record.error(), survey, &num_more);
      if (record.ok()) survey->records.push_back(*std::move(record));
      RequireMemory();
      num_damage_before_gap = survey->damage.size();
      num_missing = 0;
    } else if (const int64_t next = code == SQLITE_DONE ? NextSeq(seq) : 0; next > seq + 1) {
      lost(seq, "is missing, and all before " + std::to_string(next));
      seq = next - 1;
    } else {
      lost(seq, code == SQLITE_DONE ? "is missing" : sqlite3_errmsg(db_));
      ++num_missing;
      ++num_all_missing;
    }
    statement.Reset();
    if (num_all_missing == kMaxAllMissing) {
      lost(seq, "so much is missing before it that what follows is not looked up");
      break;
    }
    if (head_seq_ > 0 && num_missing == kMaxMissing) {
      seq = NextSeq(seq) - 1;
      num_missing = 0;
      if (seq < 0) break;
    }
  }
  if (head_seq_ == 0) {
    survey->damage.resize(num_damage_before_gap);
  } else if (num_more > 0) {
    survey->damage.push_back("ledger: " + std::to_string(num_more) + " more facts are damaged");
  }
}

void Ledger::SurveyNotes(LedgerSurvey* survey) const {
  AllowSteps();
  Statement statement(db_, "SELECT * FROM notes");
  size_t num_more = 0;
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    // At least its checksum.
    if (!FitsFile(kChecksumBytes + statement.Text(2).size())) {
      survey->damage.push_back("ledger: notes share pages; what follows is not read");
      return;
    }
    Result<LedgerNote> note = NoteOf(statement);
    if (!note.ok()) AddDamage(note.error(), survey, &num_more);
    if (note.ok()) survey->notes.push_back(*std::move(note));
  }
  if (num_more > 0) {
    survey->damage.push_back("ledger: " + std::to_string(num_more) + " more notes are damaged");
  }
  if (code != SQLITE_DONE) survey->damage.push_back(ReadError().error());
}

void Ledger::SurveyPages(LedgerSurvey* survey) const {
  AllowSteps();
  Statement statement(db_, "PRAGMA integrity_check(10)");
  int code = SQLITE_ROW;
  while ((code = statement.Step()) == SQLITE_ROW) {
    if (statement.Text(0) != "ok") survey->damage.push_back("ledger: " + statement.Text(0));
  }
  if (code != SQLITE_DONE) survey->damage.push_back(ReadError().error());
}

}  // namespace skein
