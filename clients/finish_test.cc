#include "clients/finish.h"

#include <gtest/gtest.h>

#include <sstream>

#include "core/clock.h"
#include "testing/test_node.h"

namespace skein::finish_test {

constexpr double kDeadlineS = 20;

class FinishTest : public testing::Test {
 protected:
  FinishTest() {
    bus_.Subscribe<command_t>(kCommandChannel, [this](const command_t& command) {
      commands_.push_back(command);
      if (on_command_) on_command_(command);
    });
  }
  void Reply(int64_t command_id, bool ok, const std::string& text) {
    command_reply_t reply{};
    reply.command_id = command_id;
    reply.ok = ok;
    reply.text = text;
    ingest_.Publish(kCommandReplyChannel, reply);
  }
  void Heartbeat(const std::string& service, const std::string& state) {
    heartbeat_t heartbeat{};
    heartbeat.service = service;
    heartbeat.state = state;
    ingest_.Publish(kHeartbeatChannel, heartbeat);
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_{TestOptions("ingest-by-hand"), loop_, bus_};
  Node node_{TestOptions("finish-1"), loop_, bus_};
  std::function<void(const command_t&)> on_command_;
  std::vector<command_t> commands_;
  std::ostringstream progress_;
};

TEST_F(FinishTest, RepeatsOneCommandUntilItIsAnswered) {
  on_command_ = [&](const command_t& command) {
    Reply(command.command_id + 1, true, "another's answer");
    if (commands_.size() == 3) Reply(command.command_id, true, "3 of 3 photos registered");
  };
  const auto answer = AskToFinish(node_, kDeadlineS, progress_);
  ASSERT_TRUE(answer);
  EXPECT_TRUE(answer->ok);
  EXPECT_EQ(answer->text, "3 of 3 photos registered");
  ASSERT_EQ(commands_.size(), 3u);
  EXPECT_EQ(commands_[0].verb, "finish");
  EXPECT_EQ(commands_[0].sender, "finish-1");
  EXPECT_EQ(commands_[2].command_id, commands_[0].command_id);
}

TEST_F(FinishTest, TheSecondsGoWithTheCommand) {
  on_command_ = [&](const command_t& command) { Reply(command.command_id, true, ""); };
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_));
  EXPECT_EQ(commands_.back().argument, "");
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_, 12.5));
  EXPECT_EQ(std::stod(commands_.back().argument), 12.5);
}

TEST_F(FinishTest, RefusesWhatIsNoPositiveNumberOfSeconds) {
  for (std::string seconds : {"0", "-1", "soon"}) {
    std::string program = "finish", option = "--within", session = "--session", folder = "/tmp";
    char* argv[] = {program.data(), option.data(), seconds.data(),
                    session.data(), folder.data(), nullptr};
    EXPECT_EQ(RunFinish(5, argv), 2) << seconds;
  }
}

TEST_F(FinishTest, EachCallIsACommandOfItsOwn) {
  on_command_ = [&](const command_t& command) { Reply(command.command_id, true, ""); };
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_));
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_));
  EXPECT_NE(commands_.front().command_id, commands_.back().command_id);
}

TEST_F(FinishTest, TellsARefusal) {
  on_command_ = [&](const command_t& command) { Reply(command.command_id, false, "no photos"); };
  const auto answer = AskToFinish(node_, kDeadlineS, progress_);
  ASSERT_TRUE(answer);
  EXPECT_FALSE(answer->ok);
  EXPECT_EQ(answer->text, "no photos");
}

TEST_F(FinishTest, GivesUpWhenTheTimeIsOver) {
  const double start_s = MonotonicS();
  EXPECT_FALSE(AskToFinish(node_, 0.1, progress_));
  EXPECT_GE(MonotonicS() - start_s, 0.1);
  EXPECT_FALSE(commands_.empty());
}

TEST_F(FinishTest, TellsWhatIngestDoesWheneverThatChanges) {
  on_command_ = [&](const command_t& command) {
    const std::string states[] = {"waits for 2 photos", "waits for 2 photos", "writes the models"};
    Heartbeat("ingest", states[commands_.size() - 1]);
    Heartbeat("matching", "matches");
    if (commands_.size() == 3) Reply(command.command_id, true, "");
  };
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_));
  std::vector<std::string> told;
  std::istringstream lines(progress_.str());
  for (std::string line; std::getline(lines, line);)
    told.push_back(line.substr(line.find(']') + 2));
  EXPECT_EQ(told, (std::vector<std::string>{"waits for 2 photos", "writes the models"}));
}

TEST_F(FinishTest, TellsWhatTheSubmapsDoMeanwhile) {
  on_command_ = [&](const command_t& command) {
    submap_status_t status{};
    status.submap_id = 3;
    status.num_images = 120;
    status.detail = "consolidates, about 8 s";
    ingest_.Publish(kSubmapStatusChannel, status);
    status.submap_id = 4;
    status.detail = "";
    ingest_.Publish(kSubmapStatusChannel, status);
    status.submap_id = 5;
    status.num_images = 1;
    status.detail = "writes its model";
    ingest_.Publish(kSubmapStatusChannel, status);
    Heartbeat("ingest", "finishing: waits for the merger to settle");
    Reply(command.command_id, true, "");
  };
  ASSERT_TRUE(AskToFinish(node_, kDeadlineS, progress_));
  EXPECT_NE(progress_.str().find("settle; map 3 (120 photos): consolidates, about 8 s; map 5 (1 "
                                 "photo): writes its model\n"),
            std::string::npos);
}

}  // namespace skein::finish_test
