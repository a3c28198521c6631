#include "ledger/ledger_store.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "core/clock.h"
#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::ledger_store_test {

LedgerRecord Record(int64_t seq, size_t payload_bytes = 3) {
  return {seq, "features/" + std::to_string(seq), "features", 1000 + seq,
          Bytes(payload_bytes, static_cast<uint8_t>(seq))};
}

TEST(Ledger, GoesOnWhereItStopped) {
  TestFolder folder;
  {
    auto ledger = Ledger::Open(folder / "ledger.db");
    ASSERT_TRUE(ledger.ok()) << ledger.error();
    EXPECT_EQ((*ledger)->head(), 0);
    ASSERT_TRUE(
        (*ledger)->Append({Record(1), Record(2)}, {{"camera", std::string("a\0b", 3), "1"}}).ok());
  }
  auto ledger = Ledger::Open(folder / "ledger.db");
  ASSERT_TRUE(ledger.ok()) << ledger.error();
  EXPECT_EQ((*ledger)->head(), 2);
  ASSERT_TRUE((*ledger)->Append({Record(3, 0)}).ok());
  const auto range = (*ledger)->Range(2, 9);
  ASSERT_EQ(range->size(), 2u);
  EXPECT_EQ((*range)[0].fact_id, "features/2");
  EXPECT_EQ((*range)[0].payload, Bytes(3, 2));
  EXPECT_EQ((*range)[1].utime_us, 1003);
  EXPECT_TRUE((*range)[1].payload.empty());
  EXPECT_EQ((*ledger)->Notes("camera")->size(), 1u);
  EXPECT_TRUE((*ledger)->Notes("other")->empty());
}

TEST(Ledger, RefusesASecondWriterButServesReaders) {
  TestFolder folder;
  auto writer = Ledger::Open(folder / "ledger.db");
  ASSERT_TRUE(writer.ok());
  ASSERT_TRUE((*writer)->Append({Record(1)}).ok());
  const auto second = Ledger::Open(folder / "ledger.db");
  ASSERT_FALSE(second.ok());
  EXPECT_NE(second.error().find("another skein-ingest"), std::string::npos);
  auto reader = Ledger::OpenReadOnly(folder / "ledger.db");
  ASSERT_TRUE(reader.ok()) << reader.error();
  EXPECT_EQ((*reader)->head(), 1);
}

TEST(Ledger, AppendsAllOrNothing) {
  TestFolder folder;
  auto ledger = Ledger::Open(folder / "ledger.db");
  LedgerRecord twin = Record(2);
  twin.fact_id = Record(1).fact_id;
  EXPECT_FALSE((*ledger)->Append({Record(1), twin}).ok());
  EXPECT_EQ((*ledger)->head(), 0);
  EXPECT_TRUE((*ledger)->Range(1, 9)->empty());
  EXPECT_TRUE((*ledger)->Append({Record(1)}).ok());
}

TEST(Ledger, GapsAreABrokenContract) {
  TestFolder folder;
  auto ledger = Ledger::Open(folder / "ledger.db");
  EXPECT_THROW((*ledger)->Append({Record(2)}), std::logic_error);
}

TEST(Ledger, RefusesForeignAndNewerFiles) {
  TestFolder folder;
  std::ofstream(folder / "text.db") << std::string(4096, 'x');
  EXPECT_FALSE(Ledger::Open(folder / "text.db").ok());
  EXPECT_FALSE(Ledger::OpenReadOnly(folder / "absent.db").ok());
  ASSERT_TRUE(Ledger::Open(folder / "ledger.db").ok());
  sqlite3* db = nullptr;
  sqlite3_open((folder / "ledger.db").c_str(), &db);
  sqlite3_exec(db, "PRAGMA user_version = 99", nullptr, nullptr, nullptr);
  sqlite3_close(db);
  const auto newer = Ledger::Open(folder / "ledger.db");
  ASSERT_FALSE(newer.ok());
  EXPECT_NE(newer.error().find("schema version"), std::string::npos);
}

// As a flipped bit in it would.
TEST(Ledger, ADamagedNumberOfTheLastRecordIsFoundWithoutLookingUpAllBefore) {
  TestFolder folder;
  ASSERT_TRUE(
      (*Ledger::Open(folder / "ledger.db"))->Append({Record(1), Record(2), Record(3)}).ok());
  sqlite3* db = nullptr;
  sqlite3_open((folder / "ledger.db").c_str(), &db);
  sqlite3_exec(db, "UPDATE facts SET seq = 4611686018427387904 WHERE seq = 3", nullptr, nullptr,
               nullptr);
  sqlite3_close(db);
  const LedgerSurvey survey = Ledger::Survey(folder / "ledger.db");
  EXPECT_EQ(survey.records.size(), 2u);
  EXPECT_FALSE(survey.IsWhole());
}

TEST(Ledger, WhatWasAppendedSurvivesAKillInTheMiddleOfWriting) {
  TestFolder folder;
  int pipe_fds[2];
  ASSERT_EQ(pipe(pipe_fds), 0);
  const pid_t child = fork();
  if (child == 0) {
    auto ledger = Ledger::Open(folder / "ledger.db");
    for (int64_t seq = 1;; ++seq) {
      if (!(*ledger)->Append({Record(seq, 5000)}).ok()) _exit(1);
      if (write(pipe_fds[1], &seq, sizeof(seq)) != sizeof(seq)) _exit(1);
    }
  }
  close(pipe_fds[1]);
  int64_t acknowledged = 0;
  while (acknowledged < 20) {
    ASSERT_EQ(read(pipe_fds[0], &acknowledged, sizeof(acknowledged)), ssize_t{8});
  }
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
  for (int64_t seq; read(pipe_fds[0], &seq, sizeof(seq)) == sizeof(seq);) acknowledged = seq;
  close(pipe_fds[0]);
  auto ledger = Ledger::Open(folder / "ledger.db");
  ASSERT_TRUE(ledger.ok()) << ledger.error();
  EXPECT_GE((*ledger)->head(), acknowledged);
  EXPECT_EQ((*ledger)->Range(1, acknowledged)->size(), static_cast<size_t>(acknowledged));
}

TEST(Ledger, AFailedWriteIsAnErrorAndLeavesTheLedgerAsItWas) {
  TestFolder folder;
  const pid_t child = fork();
  if (child == 0) {
    auto ledger = Ledger::Open(folder / "ledger.db");
    if (!(*ledger)->Append({Record(1)}).ok()) _exit(2);
    signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{200000, 200000};  // every file of this process, as on a full disk
    setrlimit(RLIMIT_FSIZE, &limit);
    const Status status = (*ledger)->Append({Record(2, 1000000)});
    _exit(!status.ok() && (*ledger)->head() == 1 ? 0 : 3);
  }
  int code = 0;
  waitpid(child, &code, 0);
  EXPECT_EQ(WEXITSTATUS(code), 0);
  auto ledger = Ledger::Open(folder / "ledger.db");
  ASSERT_TRUE(ledger.ok()) << ledger.error();
  EXPECT_EQ((*ledger)->head(), 1);
  EXPECT_TRUE((*ledger)->Append({Record(2)}).ok());
}

// A ledger that somebody else made.
class ForeignLedgerTest : public testing::Test {
 protected:
  void Make(int num_records, const std::string& then) const {
    std::vector<LedgerRecord> records;
    for (int seq = 1; seq <= num_records; ++seq) records.push_back(Record(seq));
    ASSERT_TRUE((*Ledger::Open(file_))->Append(records).ok());
    Run(then);
  }
  void Run(const std::string& sql) const {
    sqlite3* db = nullptr;
    ASSERT_EQ(sqlite3_open(file_.c_str(), &db), SQLITE_OK);
    EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
        << sqlite3_errmsg(db);
    sqlite3_close(db);
  }
  std::string Refusal() const {
    const auto reader = Ledger::OpenReadOnly(file_), writer = Ledger::Open(file_);
    EXPECT_FALSE(reader.ok());
    EXPECT_FALSE(writer.ok());
    return writer.error();
  }

  TestFolder folder_;
  const std::filesystem::path file_ = folder_ / "ledger.db";
};

TEST_F(ForeignLedgerTest, ATriggerIsRefusedAndWhatItWouldDeleteIsThere) {
  Make(3, "CREATE TRIGGER t AFTER INSERT ON facts BEGIN DELETE FROM facts; END");
  EXPECT_NE(Refusal().find("holds a trigger that Skein did not make: t"), std::string::npos);
  const LedgerSurvey survey = Ledger::Survey(file_);
  EXPECT_FALSE(survey.IsWhole());
  EXPECT_EQ(survey.records.size(), 3u) << "`skein repair` takes them into a new ledger";
}

TEST_F(ForeignLedgerTest, MoreTablesIndexesAndViewsAreRefused) {
  for (const char* sql :
       {"CREATE TABLE more(x)", "CREATE INDEX i ON facts(kind)", "CREATE VIEW v AS SELECT 1"}) {
    std::filesystem::remove(file_);
    Make(1, sql);
    EXPECT_NE(Refusal().find("that Skein did not make"), std::string::npos) << sql;
  }
}

TEST_F(ForeignLedgerTest, AnEndlessViewInPlaceOfTheFactsIsNotRead) {
  Make(1,
       "DROP TABLE facts; CREATE VIEW facts AS WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT "
       "x + 1 FROM n) SELECT x AS seq, '' AS fact_id, '' AS kind, 0 AS utime_us, x'' AS payload, "
       "'' AS checksum FROM n");
  EXPECT_NE(Refusal().find("view"), std::string::npos);
  const LedgerSurvey survey = Ledger::Survey(file_);
  EXPECT_FALSE(survey.IsWhole());
  EXPECT_TRUE(survey.records.empty());
}

// The sum of a generated column is worked out as it is read.
TEST_F(ForeignLedgerTest, AStatementEnds) {
  Run("CREATE TABLE facts(seq INTEGER PRIMARY KEY, fact_id TEXT, kind TEXT, utime_us INTEGER, "
      "payload BLOB, checksum TEXT); CREATE TABLE notes(kind TEXT, key TEXT, value TEXT, checksum "
      "TEXT); PRAGMA application_id = 1397443655; PRAGMA user_version = 3; "
      "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n WHERE x < 1000) "
      "INSERT INTO facts SELECT x, x, '', 0, x'', '' FROM n");
  EXPECT_FALSE(Ledger::OpenReadOnly(file_).ok());
  const LedgerSurvey survey = Ledger::Survey(file_);
  EXPECT_FALSE(survey.IsWhole());
}

TEST_F(ForeignLedgerTest, ALargeRowIsNotTakenIntoMemory) {
  Make(2, "UPDATE facts SET payload = zeroblob(150000000) WHERE seq = 2");
  rusage before{}, after{};
  getrusage(RUSAGE_SELF, &before);
  const LedgerSurvey survey = Ledger::Survey(file_);
  getrusage(RUSAGE_SELF, &after);
  EXPECT_EQ(survey.records.size(), 1u);
  EXPECT_FALSE(survey.IsWhole());
  EXPECT_LT(after.ru_maxrss - before.ru_maxrss, 100'000) << "KiB";
}

TEST_F(ForeignLedgerTest, ManyBadRowsAreToldInABoundedNumberOfLines) {
  Make(1,
       "WITH RECURSIVE n(x) AS (SELECT 2 UNION ALL SELECT x + 1 FROM n WHERE x < 100000) INSERT "
       "INTO facts SELECT x, x, 'image', 0, x'00', 'bad' FROM n");
  const LedgerSurvey survey = Ledger::Survey(file_);
  EXPECT_EQ(survey.records.size(), 1u);
  EXPECT_EQ(survey.damage.size(), LedgerSurvey::kMaxDamage + 1);
  EXPECT_NE(survey.damage.back().find("98999 more"), std::string::npos) << survey.damage.back();
}

// Each gap would cost thousands of lookups.
TEST_F(ForeignLedgerTest, RowsFarApartAreNotLookedUpOneByOne) {
  Make(1,
       "WITH RECURSIVE n(x) AS (SELECT 2 UNION ALL SELECT x + 1 FROM n WHERE x < 20000) INSERT "
       "INTO facts SELECT x * 100000, x, 'image', 0, x'00', 'bad' FROM n");
  const double begin_s = MonotonicS();
  EXPECT_FALSE(Ledger::Survey(file_).IsWhole());
  EXPECT_LT(MonotonicS() - begin_s, 5);
}

// Every pointer of the root of a tree leads to one page: such trees may have 300^19 rows.
TEST_F(ForeignLedgerTest, PagesThatLeadToOneAnotherEnd) {
  Make(2000, "PRAGMA journal_mode = DELETE");
  Bytes bytes = *ReadFile(file_.string());
  constexpr size_t kPage = 4096;
  const auto at = [&](size_t i) { return size_t{bytes[i]} << 8 | bytes[i + 1]; };
  size_t num_changed = 0;
  for (size_t page = kPage; page < bytes.size(); page += kPage) {
    if (bytes[page] != 0x05) continue;  // an interior page of a table
    const size_t first = page + at(page + 12);
    for (size_t cell = 0; cell < at(page + 3); ++cell) {
      std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(first), 4,
                  bytes.begin() + static_cast<std::ptrdiff_t>(page + at(page + 12 + 2 * cell)));
      ++num_changed;
    }
  }
  ASSERT_GT(num_changed, 2u);
  ASSERT_TRUE(WriteFileAtomic(file_.string(), bytes).ok());
  const auto ledger = Ledger::OpenReadOnly(file_);
  ASSERT_TRUE(ledger.ok()) << ledger.error();
  int num_read = 0;
  EXPECT_FALSE((*ledger)->ForEach([&](const LedgerRecord&) { ++num_read; }).ok());
  EXPECT_LT(num_read, 2000);
  EXPECT_FALSE(Ledger::Survey(file_).IsWhole());
}

// SQLite reads the file that such a journal names, and removes it.
TEST_F(ForeignLedgerTest, AJournalThatNamesAnotherFileIsRefused) {
  Make(1, "PRAGMA journal_mode = DELETE");
  const std::string victim = folder_ / "victim";
  std::ofstream(victim) << "kept";
  std::string journal(512, '\0');
  journal.replace(0, 8, "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7");
  uint32_t sum = 0;
  for (const char c : victim) sum += static_cast<uint32_t>(c);
  const auto big = [](uint32_t n) {
    return std::string{static_cast<char>(n >> 24), static_cast<char>(n >> 16),
                       static_cast<char>(n >> 8), static_cast<char>(n)};
  };
  journal += big(1) + victim + big(static_cast<uint32_t>(victim.size())) + big(sum) +
             "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  std::ofstream(file_.string() + "-journal") << journal;
  EXPECT_NE(Refusal().find("names another file"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(victim));
}

TEST_F(ForeignLedgerTest, LinksAndFifosInPlaceOfItsFilesAreRefusedAtOnce) {
  Make(1, "");
  const std::filesystem::path other = folder_ / "other.db";
  for (const char* suffix : {"", "-wal", "-shm", "-journal", ".lock"}) {
    const std::filesystem::path file = file_.string() + suffix;
    const bool was_there = std::filesystem::exists(file);
    if (was_there) std::filesystem::rename(file, other);
    std::filesystem::create_symlink(other, file);
    EXPECT_FALSE(Ledger::Open(file_).ok()) << suffix;
    std::filesystem::remove(file);
    ASSERT_EQ(mkfifo(file.c_str(), 0600), 0);
    EXPECT_FALSE(Ledger::Open(file_).ok()) << suffix;
    std::filesystem::remove(file);
    if (was_there) std::filesystem::rename(other, file);
  }
  EXPECT_TRUE(Ledger::Open(file_).ok());
}

}  // namespace skein::ledger_store_test
