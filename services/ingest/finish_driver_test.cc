#include "ingest/finish_driver.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/hash.h"
#include "node/work_client.h"
#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein {
namespace {

using FinishDriverTest = IngestServiceTest;

TEST_F(FinishDriverTest, FinishesWithModelsAndReportAndOpensAgain) {
  AddMatchedPhoto(1);
  AddMatchedPhoto(2);
  Publish("bad.jpg", {1, 2, 3});
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  bool leased = false;
  WorkClient mapper(*peer_, "submap", 1, [&](const work_t&) { leased = true; });
  Await([&] { return leased; }, "the submap");
  EXPECT_EQ(Submit(Registration(1, 1, 1)), "");
  EXPECT_EQ(Submit(Registration(2, 1, 1)), "");
  std::vector<command_reply_t> replies;
  bus_.Subscribe<command_reply_t>(kCommandReplyChannel,
                                  [&](const command_reply_t& reply) { replies.push_back(reply); });
  AskToFinish(77);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  Restart();
  finish_t settled{};
  settled.header.fact_id = "finish/settled";
  settled.state = finish_t::SETTLED;
  settled.finish_id = Finished(finish_t::DRAINED)->finish_id;
  EXPECT_EQ(Submit(settled), "");
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq() - 1)), "") << "too old, waits on";
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq())), "");
  Await([&] { return !replies.empty(); }, "the reply");
  EXPECT_EQ(replies[0].command_id, 77);
  EXPECT_EQ(replies[0].text, "2 of 3 photos registered, 1 model in sparse/");
  EXPECT_EQ(*ReadFile((Paths().Sparse() / "0" / "images.bin").string()), (Bytes{2, 2}));
  EXPECT_FALSE(std::filesystem::exists(Paths().Sparse() / "0" / "side.bin"));
  const auto report = nlohmann::json::parse(std::ifstream(Paths().Report()));
  EXPECT_EQ(report["images"]["received"], 3);
  EXPECT_EQ(report["images"]["registered"], 2);
  EXPECT_EQ(report["images"]["failed"], 1);
  EXPECT_EQ(report["failures"][0]["image"], "alice/bad.jpg");
  EXPECT_EQ(report["images_in_time"].size(), 2u);
  EXPECT_EQ(report["submaps"][0]["images"], 2);
  // A lost reply is told again; the session takes photos again.
  AskToFinish(77);
  Await([&] { return replies.size() == 2; }, "the reply again");
  EXPECT_EQ(Publish("later.jpg", SmallJpeg(9)).status, +image_ack_t::STORED);
}

TEST_F(FinishDriverTest, APairOfPhotosIsNoModelWhereThereAreMore) {
  for (const uint8_t id : {1, 2, 3}) AddMatchedPhoto(id);
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  bool leased = false;
  WorkClient mapper(*peer_, "submap", 1, [&](const work_t&) { leased = true; });
  Await([&] { return leased; }, "the submap");
  for (const int64_t id : {1, 2}) EXPECT_EQ(Submit(Registration(id, 1, 1)), "");
  AskToFinish(77);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  finish_t settled{};
  settled.header.fact_id = "finish/settled";
  settled.state = finish_t::SETTLED;
  settled.finish_id = Finished(finish_t::DRAINED)->finish_id;
  EXPECT_EQ(Submit(settled), "");
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq())), "");
  Await([&] { return Finished(finish_t::DONE) != nullptr; }, "DONE");
  const auto report = nlohmann::json::parse(std::ifstream(Paths().Report()));
  EXPECT_EQ(report["images"]["registered"], 0);
  EXPECT_EQ(report["images"]["deferred"], 3);
  EXPECT_TRUE(report["submaps"].empty());
  EXPECT_FALSE(std::filesystem::exists(Paths().Sparse() / "0"));
}

TEST_F(FinishDriverTest, TakesNoNewPhotoWhileItFinishes) {
  AddMatchedPhoto(1);
  AskToFinish(5);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  peer_->Publish(kImageOfferChannel, MakeOffer("late.jpg", SmallJpeg(2)));
  Await([&] { return !acks_.empty() && acks_.back().name == "late.jpg"; }, "the answer");
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
  EXPECT_NE(acks_.back().reason.find("finishing"), std::string::npos);
}

TEST_F(FinishDriverTest, GivesUpAnAgentThatVanishedWhenAFinishWaits) {
  image_offer_t offer = MakeOffer("half.jpg", SmallJpeg());
  offer.blob_id = HashBytes("x", 1);
  offer.owner = "vanished";
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return !acks_.empty(); }, "the first answer");
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
  AskToFinish(6);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  const auto* failure = Find<failure_t>([](const failure_t& f) { return f.name == "half.jpg"; });
  ASSERT_NE(failure, nullptr);
  EXPECT_NE(failure->reason.find("agent vanished while sending"), std::string::npos);
}

}  // namespace
}  // namespace skein
