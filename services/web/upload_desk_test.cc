// Uploads of phones on an in-process bus, against an ingest played by the test.
#include "web/upload_desk.h"

#include <gtest/gtest.h>

#include <functional>
#include <future>
#include <set>
#include <utility>
#include <vector>

#include "core/folder.h"
#include "core/hash.h"
#include "http/job_pool.h"
#include "testing/test_folder.h"
#include "testing/test_node.h"

namespace skein::upload_desk_test {

constexpr double kDeadlineS = 20;

class UploadDeskTest : public testing::Test {
 protected:
  UploadDeskTest() {
    OpenStore();
    bus_.Subscribe<image_offer_t>(kImageOfferChannel, [this](const image_offer_t& offer) {
      offers_.push_back(offer);
      if (on_offer_) on_offer_(offer);
    });
  }

  std::string Upload(const std::string& agent, const std::string& name, const std::string& text) {
    const Bytes bytes(text.begin(), text.end());
    const std::string blob_id = HashBytes(bytes.data(), bytes.size());
    UploadInfo info;
    info.name = name;
    info.size_bytes = static_cast<int64_t>(bytes.size());
    info.has_gps = true;
    info.latitude_deg = 47.5;
    auto receiver = store_->Begin(agent, blob_id, info, 0);
    // What came before may still be on its way out of the folder: a phone asks again.
    EXPECT_TRUE(RunUntil([&] {
      if (!receiver.ok()) receiver = store_->Begin(agent, blob_id, info, 0);
      return receiver.ok();
    })) << receiver.error();
    EXPECT_TRUE(store_->Take(*receiver, bytes).ok());
    EXPECT_TRUE(store_->Finish(*receiver).ok());
    return blob_id;
  }
  void Ack(const image_offer_t& offer, int8_t status, const std::string& reason = "",
           int8_t cause = failure_t::OTHER) {
    image_ack_t ack{};
    ack.agent = offer.agent;
    ack.name = offer.name;
    ack.blob_id = offer.blob_id;
    ack.status = status;
    ack.cause = cause;
    ack.reason = reason;
    ingest_.Publish(kImageAckChannel, ack);
  }
  bool RunUntil(const std::function<bool()>& done) { return loop_.RunUntil(done, kDeadlineS); }
  void OpenStore() {
    store_ = std::make_unique<UploadStore>(
        folder_ / "uploads", UploadLimits(),
        [this](std::function<void()> job) { jobs_.Run(std::move(job)); });
  }
  bool IsInLedger(const std::string& blob_id) const {
    return knows_all_ || known_.count(blob_id) > 0;
  }
  size_t NumFiles() const { return FilesUnder(folder_ / "uploads").size(); }

  TestFolder folder_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_{TestOptions("ingest"), loop_, bus_};
  Node web_{TestOptions("web"), loop_, bus_};
  std::unique_ptr<UploadStore> store_;
  JobPool jobs_{1};
  bool knows_all_ = true;
  std::set<std::string> known_;  // blobs of photos in the ledger
  std::vector<image_offer_t> offers_;
  std::function<void(const image_offer_t&)> on_offer_;
};

TEST_F(UploadDeskTest, OffersEachAgentsPhotosAndForgetsWhatIsStored) {
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  const std::string first = Upload("anna", "a.jpg", "one");
  const std::string second = Upload("bert", "a.jpg", "two");
  ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty(); }));
  ASSERT_EQ(offers_.size(), 2u);
  for (const image_offer_t& offer : offers_) {
    EXPECT_EQ(offer.blob_id, offer.agent == "anna" ? first : second);
    EXPECT_EQ(offer.name, "a.jpg");
    EXPECT_EQ(offer.owner, "web");
    EXPECT_TRUE(offer.has_gps);
    EXPECT_EQ(offer.latitude_deg, 47.5);
  }
  EXPECT_EQ(store_->bytes(), 0);
}

TEST_F(UploadDeskTest, GoesOnWhileADeleteHangs) {
  std::promise<void> go_on;
  jobs_.Run([&] { go_on.get_future().wait(); });
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  for (const std::string text : {"one", "two"}) {
    Upload("anna", text + ".jpg", text);
    ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty(); }));
  }
  EXPECT_EQ(NumFiles(), 4u);
  go_on.set_value();
  EXPECT_TRUE(RunUntil([&] { return NumFiles() == 0; }));
}

TEST_F(UploadDeskTest, OffersAgainWhatNobodyDecidedBeforeItDied) {
  {
    UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
    Upload("anna", "a.jpg", "one");
    ASSERT_TRUE(RunUntil([&] { return !offers_.empty(); }));
  }
  OpenStore();
  offers_.clear();
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::DUPLICATE); };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty(); }));
  EXPECT_EQ(offers_.front().name, "a.jpg");
}

// Recorded and sent again, or by a phone that has forgotten: ingest knows the content.
TEST_F(UploadDeskTest, APhotoThatComesAgainIsOfferedAgainAndForgotten) {
  on_offer_ = [&](const image_offer_t& offer) {
    Ack(offer, offers_.size() == 1 ? image_ack_t::STORED : image_ack_t::DUPLICATE);
  };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  for (const size_t time : {1, 2, 3}) {
    const std::string id = Upload("anna", "a.jpg", "one");
    ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty() && NumFiles() == 0; }));
    EXPECT_EQ(offers_.size(), time);
    EXPECT_FALSE(store_->Look("anna", id));
  }
  EXPECT_EQ(store_->bytes(), 0);
}

// The acknowledgement and the fact come by different ways.
TEST_F(UploadDeskTest, KeepsWhatIsAcknowledgedUntilTheLedgerIsKnownToHaveIt) {
  knows_all_ = false;
  int num_acks = 0;
  on_offer_ = [&](const image_offer_t& offer) {
    Ack(offer, ++num_acks == 1 ? image_ack_t::STORED : image_ack_t::DUPLICATE);
  };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  const std::string first = Upload("anna", "a.jpg", "one");
  const std::string second = Upload("bert", "b.jpg", "two");
  ASSERT_TRUE(RunUntil([&] { return num_acks == 2 && desk.num_offered() == 0; }));
  EXPECT_TRUE(store_->ProgressOf("anna").at(first).is_stored);
  known_ = {second};
  ASSERT_TRUE(RunUntil([&] { return store_->Waiting().size() == 1; }));
  EXPECT_TRUE(store_->ProgressOf("anna").at(first).is_stored);
  known_.insert(first);
  ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty(); }));
  EXPECT_EQ(offers_.size(), 2u) << "none is offered again";
}

TEST_F(UploadDeskTest, TellsWhyPhotosWaitAndDropsThoseThatAreRefused) {
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::WAIT, "disk is full"); };
  UploadDesk desk(web_, *store_, [this](const std::string& id) { return IsInLedger(id); });
  Upload("anna", "a.jpg", "one");
  ASSERT_TRUE(RunUntil([&] { return store_->WaitReason("anna") == "disk is full"; }));
  EXPECT_EQ(store_->Waiting().size(), 1u);
  on_offer_ = [&](const image_offer_t& offer) {
    Ack(offer, image_ack_t::REFUSED, "no JPEG", failure_t::UNREADABLE);
  };
  ASSERT_TRUE(RunUntil([&] { return store_->Waiting().empty(); }));
  ASSERT_EQ(store_->Refusals("anna").size(), 1u);
  EXPECT_EQ(store_->Refusals("anna").begin()->second.reason, "no JPEG");
  EXPECT_EQ(store_->Refusals("anna").begin()->second.cause, +failure_t::UNREADABLE);
}

}  // namespace skein::upload_desk_test
