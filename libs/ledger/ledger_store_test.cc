#include "ledger/ledger_store.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "testing/test_folder.h"

namespace skein {
namespace {

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

}  // namespace
}  // namespace skein
