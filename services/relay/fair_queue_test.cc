#include "relay/fair_queue.h"

#include <gtest/gtest.h>

#include <vector>

namespace skein::fair_queue_test {

class FairFrameQueueTest : public testing::Test {
 protected:
  // A frame that is known by its first byte again.
  FairFrameQueue::FramePtr Frame(size_t size, uint8_t mark) {
    return std::make_shared<const SharedFrame>(Bytes(size, mark), held_);
  }
  static std::vector<int> Drain(FairFrameQueue* queue) {
    std::vector<int> marks;
    while (const auto frame = queue->Pop()) marks.push_back(frame->bytes()[0]);
    return marks;
  }
  const std::shared_ptr<size_t> held_ = std::make_shared<size_t>(0);
};

TEST_F(FairFrameQueueTest, KeepsTheOrderOfASender) {
  FairFrameQueue queue(1 << 20);
  for (const uint8_t mark : {1, 2, 3}) queue.Push(7, Frame(40'000, mark));
  EXPECT_EQ(Drain(&queue), (std::vector<int>{1, 2, 3}));
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.bytes(), 0u);
  EXPECT_EQ(*held_, 0u);
}

TEST_F(FairFrameQueueTest, ALoneMessageWaitsForOneTurnOfAFlood) {
  FairFrameQueue queue(8 << 20);
  for (int i = 0; i < 1000; ++i) queue.Push(1, Frame(1000, 1));
  queue.Push(2, Frame(1000, 2));
  size_t before = 0;
  while (queue.Pop()->bytes()[0] != 2) before += 1000;
  EXPECT_LE(before, FairFrameQueue::kTurnBytes);
}

TEST_F(FairFrameQueueTest, SendersGetTheSameBytesWhateverTheirFramesSizes) {
  FairFrameQueue queue(8 << 20);
  for (int i = 0; i < 2000; ++i) queue.Push(1, Frame(500, 1));
  for (int i = 0; i < 10; ++i) queue.Push(2, Frame(100'000, 2));
  size_t bytes[3] = {};
  for (size_t sum = 0; sum < 1'000'000;) {
    const auto frame = queue.Pop();
    bytes[frame->bytes()[0]] += frame->cost();
    sum += frame->cost();
  }
  EXPECT_NEAR(static_cast<double>(bytes[1]), static_cast<double>(bytes[2]), 150'000);
}

TEST_F(FairFrameQueueTest, WhoFillsItLosesItsNewest) {
  FairFrameQueue queue(100'000);
  int64_t num_dropped = 0;
  for (int i = 0; i < 200; ++i) num_dropped += queue.Push(1, Frame(1000, 1));
  EXPECT_GT(num_dropped, 100);
  EXPECT_LE(queue.bytes(), 100'000u);
  EXPECT_EQ(queue.Push(2, Frame(1000, 2)), 1) << "one of the flood's";
  EXPECT_EQ(queue.Push(2, Frame(1000, 3)), 1);
  const std::vector<int> marks = Drain(&queue);
  EXPECT_EQ(std::count(marks.begin(), marks.end(), 2), 1);
  EXPECT_EQ(std::count(marks.begin(), marks.end(), 3), 1);
}

TEST_F(FairFrameQueueTest, AFrameAboveItsSizeIsDropped) {
  FairFrameQueue queue(1000);
  EXPECT_EQ(queue.Push(1, Frame(1000, 1)), 1);
  EXPECT_TRUE(queue.empty());
  EXPECT_EQ(queue.Pop(), nullptr);
}

TEST_F(FairFrameQueueTest, ClearsAndCountsWhatIsHeldOnce) {
  FairFrameQueue one(1 << 20), other(1 << 20);
  auto frame = Frame(1000, 1);
  one.Push(1, frame);
  other.Push(1, frame);
  EXPECT_EQ(*held_, frame->cost());
  frame.reset();
  EXPECT_EQ(one.Clear(), 1);
  EXPECT_GT(*held_, 0u);
  EXPECT_EQ(other.Clear(), 1);
  EXPECT_EQ(*held_, 0u);
  EXPECT_EQ(one.Push(2, Frame(10, 2)), 0);
  EXPECT_EQ(Drain(&one), std::vector<int>{2});
}

}  // namespace skein::fair_queue_test
