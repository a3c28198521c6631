#include "event_loop/step_record.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <thread>

#include "testing/test_folder.h"

namespace skein::step_record_test {

class StepRecordTest : public testing::Test {
 protected:
  // A process that dies within two steps of one thread and one of another.
  void DieWithin() const {
    const pid_t child = ::fork();
    if (child == 0) {
      StepRecord record(path_);
      const StepRecord::Scope outer(&record, 0, {3, "consolidation 7"});
      const StepRecord::Scope inner(&record, 0, {3, "photo 12"});
      const StepRecord::Scope other(&record, 1, {4, "shape"});
      ::raise(SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
  }

  TestFolder folder_;
  const std::string path_ = (folder_.path() / "mapper-1.step").string();
};

TEST_F(StepRecordTest, TellsTheInnermostStepOfEachThread) {
  DieWithin();
  const StepRecord next(path_);
  EXPECT_EQ(next.left(), (std::vector<Step>{{3, "photo 12"}, {4, "shape"}}));
  EXPECT_NE(next.left_life(), 0);
  EXPECT_NE(next.left_life(), next.life());
}

// A model that is written meanwhile was not to blame, and counted three times the submap ended.
TEST_F(StepRecordTest, ACrashIsPutDownToItsThread) {
  const pid_t child = ::fork();
  if (child == 0) {
    StepRecord record(path_);
    const StepRecord::Scope writes(&record, 1, {3, "model"});
    std::thread([&record] {
      const StepRecord::Scope adjusts(&record, 0, {3, "final adjustment 9"});
      ::raise(SIGSEGV);
    }).join();
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGSEGV);
  const StepRecord next(path_);
  EXPECT_EQ(next.left(), (std::vector<Step>{{3, "final adjustment 9"}}));
}

TEST_F(StepRecordTest, IsReadOnce) {
  DieWithin();
  { const StepRecord next(path_); }
  const StepRecord after(path_);
  EXPECT_TRUE(after.left().empty());
}

TEST_F(StepRecordTest, AStepThatIsOverIsNotLeft) {
  {
    StepRecord record(path_);
    const StepRecord::Scope scope(&record, 0, {3, "photo 12"});
  }
  EXPECT_TRUE(StepRecord(path_).left().empty());
}

TEST_F(StepRecordTest, ALongNameIsCutAtTheLine) {
  {
    StepRecord record(path_);
    const StepRecord::Scope scope(&record, 0, {3, std::string(1000, 'x')});
    const StepRecord next(path_);
    ASSERT_EQ(next.left().size(), 1u);
    EXPECT_LT(next.left()[0].name.size(), 128u);
  }
}

TEST_F(StepRecordTest, AnExceptionIsPutDownToTheInnermostStep) {
  StepRecord record("");
  try {
    const StepRecord::Scope outer(&record, 0, {3, "consolidation 7"});
    { const StepRecord::Scope done(&record, 0, {3, "photo 11"}); }
    const StepRecord::Scope inner(&record, 0, {3, "photo 12"});
    throw std::runtime_error("no such photo");
  } catch (const std::runtime_error&) {
  }
  EXPECT_EQ(record.TakeThrown(0), (Step{3, "photo 12"}));
  EXPECT_EQ(record.TakeThrown(0).item, 0);
}

}  // namespace skein::step_record_test
