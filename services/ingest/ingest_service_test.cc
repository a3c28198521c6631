#include "ingest/ingest_service.h"

#include <gtest/gtest.h>

#include <limits>
#include <new>
#include <stdexcept>

#include "core/attempt.h"
#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein::ingest_service_test {

TEST_F(IngestServiceTest, NotesWhatItRunsWithOnce) {
  configuration_ = "[ingest]\nlease = 6\n";
  Restart();
  Await([&] { return facts_.size() == 1; }, "the first configuration");
  Restart();
  configuration_ = "[ingest]\nlease = 9\n";
  Restart();
  Await([&] { return facts_.size() == 2; }, "two configurations");
  const auto& configuration = std::get<configuration_t>(facts_[1]);
  EXPECT_EQ(configuration.service, "ingest");
  EXPECT_EQ(configuration.text, configuration_);
}

TEST_F(IngestServiceTest, CountsMessagesOfAnotherTypeOnAnyChannelAndGoesOn) {
  std::vector<std::string> channels = {kImageOfferChannel.name,      kWorkRequestChannel.name,
                                       kWorkFailedChannel.name,      kCommandChannel.name,
                                       BlobRequestChannel("ingest"), kLedgerRequestChannel.name};
  ForEachSubmitChannel([&](const auto& channel) { channels.push_back(channel.name); });
  for (const std::string& channel : channels) {
    const int64_t before = bus_.counters().num_decode_failures;
    bus_.Publish(Channel<demand_t>{channel.c_str()}, demand_t{});
    Await([&] { return bus_.counters().num_decode_failures > before; }, "the count of " + channel);
  }
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  EXPECT_EQ(Submit(Features(1)), "");
}

// The answer names the offer and the reason, and is larger than the bus takes.
TEST_F(IngestServiceTest, AMessageOnWhichAnExceptionComesIsRefused) {
  image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  offer.session_id = ingest_->session_id();
  offer.size_bytes = std::numeric_limits<int64_t>::max();
  offer.name.resize(offer.name.size() + kMaxMessageBytes - offer.getEncodedSize(), 'a');
  const auto num_refused = [&] {
    const auto& refused = bus_.counters().refused;
    const auto found = refused.find(kImageOfferChannel.name);
    return found == refused.end() ? 0 : found->second;
  };
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return num_refused() == 2; }, "the refusals: of the size, and of the answer");
  EXPECT_TRUE(acks_.empty());
  EXPECT_EQ(Publish("b.jpg", SmallJpeg()).status, +image_ack_t::STORED);
}

TEST_F(IngestServiceTest, WhatThrowsTwiceIsCommittedAtItsThirdRepeat) {
  Publish("a.jpg", SmallJpeg());
  int num_left = kMaxFailures - 1;
  ingest_->steps().OnBegin([&](const Step& step) {
    if (step.name == "submission" && num_left-- > 0) throw std::bad_alloc();
  });
  EXPECT_EQ(Submit(Features(1)), "");
}

TEST_F(IngestServiceTest, ASubmissionThatThrowsThriceIsRefused) {
  Publish("a.jpg", SmallJpeg());
  ingest_->steps().OnBegin([&](const Step& step) {
    if (step.name == "submission") throw std::runtime_error("no rule holds");
  });
  EXPECT_EQ(Submit(Features(1)), "no rule holds");
  EXPECT_EQ(answer_state_, Submission::State::kRefused);
  ingest_->steps().OnBegin(nullptr);
  EXPECT_EQ(Submit(Features(1)), "");
}

class HeldUpIngestTest : public IngestServiceTest {
 protected:
  HeldUpIngestTest() {
    options_.intake.bounds.vanished_after_s = IntakeBounds().vanished_after_s;
    Restart();
    bus_.Subscribe<work_t>(kWorkChannel, [this](const work_t& work) { granted_ = work.item_id; });
  }

  void AskForFeatures() {
    work_request_t request{};
    request.worker = "features-1";
    request.kind = "features";
    request.capacity = 1;
    peer_->Publish(kWorkRequestChannel, request);
  }
  void AwaitGrant(int64_t image_id) {
    Await([&] { return granted_ == image_id; }, "a grant of photo " + std::to_string(image_id));
  }
  // As a stopped process, or a disk that does not answer.
  void HoldUp(double seconds) { held_up_s_ = held_up_s_ + seconds; }
  // Several rounds of ingest's timer.
  void GoRound() {
    bool done = false;
    loop_.AddOneShot(0.7, [&] { done = true; });
    Await([&] { return done; }, "some rounds");
  }

  int64_t granted_ = 0;
};

TEST_F(HeldUpIngestTest, TakesNoWorkerForSilentThatItCouldNotHear) {
  Publish("a.jpg", SmallJpeg(1));
  AskForFeatures();
  AwaitGrant(1);
  EXPECT_EQ(Submit(Features(1)), "");
  GoRound();
  AskForFeatures();
  EXPECT_EQ(Submit(Candidates(1)), "");  // ingest has heard the worker by then
  HoldUp(60);
  EXPECT_EQ(Publish("b.jpg", SmallJpeg(2)).image_id, 2);
  AwaitGrant(2);
}

TEST_F(HeldUpIngestTest, KeepsTheLeaseOfAWorkerThatItCouldNotHear) {
  Publish("a.jpg", SmallJpeg(1));
  AskForFeatures();
  AwaitGrant(1);
  work_request_t holder{};
  holder.worker = "features-1";
  holder.kind = "features";
  holder.held = {1};
  holder.num_held = 1;
  peer_->Publish(kWorkRequestChannel, holder);
  work_request_t other{};
  other.worker = "features-2";
  other.kind = "features";
  other.capacity = 1;
  peer_->Publish(kWorkRequestChannel, other);
  GoRound();
  granted_ = 0;
  HoldUp(60);
  GoRound();
  peer_->Publish(kWorkRequestChannel, other);
  GoRound();
  EXPECT_EQ(granted_, 0);
}

TEST_F(HeldUpIngestTest, GivesUpNoAgentThatItCouldNotHear) {
  Publish("a.jpg", SmallJpeg(1));
  image_offer_t offer = MakeOffer("b.jpg", SmallJpeg(2));
  offer.owner = "an agent that is silent for a moment";
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return !acks_.empty() && acks_.back().name == "b.jpg"; }, "an answer");
  AskToFinish(1);
  Await([&] { return Finished(finish_t::REQUESTED) != nullptr; }, "REQUESTED");
  GoRound();
  HoldUp(60);
  GoRound();
  EXPECT_EQ(Find<failure_t>([](const failure_t&) { return true; }), nullptr);
}

}  // namespace skein::ingest_service_test
