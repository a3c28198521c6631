// A publisher on an in-process bus, against an ingest played by the test.
#include "node/publisher.h"

#include <gtest/gtest.h>

#include <new>
#include <set>

#include "core/clock.h"
#include "core/file.h"
#include "core/hash.h"
#include "testing/test_folder.h"
#include "testing/test_node.h"

namespace skein::publisher_test {

constexpr double kDeadlineS = 20;

class PublisherTest : public testing::Test {
 protected:
  PublisherTest() {
    options_.agent = "alice";
    bus_.Subscribe<image_offer_t>(kImageOfferChannel,
                                  [this](const image_offer_t& offer) { OnOffer(offer); });
  }

  void Start() {
    publisher_ = std::make_unique<Publisher>(
        agent_, options_, [this](const PublishedPhoto& photo) { published_.push_back(photo); });
  }
  PhotoToOffer Photo(const std::string& name) {
    EXPECT_TRUE(WriteFileAtomic((folder_ / name).string(), BytesOf(name)).ok());
    return Existing(name);
  }
  PhotoToOffer Existing(const std::string& name) {
    PhotoToOffer photo;
    photo.name = name;
    photo.read = [path = (folder_ / name).string()] { return ReadFile(path); };
    return photo;
  }
  std::vector<PhotoToOffer> Photos(int count) {
    std::vector<PhotoToOffer> photos;
    for (int i = 0; i < count; ++i) photos.push_back(Photo(std::to_string(i) + ".jpg"));
    return photos;
  }
  static Bytes BytesOf(const std::string& name) { return Bytes(name.begin(), name.end()); }

  void OnOffer(const image_offer_t& offer) {
    offers_.push_back(offer);
    open_.insert(offer.name);
    most_open_ = std::max(most_open_, open_.size());
    if (on_offer_) on_offer_(offer);
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
    if (status != image_ack_t::WAIT) open_.erase(offer.name);
    ingest_.Publish(kImageAckChannel, ack);
  }
  bool RunUntilDone() {
    return loop_.RunUntil([this] { return publisher_->done(); }, kDeadlineS);
  }

  TestFolder folder_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node ingest_{TestOptions("ingest"), loop_, bus_};
  Node agent_{TestOptions(AgentInstance("alice")), loop_, bus_};
  PublisherOptions options_;
  std::vector<PublishedPhoto> published_;
  std::vector<image_offer_t> offers_;
  std::set<std::string> open_;  // offered and not decided
  size_t most_open_ = 0;
  std::function<void(const image_offer_t&)> on_offer_;
  std::unique_ptr<Publisher> publisher_;
};

TEST_F(PublisherTest, OffersEachPhotoWithItsSizeAndHashAndServesItsBytes) {
  std::optional<Bytes> pulled;
  on_offer_ = [&](const image_offer_t& offer) {
    ingest_.blobs().Fetch(offer.blob_id, offer.owner, [&, offer](Result<Bytes> bytes) {
      pulled = *bytes;
      Ack(offer, image_ack_t::STORED);
    });
  };
  Start();
  publisher_->Add({Photo("a.jpg")});
  ASSERT_TRUE(RunUntilDone());
  const Bytes bytes = BytesOf("a.jpg");
  EXPECT_EQ(offers_[0].agent, "alice");
  EXPECT_EQ(offers_[0].name, "a.jpg");
  EXPECT_EQ(offers_[0].size_bytes, static_cast<int64_t>(bytes.size()));
  EXPECT_EQ(offers_[0].blob_id, HashBytes(bytes.data(), bytes.size()));
  EXPECT_EQ(pulled, bytes);
  ASSERT_EQ(published_.size(), 1u);
  EXPECT_EQ(published_[0].status, +image_ack_t::STORED);
}

TEST_F(PublisherTest, OffersWhatExifMayLack) {
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  Start();
  PhotoToOffer photo = Photo("a.jpg");
  photo.capture_utime_us = 1'800'000'000'000'000;
  photo.has_gps = true;
  photo.latitude_deg = 47.5;
  photo.longitude_deg = -8.25;
  photo.altitude_m = 430;
  PhotoToOffer flat = photo;
  flat.name = "c.jpg";
  flat.altitude_m.reset();
  publisher_->Add({photo, Photo("b.jpg"), flat});
  ASSERT_TRUE(RunUntilDone());
  ASSERT_EQ(offers_.size(), 3u);
  EXPECT_EQ(offers_[0].capture_utime_us, photo.capture_utime_us);
  EXPECT_TRUE(offers_[0].has_gps);
  EXPECT_EQ(offers_[0].latitude_deg, 47.5);
  EXPECT_EQ(offers_[0].longitude_deg, -8.25);
  EXPECT_TRUE(offers_[0].has_altitude);
  EXPECT_EQ(offers_[0].altitude_m, 430);
  EXPECT_FALSE(offers_[1].has_gps || offers_[1].has_altitude);
  EXPECT_TRUE(offers_[2].has_gps);
  EXPECT_FALSE(offers_[2].has_altitude);
}

TEST_F(PublisherTest, TellsWhatBecameOfEachPhoto) {
  on_offer_ = [&](const image_offer_t& offer) {
    if (offer.name == "0.jpg") return Ack(offer, image_ack_t::STORED);
    if (offer.name == "1.jpg") return Ack(offer, image_ack_t::DUPLICATE);
    Ack(offer, image_ack_t::REFUSED, "no JPEG", failure_t::UNREADABLE);
  };
  Start();
  publisher_->Add(Photos(3));
  ASSERT_TRUE(RunUntilDone());
  std::map<std::string, PublishedPhoto> by_name;
  for (const PublishedPhoto& photo : published_) by_name[photo.name] = photo;
  ASSERT_EQ(published_.size(), 3u);
  EXPECT_EQ(by_name["0.jpg"].status, +image_ack_t::STORED);
  EXPECT_EQ(by_name["1.jpg"].status, +image_ack_t::DUPLICATE);
  EXPECT_EQ(by_name["2.jpg"].status, +image_ack_t::REFUSED);
  EXPECT_EQ(by_name["2.jpg"].reason, "no JPEG");
  EXPECT_EQ(by_name["2.jpg"].cause, +failure_t::UNREADABLE);
}

TEST_F(PublisherTest, RepeatsAnOfferUntilItIsDecided) {
  on_offer_ = [&](const image_offer_t& offer) {
    if (offers_.size() == 2) Ack(offer, image_ack_t::WAIT, "disk is full");
    if (offers_.size() == 4) Ack(offer, image_ack_t::STORED);
  };
  Start();
  publisher_->Add({Photo("a.jpg")});
  ASSERT_TRUE(
      loop_.RunUntil([&] { return publisher_->wait_reason() == "disk is full"; }, kDeadlineS));
  EXPECT_FALSE(publisher_->done());
  ASSERT_TRUE(RunUntilDone());
  EXPECT_EQ(offers_.size(), 4u);
  EXPECT_EQ(publisher_->wait_reason(), "");
}

TEST_F(PublisherTest, IgnoresAnswersToOthers) {
  on_offer_ = [&](const image_offer_t& offer) {
    image_offer_t other = offer;
    other.agent = "bob";
    Ack(other, image_ack_t::REFUSED);
    other = offer;
    other.blob_id = HashBytes("x", 1);
    Ack(other, image_ack_t::REFUSED);
    other = offer;
    other.name = "b.jpg";
    Ack(other, image_ack_t::REFUSED);
    if (offers_.size() == 2) Ack(offer, image_ack_t::STORED);
  };
  Start();
  publisher_->Add({Photo("a.jpg")});
  ASSERT_TRUE(RunUntilDone());
  ASSERT_EQ(published_.size(), 1u);
  EXPECT_EQ(published_[0].status, +image_ack_t::STORED);
}

TEST_F(PublisherTest, OffersNoMorePhotosAtATimeThanItsWindow) {
  Start();
  publisher_->Add(Photos(10));
  ASSERT_TRUE(loop_.RunUntil([&] { return offers_.size() >= 16; }, kDeadlineS));
  EXPECT_EQ(most_open_, 4u) << "a silent ingest gets repeats, no more photos";
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  ASSERT_TRUE(RunUntilDone());
  EXPECT_EQ(published_.size(), 10u);
  EXPECT_EQ(most_open_, 4u);
}

TEST_F(PublisherTest, KeepsItsRate) {
  options_.rate_hz = 20;
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  Start();
  const double start_s = MonotonicS();
  publisher_->Add(Photos(11));
  ASSERT_TRUE(RunUntilDone());
  EXPECT_GE(MonotonicS() - start_s, 9 / options_.rate_hz);
  EXPECT_EQ(published_.size(), 11u);
}

TEST_F(PublisherTest, TellsOfAFileThatCannotBeReadAndGoesOn) {
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  Start();
  publisher_->Add({Existing("gone.jpg"), Photo("a.jpg")});
  ASSERT_TRUE(RunUntilDone());
  ASSERT_EQ(published_.size(), 2u);
  EXPECT_EQ(published_[0].name, "gone.jpg");
  EXPECT_EQ(published_[0].status, +image_ack_t::REFUSED);
  EXPECT_NE(published_[0].reason, "");
  EXPECT_EQ(published_[1].status, +image_ack_t::STORED);
}

TEST_F(PublisherTest, TellsOfAFileWhoseReadingThrowsAndGoesOn) {
  on_offer_ = [&](const image_offer_t& offer) { Ack(offer, image_ack_t::STORED); };
  Start();
  PhotoToOffer throwing = Photo("a.jpg");
  throwing.read = []() -> Result<Bytes> { throw std::bad_alloc(); };
  publisher_->Add({throwing, Photo("b.jpg")});
  ASSERT_TRUE(RunUntilDone());
  ASSERT_EQ(published_.size(), 2u);
  EXPECT_EQ(published_[0].name, "a.jpg");
  EXPECT_EQ(published_[0].reason, std::bad_alloc().what());
  EXPECT_EQ(published_[1].status, +image_ack_t::STORED);
}

TEST_F(PublisherTest, SecondOfTwoPhotosOfOneNameWaitsForTheFirst) {
  on_offer_ = [&](const image_offer_t& offer) {
    if (offers_.size() >= 2) Ack(offer, image_ack_t::STORED);
  };
  Start();
  publisher_->Add({Photo("a.jpg"), Photo("a.jpg")});
  ASSERT_TRUE(RunUntilDone());
  EXPECT_EQ(published_.size(), 2u);
}

TEST(AgentInstance, IsTheSameForANameAndFitForAChannel) {
  EXPECT_EQ(AgentInstance("alice"), AgentInstance("alice"));
  EXPECT_NE(AgentInstance("a b"), AgentInstance("a.b"));
  const std::string longest(64, 'x');
  EXPECT_NE(AgentInstance(longest + "1"), AgentInstance(longest + "2"));
  for (const std::string& agent : {std::string("alice"), longest, std::string("\xc3\xa9/..")}) {
    const std::string instance = AgentInstance(agent);
    EXPECT_LE(instance.size(), 64u);
    EXPECT_EQ(instance.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-"),
              std::string::npos)
        << instance;
  }
}

}  // namespace skein::publisher_test
