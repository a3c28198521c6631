#include "ingest/finish_driver.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <new>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/hash.h"
#include "node/work_client.h"
#include "testing/test_ingest.h"
#include "testing/test_node.h"
#include "testing/test_photos.h"

namespace skein::finish_driver_test {

class FinishDriverTest : public IngestServiceTest {
 protected:
  FinishDriverTest() {
    bus_.Subscribe<command_reply_t>(
        kCommandReplyChannel, [this](const command_reply_t& reply) { replies_.push_back(reply); });
  }
  // Leases as many submaps as are given to `mapper_`.
  void LeaseSubmaps(int num_submaps) {
    int num_leased = 0;
    mapper_ = std::make_unique<WorkClient>(*peer_, "submap", num_submaps,
                                           [&num_leased](const work_t&) { ++num_leased; });
    Await([&] { return num_leased == num_submaps; }, "the submaps");
  }
  // The submap of photos 1 and 2, leased to `mapper_`.
  void AddSubmap() {
    for (const uint8_t id : {1, 2}) AddMatchedPhoto(id);
    EXPECT_EQ(Submit(Seed(1, 2)), "");
    LeaseSubmaps(1);
    for (const int64_t id : {1, 2}) EXPECT_EQ(Submit(Registration(id, 1, 1)), "");
  }
  // In the merger's place, of a finish that is DRAINED.
  void Settle() {
    finish_t settled{};
    settled.header.fact_id = "finish/settled";
    settled.state = finish_t::SETTLED;
    settled.finish_id = Finished(finish_t::DRAINED)->finish_id;
    EXPECT_EQ(Submit(settled), "");
  }
  void FinishUpToSettled(int64_t command_id) {
    AskToFinish(command_id);
    Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
    Settle();
  }
  nlohmann::json Report() const { return nlohmann::json::parse(std::ifstream(Paths().Report())); }
  const command_reply_t* ReplyTo(int64_t command_id) const {
    for (const command_reply_t& reply : replies_) {
      if (reply.command_id == command_id) return &reply;
    }
    return nullptr;
  }
  void AwaitReplyTo(int64_t command_id) {
    Await([&] { return ReplyTo(command_id) != nullptr; }, "the reply");
  }
  int CountFinishFacts(int8_t state) const {
    return static_cast<int>(std::count_if(facts_.begin(), facts_.end(), [&](const Fact& fact) {
      const auto* finish = std::get_if<finish_t>(&fact);
      return finish != nullptr && finish->state == state;
    }));
  }

  std::unique_ptr<WorkClient> mapper_;
  std::vector<command_reply_t> replies_;
};

TEST_F(FinishDriverTest, ResultsOnWhichAnExceptionComesAreWrittenAgain) {
  Publish("a.jpg", {1, 2, 3});
  std::atomic<int> num_begun{0};
  ingest_->steps().OnBegin([&](const Step& step) {
    if (step.name == "results" && ++num_begun == 1) throw std::bad_alloc();
  });
  FinishUpToSettled(5);
  AwaitReplyTo(5);
  EXPECT_TRUE(ReplyTo(5)->ok);
  EXPECT_EQ(num_begun, 2);
}

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
  Settle();
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq() - 1)), "") << "too old, waits on";
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq())), "");
  Await([&] { return !replies.empty(); }, "the reply");
  EXPECT_EQ(replies[0].command_id, 77);
  EXPECT_EQ(replies[0].text,
            "2 of 3 photos placed, 1 model in sparse/; `skein status` and report.json tell of the "
            "others");
  EXPECT_EQ(*ReadFile((Paths().Sparse() / "0" / "images.bin").string()), (Bytes{2, 2}));
  EXPECT_FALSE(std::filesystem::exists(Paths().Sparse() / "0" / "side.bin"));
  const auto report = nlohmann::json::parse(std::ifstream(Paths().Report()));
  EXPECT_TRUE(report["submaps"][0]["check"].is_null()) << "the mapper has not checked it";
  EXPECT_EQ(report["images"]["received"], 3);
  EXPECT_EQ(report["images"]["registered"], 2);
  EXPECT_EQ(report["images"]["failed"], 1);
  EXPECT_EQ(report["failures"][0]["image"], "alice/bad.jpg");
  EXPECT_EQ(report["images_in_time"].size(), 2u);
  EXPECT_EQ(report["submaps"][0]["images"], 2);
  EXPECT_NE(report["submaps"][0]["completeness"]["reason"], "") << "the mapper tells nothing";
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
  FinishUpToSettled(77);
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq())), "");
  Await([&] { return Finished(finish_t::DONE) != nullptr; }, "DONE");
  const auto report = nlohmann::json::parse(std::ifstream(Paths().Report()));
  EXPECT_EQ(report["images"]["registered"], 0);
  EXPECT_EQ(report["images"]["deferred"], 3);
  EXPECT_TRUE(report["submaps"].empty());
  EXPECT_FALSE(std::filesystem::exists(Paths().Sparse() / "0"));
}

// A bent map of a video could not merge with a fragment of four photos. Mapped again in the finish,
// it took these photos, and the fragment was delivered beside it.
TEST_F(FinishDriverTest, AMapWhosePhotosAreAllInALargerOneIsNoModelOfItsOwn) {
  for (const uint8_t id : {1, 2, 3, 4, 5, 6, 7}) AddMatchedPhoto(id);
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  EXPECT_EQ(Submit(Seed(3, 4)), "");
  EXPECT_EQ(Submit(Seed(5, 6)), "");
  LeaseSubmaps(3);
  for (const int64_t id : {1, 2, 3, 4, 5}) EXPECT_EQ(Submit(Registration(id, 1, 1)), "");
  for (const int64_t id : {3, 4, 5}) EXPECT_EQ(Submit(Registration(id, 2, 1)), "");
  for (const int64_t id : {5, 6, 7}) EXPECT_EQ(Submit(Registration(id, 3, 1)), "");
  FinishUpToSettled(77);
  for (const int64_t submap_id : {1, 2, 3}) {
    EXPECT_EQ(Submit(FinalModel(submap_id, 1, follower_->processed_seq())), "");
  }
  AwaitReplyTo(77);
  const auto* end = Find<submap_end_t>([](const submap_end_t&) { return true; });
  ASSERT_NE(end, nullptr);
  EXPECT_EQ(end->submap_id, 2);
  EXPECT_EQ(end->reason, "map 1 holds all its photos");
  EXPECT_EQ(ReplyTo(77)->text, "7 of 7 photos placed, 2 models in sparse/");
  EXPECT_EQ(Report()["submaps"].size(), 2u);
}

TEST_F(FinishDriverTest, CopiesHowCompleteThePlaceIsAndWhereItLies) {
  AddSubmap();
  FinishUpToSettled(77);
  submap_model_t model = FinalModel(1, 1, follower_->processed_seq());
  model.place.num_photos = 12;
  model.place.good_share = 0.75F;
  model.place.sentence = "75 % of the surface is good, 3 open borders: keep going";
  model.georeference.reason = "0 registered photos carry a position; it takes 5";
  EXPECT_EQ(Submit(model), "");
  AwaitReplyTo(77);
  const nlohmann::json submap = Report()["submaps"][0];
  EXPECT_EQ(submap["completeness"]["photos"], 12);
  EXPECT_EQ(submap["completeness"]["good_share"], 0.75F);
  EXPECT_EQ(submap["completeness"]["sentence"], model.place.sentence);
  EXPECT_EQ(submap["georeference"]["reason"], model.georeference.reason);
  EXPECT_EQ(ReplyTo(77)->text,
            "2 of 2 photos placed, 1 model in sparse/\nmap 1: " + model.place.sentence);
}

TEST_F(FinishDriverTest, EndsASubmapWhoseModelCannotBeReadAndIsDoneWithoutIt) {
  AddSubmap();
  FinishUpToSettled(77);
  submap_model_t model = FinalModel(1, 1, follower_->processed_seq());
  model.model_blob = peer_->blobs().Offer({'r', 'u', 'b', 'b', 'i', 's', 'h'});
  EXPECT_EQ(Submit(model), "");
  AwaitReplyTo(77);
  EXPECT_EQ(ReplyTo(77)->text,
            "0 of 2 photos placed, 0 models in sparse/; `skein status` and report.json tell of "
            "the others");
  const auto* end = Find<submap_end_t>([](const submap_end_t&) { return true; });
  ASSERT_NE(end, nullptr);
  EXPECT_NE(end->reason.find("SKMA"), std::string::npos) << end->reason;
  EXPECT_EQ(Report()["images"]["deferred"], 2);
  Restart();
  AskToFinish(78);
  Await([&] { return CountFinishFacts(finish_t::DRAINED) == 2; }, "the next finish");
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

TEST_F(FinishDriverTest, RefusesWhatIsNoPositiveNumberOfSeconds) {
  int64_t command_id = 100;
  for (const std::string within_s : {"0", "-3", "nan", "inf", "1e99", "5 s", "soon", " 5"}) {
    AskToFinish(++command_id, within_s);
    AwaitReplyTo(command_id);
    EXPECT_FALSE(ReplyTo(command_id)->ok) << within_s;
    EXPECT_NE(ReplyTo(command_id)->text.find("'" + within_s + "'"), std::string::npos);
  }
  EXPECT_EQ(CountFinishFacts(finish_t::REQUESTED), 0);
}

TEST_F(FinishDriverTest, LeavesOutAtTheDeadlineWhatIsInWork) {
  options_.finish.min_model_size = 2;
  Restart();
  AddSubmap();
  EXPECT_EQ(Publish("3.jpg", SmallJpeg(3)).image_id, 3);
  AskToFinish(77, "0.3");
  Await([&] { return Finished(finish_t::SETTLED) != nullptr; }, "SETTLED");
  ASSERT_NE(Finished(finish_t::CUT), nullptr);
  EXPECT_GE(Finished(finish_t::CUT)->header.utime_us,
            Finished(finish_t::REQUESTED)->deadline_utime_us);
  EXPECT_EQ(Submit(FinalModel(1, 1, follower_->processed_seq())), "");
  AwaitReplyTo(77);
  EXPECT_TRUE(ReplyTo(77)->ok);
  EXPECT_NE(ReplyTo(77)->text.find("2 of 3 photos placed, 1 model in sparse/; cut after"),
            std::string::npos);
  EXPECT_NE(ReplyTo(77)->text.find("1 photo not matched in time (alice/3.jpg)"), std::string::npos);
  EXPECT_EQ(Report()["cut"]["not_matched"], nlohmann::json({"alice/3.jpg"}));
  EXPECT_EQ(Report()["cut"]["during"], "matching");
  // The photo is there, and goes on.
  EXPECT_EQ(Submit(Features(3)), "");
  EXPECT_EQ(Submit(Candidates(3)), "");
  EXPECT_EQ(Submit(Matches(3)), "");
}

TEST_F(FinishDriverTest, AFinishThatIsReadyInTimeIsNotCut) {
  AddMatchedPhoto(1);
  AskToFinish(77, "1000");
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  Settle();
  AwaitReplyTo(77);
  EXPECT_EQ(Finished(finish_t::CUT), nullptr);
  EXPECT_FALSE(Report().contains("cut"));
}

TEST_F(FinishDriverTest, AFurtherCommandMaySetAnEarlierDeadlineWhichOutlivesARestart) {
  EXPECT_EQ(Publish("1.jpg", SmallJpeg(1)).image_id, 1);
  AskToFinish(1);
  Await([&] { return Finished(finish_t::REQUESTED) != nullptr; }, "REQUESTED");
  AskToFinish(2, "1000");
  Await([&] { return CountFinishFacts(finish_t::DEADLINE) == 1; }, "a deadline");
  AskToFinish(3, "2000");
  AskToFinish(4, "2");
  Await([&] { return CountFinishFacts(finish_t::DEADLINE) == 3; }, "an earlier deadline");
  std::vector<int64_t> deadlines_us;
  for (const Fact& fact : facts_) {
    const auto* finish = std::get_if<finish_t>(&fact);
    if (finish == nullptr || finish->state != finish_t::DEADLINE) continue;
    deadlines_us.push_back(finish->deadline_utime_us);
  }
  EXPECT_EQ(deadlines_us[1], deadlines_us[0]) << "a later deadline changes nothing";
  EXPECT_LT(deadlines_us[2], deadlines_us[0]);
  Restart();
  AwaitReplyTo(4);
  for (const int64_t command_id : {1, 2, 3, 4}) {
    ASSERT_NE(ReplyTo(command_id), nullptr) << command_id;
    EXPECT_TRUE(ReplyTo(command_id)->ok);
  }
  EXPECT_EQ(CountFinishFacts(finish_t::CUT), 1);
  EXPECT_EQ(Report()["cut"]["not_matched"], nlohmann::json({"alice/1.jpg"}));
}

// Recorded and sent again, or repeated by who lost the reply.
TEST_F(FinishDriverTest, ACommandThatComesAgainBeginsNoFurtherFinish) {
  AddMatchedPhoto(1);
  AskToFinish(77);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  AskToFinish(78);
  Await([&] { return CountFinishFacts(finish_t::DEADLINE) == 1; }, "the second command");
  EXPECT_EQ(Finished(finish_t::DEADLINE)->deadline_utime_us, 0);
  for (const int64_t command_id : {77, 78}) AskToFinish(command_id);
  Settle();
  for (const int64_t command_id : {77, 78}) AwaitReplyTo(command_id);
  Restart();
  replies_.clear();
  for (const int64_t command_id : {77, 78}) {
    AskToFinish(command_id);
    AwaitReplyTo(command_id);
    EXPECT_TRUE(ReplyTo(command_id)->ok);
  }
  EXPECT_EQ(CountFinishFacts(finish_t::REQUESTED), 1);
  EXPECT_EQ(CountFinishFacts(finish_t::DEADLINE), 1);
}

TEST_F(FinishDriverTest, TakesTheNewestModelOfAMapperThatIsSilent) {
  options_.finish = {2, 0.3};
  Restart();
  AddSubmap();
  submap_model_t checkpoint = FinalModel(1, 1, follower_->processed_seq());
  checkpoint.kind = submap_model_t::CHECKPOINT;
  EXPECT_EQ(Submit(checkpoint), "");
  AskToFinish(77, "0.1");
  AwaitReplyTo(77);
  EXPECT_EQ(*ReadFile((Paths().Sparse() / "0" / "images.bin").string()), (Bytes{2, 2}));
  EXPECT_NE(ReplyTo(77)->text.find("map 1: its mapper did not answer"), std::string::npos);
  EXPECT_EQ(Report()["cut"]["submaps"][0]["id"], 1);
  EXPECT_EQ(Report()["submaps"][0]["completeness"]["reason"],
            "the model is a checkpoint: its mapper did not finish it");
}

TEST_F(FinishDriverTest, IsDoneWithoutASubmapThatHasNoModelYet) {
  options_.finish = {2, 0.3};
  Restart();
  AddSubmap();
  AskToFinish(77, "0.1");
  AwaitReplyTo(77);
  EXPECT_NE(ReplyTo(77)->text.find(", 0 models in sparse/; cut"), std::string::npos);
  EXPECT_EQ(Report()["cut"]["submaps"][0]["left_out"], "no model yet");
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
  EXPECT_EQ(failure->cause, +failure_t::VANISHED);
  EXPECT_NE(failure->reason.find("agent vanished while sending"), std::string::npos);
}

// The driver alone, at times that the test gives.
class FinishDriverTimesTest : public testing::Test {
 protected:
  template <class T>
  T Commit(T fact, const std::string& fact_id) {
    fact.header.fact_id = fact_id;
    fact.header.author = "ingest";
    const Fact staged = writer_.Stage(fact);
    writer_.Flush();
    return std::get<T>(staged);
  }
  void StepAt(double now_s) {
    driver_.Step(now_s);
    writer_.Flush();
  }
  void Request(int64_t command_id) {
    command_t command{};
    command.command_id = command_id;
    command.verb = "finish";
    driver_.OnCommand(command);
    writer_.Flush();
  }
  // Of a session without submaps.
  void FinishAt(double now_s) {
    Request(1);
    StepAt(now_s);
    finish_t settled{};
    settled.state = finish_t::SETTLED;
    settled.finish_id = writer_.state().finish().finish_id;
    Commit(settled, "finish/settled");
    StepAt(now_s);
    ASSERT_TRUE(loop_.RunUntil([&] { return writer_.has_staged(); }, 20)) << "DONE";
    writer_.Flush();
    ASSERT_FALSE(writer_.state().finishing());
  }

  TestFolder folder_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node node_{TestOptions("ingest"), loop_, bus_};
  LedgerWriter writer_{*Ledger::Open(folder_ / "ledger.db"), "session", NowUs};
  bool has_idle_mapper_ = false;
  FinishDriver driver_{node_,
                       writer_,
                       SessionPaths{folder_.path()},
                       {},
                       {[] { return 0; }, [] { return 0; }, [this] { return has_idle_mapper_; }}};
};

TEST_F(FinishDriverTimesTest, InEachFinishASeedHasItsTimeToFindAMapper) {
  FinishAt(100);
  seed_t seed{};
  seed.image_id1 = 1;
  seed.image_id2 = 2;
  const int64_t submap_id = Commit(seed, "seed").submap_id;
  const auto has_ended = [&] { return writer_.state().FindSubmap(submap_id)->ended; };
  Request(2);
  StepAt(1000);
  StepAt(1029);
  EXPECT_FALSE(has_ended());
  has_idle_mapper_ = true;
  StepAt(1031);
  has_idle_mapper_ = false;
  StepAt(1032);
  StepAt(1061);
  EXPECT_FALSE(has_ended()) << "a mapper was free meanwhile";
  StepAt(1062);
  EXPECT_TRUE(has_ended());
}

}  // namespace skein::finish_driver_test
