#include "ingest/photo_intake.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <new>
#include <set>

#include "core/attempt.h"
#include "core/file.h"
#include "core/hash.h"
#include "testing/test_decoder.h"
#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein::photo_intake_test {

using PhotoIntakeTest = IngestServiceTest;

TEST_F(PhotoIntakeTest, StoresAPhotoDurablyAndTellsEveryone) {
  const Bytes photo = SmallJpeg();
  const image_ack_t ack = Publish("left/a.jpg", photo);
  EXPECT_EQ(ack.status, +image_ack_t::STORED) << ack.reason;
  EXPECT_EQ(ack.image_id, 1);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "left/a.jpg").string()), photo);
  EXPECT_EQ(*BlobStore(Paths().Blobs()).Get(ack.blob_id), photo);
  Await([&] { return !facts_.empty(); }, "the fact");
  const auto& image = std::get<image_t>(facts_[0]);
  EXPECT_EQ(image.width_px, 96);
  EXPECT_EQ(image.camera_id, 1);
  EXPECT_EQ(image.focal_px, 1.2 * 96);
  EXPECT_GT(image.header.utime_us, image.received_utime_us);
}

TEST_F(PhotoIntakeTest, AnswersARepeatedOfferAlikeAlsoAfterARestart) {
  const image_offer_t good = MakeOffer("a.jpg", SmallJpeg());
  const image_offer_t bad = MakeOffer("bad.jpg", {1, 2, 3});
  EXPECT_EQ(Decide(good).status, +image_ack_t::STORED);
  const std::string reason = Decide(bad).reason;
  Restart();
  EXPECT_EQ(Decide(good).status, +image_ack_t::STORED);
  EXPECT_EQ(Decide(good).image_id, 1);
  EXPECT_EQ(Decide(bad).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Decide(bad).reason, reason);
  EXPECT_EQ(Decide(bad).cause, +failure_t::UNREADABLE);
  Await([&] { return facts_.size() == 2; }, "both facts");
}

TEST_F(PhotoIntakeTest, APhotoThatEndsTheDecoderIsRefused) {
  const FaultyDecoder faulty("crash");
  options_.intake.decoder = faulty.options;
  Restart();
  for (const int seed : {1, 2}) {
    const image_ack_t ack = Publish("a.jpg", SmallJpeg(seed));
    EXPECT_EQ(ack.status, +image_ack_t::REFUSED);
    EXPECT_EQ(ack.reason, "the decoder ended by SIGSEGV");
  }
  options_.intake.decoder = DecoderOptions();
  Restart();
  EXPECT_EQ(Publish("b.jpg", SmallJpeg(3)).status, +image_ack_t::STORED);
}

class ThrowingIntakeTest : public PhotoIntakeTest {
 protected:
  // The first `num` photos that the worker takes throw.
  void ThrowFirst(int num) {
    ingest_->steps().OnBegin([this, num](const Step& step) {
      if (step.name == "photo" && ++num_taken_ <= num) throw std::bad_alloc();
    });
  }

  std::atomic<int> num_taken_{0};
};

TEST_F(ThrowingIntakeTest, APhotoThatThrowsTwiceIsStoredAtItsThirdOffer) {
  ThrowFirst(kMaxFailures - 1);
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  EXPECT_EQ(num_taken_, kMaxFailures);
}

TEST_F(ThrowingIntakeTest, APhotoThatThrowsThriceIsRefused) {
  ThrowFirst(kMaxFailures);
  const image_ack_t ack = Publish("a.jpg", SmallJpeg(1));
  EXPECT_EQ(ack.status, +image_ack_t::REFUSED);
  EXPECT_EQ(ack.reason, std::bad_alloc().what());
  EXPECT_EQ(Publish("b.jpg", SmallJpeg(2)).status, +image_ack_t::STORED);
}

TEST_F(PhotoIntakeTest, APhotoIsOfferedAgainWhenItsDecoderWasKilled) {
  const FaultyDecoder faulty("kill");
  options_.intake.decoder = faulty.options;
  Restart();
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  peer_->Publish(kImageOfferChannel, offer);
  const auto is_told = [&] {
    return std::any_of(acks_.begin(), acks_.end(), [](const image_ack_t& ack) {
      return ack.reason == "cannot check the photo: the decoder ended by SIGKILL";
    });
  };
  Await(is_told, "the reason");
  options_.intake.decoder = DecoderOptions();
  Restart();
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
}

TEST_F(PhotoIntakeTest, SlowPhotosOfOneAgentDelayOnlyItsOwn) {
  FaultyDecoder faulty("sleep");
  faulty.options.bounds.max_still_s = 1;
  options_.intake.decoder = faulty.options;
  Restart();
  for (int seed = 0; seed < 6; ++seed) {
    image_offer_t slow = MakeOffer(std::to_string(seed) + ".jpg", SmallJpeg(seed));
    slow.agent = "mallory";
    peer_->Publish(kImageOfferChannel, slow);
  }
  // All of them have come: nothing is asked for any more.
  Await([&] { return ingest_->blobs().bytes_pulled() > 0 && ingest_->blobs().num_fetching() == 0; },
        "the slow photos");
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg(9));
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  const auto num_refused = std::count_if(acks_.begin(), acks_.end(), [](const image_ack_t& ack) {
    return ack.agent == "mallory" && ack.status == image_ack_t::REFUSED;
  });
  EXPECT_LE(num_refused, 2);
}

TEST_F(PhotoIntakeTest, KnowsAContentThatIsThereAlready) {
  const Bytes photo = SmallJpeg();
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
  const image_ack_t copy = Publish("copy.jpg", photo);
  EXPECT_EQ(copy.status, +image_ack_t::DUPLICATE);
  EXPECT_EQ(copy.image_id, 1);
  Restart();
  EXPECT_EQ(Publish("copy.jpg", photo).status, +image_ack_t::DUPLICATE);
}

TEST_F(PhotoIntakeTest, KeepsBothOfTwoPhotosOfOneName) {
  const image_offer_t second = MakeOffer("a.jpg", SmallJpeg(2));
  EXPECT_EQ(Publish("a.jpg", SmallJpeg(1)).image_id, 1);
  EXPECT_EQ(Decide(second).image_id, 2);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "a~2.jpg").string()), SmallJpeg(2));
  Restart();
  EXPECT_EQ(Decide(second).status, +image_ack_t::STORED);
  EXPECT_EQ(Decide(second).image_id, 2);
}

TEST_F(PhotoIntakeTest, NamesAndContentsOfOffersThatComeAtOnceDoNotCollide) {
  const Bytes photo = SmallJpeg(1);
  image_offer_t copy = MakeOffer("copy.jpg", photo);
  copy.agent = "bob";
  const image_offer_t bad = MakeOffer("a.jpg", {1, 2, 3});
  const image_offer_t first = MakeOffer("a.jpg", photo);
  const image_offer_t second = MakeOffer("a.jpg", SmallJpeg(2));
  for (const image_offer_t& offer : {bad, first, second, copy}) {
    peer_->Publish(kImageOfferChannel, offer);
  }
  EXPECT_EQ(Decide(bad).status, +image_ack_t::REFUSED);
  const std::set<int64_t> ids = {Decide(first).image_id, Decide(second).image_id};
  EXPECT_EQ(ids, (std::set<int64_t>{1, 2})) << "a content that came twice is one photo";
  EXPECT_EQ(Decide(copy).image_id, Decide(first).image_id);
  Await([&] { return facts_.size() == 3; }, "two photos and a refusal");
  std::set<std::string> names;
  for (const Fact& fact : facts_) {
    const auto* image = std::get_if<image_t>(&fact);
    if (image != nullptr) names.insert(image->name);
  }
  // Whose pull ends first has the content, and the plain name is used up only by a stored photo.
  EXPECT_EQ(names.size(), 2u);
  EXPECT_EQ(names.count("a.jpg"), 1u);
  EXPECT_EQ(names.count("a~2.jpg") + names.count("copy.jpg"), 1u);
}

TEST_F(PhotoIntakeTest, APhotoIsTheAgentsWhoseBytesCame) {
  FaultyDecoder faulty("sleep");
  faulty.options.bounds.max_still_s = 1;
  options_.intake.decoder = faulty.options;
  Restart();
  const image_offer_t first = MakeOffer("1.jpg", SmallJpeg(1));
  const image_offer_t second = MakeOffer("2.jpg", SmallJpeg(2));
  for (const image_offer_t& offer : {first, second}) peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return ingest_->blobs().bytes_pulled() > 0 && ingest_->blobs().num_fetching() == 0; },
        "both photos");
  image_offer_t thief = second;  // whose bytes are in ingest's memory by now
  thief.agent = "bob";
  thief.owner = "gone";
  peer_->Publish(kImageOfferChannel, thief);
  std::string agent;
  Await(
      [&] {
        for (const image_ack_t& ack : acks_) {
          const bool is_decided = ack.status == image_ack_t::REFUSED;
          if (is_decided && ack.blob_id == second.blob_id && agent.empty()) agent = ack.agent;
        }
        return !agent.empty();
      },
      "a decision about the second photo");
  EXPECT_EQ(agent, "alice");
}

TEST_F(PhotoIntakeTest, SharesACameraAmongPhotosOfOneSize) {
  Publish("a.jpg", SmallJpeg(1));
  Publish("b.jpg", SmallJpeg(2));
  Publish("c.jpg", SmallJpeg(3, 80, 96));
  Restart();
  Publish("d.jpg", SmallJpeg(4));
  Await([&] { return facts_.size() == 4; }, "four photos");
  std::vector<int64_t> cameras;
  for (const Fact& fact : facts_) cameras.push_back(std::get<image_t>(fact).camera_id);
  EXPECT_EQ(cameras, (std::vector<int64_t>{1, 1, 2, 1}));
}

TEST_F(PhotoIntakeTest, TellsKnownIntrinsics) {
  KnownCamera known;
  known.agent = "ali*";
  known.width_px = 96;
  known.height_px = 80;
  known.camera_model = "SIMPLE_RADIAL";
  known.params = {100, 48, 40, 0.1};
  options_.intake.cameras = {known};
  Restart();
  Publish("a.jpg", SmallJpeg(1));
  Publish("other size.jpg", SmallJpeg(2, 80, 96));
  Await([&] { return facts_.size() == 2; }, "two photos");
  const auto& image = std::get<image_t>(facts_[0]);
  EXPECT_EQ(image.camera_model, "SIMPLE_RADIAL");
  EXPECT_EQ(image.camera_params, known.params);
  EXPECT_TRUE(image.camera_fixed);
  EXPECT_EQ(image.focal_px, 100);
  EXPECT_TRUE(image.focal_from_exif);
  EXPECT_EQ(std::get<image_t>(facts_[1]).camera_model, "");
  options_.intake.cameras[0].refine = true;
  Restart();
  Publish("b.jpg", SmallJpeg(3));
  Await([&] { return facts_.size() == 3; }, "the third photo");
  const auto& refined = std::get<image_t>(facts_[2]);
  EXPECT_FALSE(refined.camera_fixed);
  EXPECT_NE(refined.camera_id, image.camera_id);
}

TEST_F(PhotoIntakeTest, RefusesUnsafeNamesAndTellsWhy) {
  const Bytes photo = SmallJpeg();
  for (const std::string name : {"../a.jpg", "/etc/a.jpg", "", "a\xff.jpg", "a/../../b.jpg"}) {
    const image_ack_t ack = Publish(name, photo);
    EXPECT_EQ(ack.status, +image_ack_t::REFUSED) << name;
    EXPECT_NE(ack.reason, "");
  }
  EXPECT_EQ(Publish(std::string(300, 'a') + ".jpg", photo).status, +image_ack_t::REFUSED);
  image_offer_t offer = MakeOffer("a.jpg", photo);
  offer.agent = "../bob";
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "a.jpg"));
  EXPECT_EQ(Publish("good.jpg", photo).status, +image_ack_t::STORED);
  Await([&] { return facts_.size() == 7; }, "six refusals and a photo; no fact names ../bob");
}

TEST_F(PhotoIntakeTest, OffersThatCannotBePulledAreAnsweredAndLeaveNothing) {
  const image_offer_t good = MakeOffer("a.jpg", SmallJpeg());
  for (int i = 0; i < 20; ++i) {
    image_offer_t agent = good, hash = good, huge = good, negative = good, gone = good;
    agent.agent = "/" + std::to_string(i);
    hash.blob_id = std::to_string(i);
    huge.size_bytes = (int64_t{1} << 40) + i;
    huge.name = "huge" + std::to_string(i);
    negative.size_bytes = -1 - i;
    negative.name = "negative" + std::to_string(i);
    for (const image_offer_t& offer : {agent, hash, huge, negative}) {
      EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
    }
    // Its bytes never come, so nothing is known of a photo of that name.
    gone.name = "/" + std::to_string(i);
    gone.owner = "gone";
    gone.blob_id = HashBytes(&i, sizeof(i));
    peer_->Publish(kImageOfferChannel, gone);
  }
  EXPECT_EQ(bus_.counters().refused.at("SKEIN_IMAGE_OFFER"), 80);
  EXPECT_EQ(Decide(good).status, +image_ack_t::STORED);
  Await([&] { return !facts_.empty(); }, "the photo");
  EXPECT_EQ(facts_.size(), 1u);
}

TEST_F(PhotoIntakeTest, RefusalsAndDuplicatesOfAnAgentHaveABoundInTheLedger) {
  options_.intake.bounds.max_refusals_agent = 3;
  Restart();
  std::string state;
  bus_.Subscribe<heartbeat_t>(kHeartbeatChannel, [&](const heartbeat_t& beat) {
    if (beat.instance == "ingest") state = beat.state;
  });
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  for (uint8_t i = 0; i < 3; ++i) {
    EXPECT_EQ(Publish("bad" + std::to_string(i), {i}).status, +image_ack_t::REFUSED);
  }
  for (int i = 0; i < 35; ++i) {
    EXPECT_EQ(Publish("copy" + std::to_string(i), SmallJpeg()).status, +image_ack_t::DUPLICATE);
  }
  Restart();
  Await([&] { return state == "ready, duplicates: 30"; }, "the duplicates; " + state);
  for (uint8_t i = 3; i < 5; ++i) {
    const image_ack_t ack = Publish("bad" + std::to_string(i), {i});
    EXPECT_EQ(ack.status, +image_ack_t::REFUSED);
    EXPECT_NE(ack.reason, "");
  }
  Await([&] { return state == "2 refused photos are not in the report: too many"; }, state);
  image_offer_t other = MakeOffer("bad", {9});
  other.agent = "bob";
  EXPECT_EQ(Decide(other).status, +image_ack_t::REFUSED);
  Await([&] { return facts_.size() == 5; }, "a photo, three refusals and another agent's");
}

// Anybody can offer a photo with a wrong size; the agent's own offer must not suffer from it.
TEST_F(PhotoIntakeTest, AnOfferOfAnotherSizeDecidesNothing) {
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  for (const int64_t by : {-1, 1}) {
    image_offer_t wrong = offer;
    wrong.size_bytes += by;
    peer_->Publish(kImageOfferChannel, wrong);
  }
  loop_.RunUntil([] { return false; }, 0.5);
  EXPECT_TRUE(facts_.empty());
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
}

TEST_F(PhotoIntakeTest, RefusesWrongSizesAndHashes) {
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("hash.jpg", photo);
  offer.blob_id = "not a hash";
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  offer = MakeOffer("zero.jpg", {});
  EXPECT_EQ(Decide(offer).reason, "empty file");
  offer = MakeOffer("huge.jpg", photo);
  offer.size_bytes = int64_t{1} << 40;
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Decide(offer).cause, +failure_t::TOO_LARGE);
}

TEST_F(PhotoIntakeTest, SetsAsideBadPhotosAndGoesOn) {
  Bytes cut = SmallJpeg();
  cut.resize(cut.size() / 2);
  const std::string text = "a text file called .jpg";
  const auto cause_of = [&](const std::string& name, const Bytes& photo) {
    const image_ack_t ack = Publish(name, photo);
    EXPECT_EQ(ack.status, +image_ack_t::REFUSED) << name;
    return ack.cause;
  };
  EXPECT_EQ(cause_of("cut.jpg", cut), +failure_t::UNREADABLE);
  EXPECT_EQ(cause_of("text.jpg", Bytes(text.begin(), text.end())), +failure_t::UNREADABLE);
  EXPECT_EQ(cause_of("dot.png", Encode(Noise(1, 1), ".png")), +failure_t::TOO_SMALL);
  EXPECT_EQ(Publish("grey.jpg", Encode(Noise(96, 80, CV_8UC1), ".jpg")).status,
            +image_ack_t::STORED);
  EXPECT_EQ(Publish("deep.png", Encode(Noise(96, 80, CV_16UC3), ".png")).status,
            +image_ack_t::STORED);
}

TEST_F(PhotoIntakeTest, MendsWhatACrashLeftBetweenFileAndFact) {
  const Bytes photo = SmallJpeg();
  std::filesystem::create_directories(Paths().Images() / "alice");
  std::ofstream(Paths().Image("alice", "a.jpg")) << "left by a crash";
  ASSERT_TRUE(BlobStore(Paths().Blobs()).Put(photo).ok());
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "a.jpg").string()), photo);
}

TEST_F(PhotoIntakeTest, SaysWhyItCannotStoreAndTakesThePhotoLater) {
  std::ofstream(Paths().Images()) << "a file where the folder must be, like any failed write";
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  peer_->Publish(kImageOfferChannel, offer);
  Await(
      [&] {
        return !acks_.empty() && acks_.back().reason.find("cannot store") != std::string::npos;
      },
      "the reason");
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
  std::filesystem::remove(Paths().Images());
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
}

TEST_F(PhotoIntakeTest, DoesNotTakeBytesThatAreNotWhatTheirHashPromises) {
  // A hostile agent: its hash is that of another content.
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("lie.jpg", photo);
  offer.blob_id = HashBytes("another content", 15);
  offer.owner = "liar";
  bus_.Subscribe<blob_request_t>(BlobRequestChannel("liar"), [&](const blob_request_t& request) {
    blob_chunk_t chunk{};
    chunk.session_id = request.session_id;
    chunk.blob_id = request.blob_id;
    chunk.total_bytes = chunk.size = static_cast<int32_t>(photo.size());
    chunk.data = photo;
    bus_.PublishBulk(request.reply_channel, chunk);
  });
  peer_->Publish(kImageOfferChannel, offer);
  Await(
      [&] {
        return !acks_.empty() && acks_.back().reason.find("do not match") != std::string::npos;
      },
      "the reason");
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
  EXPECT_TRUE(facts_.empty());
  EXPECT_FALSE(BlobStore(Paths().Blobs()).Has(offer.blob_id));
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
}

TEST_F(PhotoIntakeTest, TakesThePhotoOfAnAgentThatVanishedHalfWayWhenItComesBack) {
  const Bytes photo = Encode(Noise(1000, 800), ".png");
  auto agent = std::make_unique<Node>(RemoteNode("agent", ingest_->session_id()), loop_, bus_);
  image_offer_t offer = MakeOffer("half.png", photo);
  offer.owner = "agent";
  agent->blobs().Offer(photo);
  const std::string to_agent = BlobRequestChannel("agent");
  const auto requests =
      bus_.Subscribe<blob_request_t>(to_agent, [&](const blob_request_t& request) {
        if (request.offset > 0) loop_.Post([&] { agent.reset(); });
      });
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return agent == nullptr; }, "half of the photo");
  bus_.Unsubscribe(requests);
  EXPECT_EQ(Publish("other.jpg", SmallJpeg()).status, +image_ack_t::STORED) << "others go on";
  agent = std::make_unique<Node>(RemoteNode("agent", ingest_->session_id()), loop_, bus_);
  agent->blobs().Offer(photo);
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
  EXPECT_EQ(*BlobStore(Paths().Blobs()).Get(offer.blob_id), photo);
}

// Chunks by somebody else than the agent, in answer to each request before it answers: of another
// size, too large, and of the right size with other bytes.
TEST_F(PhotoIntakeTest, TakesAPhotoWhoseChunksWereForgedOnceTheForgerIsGone) {
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("a.jpg", photo);
  offer.owner = "agent";
  int num_forged = 0;
  const auto forger = bus_.Subscribe<blob_request_t>(
      BlobRequestChannel("agent"), [&](const blob_request_t& request) {
        for (const int64_t total : {int64_t{5000000}, int64_t{1} << 40, offer.size_bytes}) {
          blob_chunk_t chunk{};
          chunk.session_id = request.session_id;
          chunk.blob_id = request.blob_id;
          chunk.total_bytes = total;
          chunk.size = static_cast<int32_t>(std::min<int64_t>(total, 10000));
          chunk.data.assign(chunk.size, 7);
          bus_.PublishBulk(request.reply_channel, chunk);
          ++num_forged;
        }
      });
  for (int i = 0; i < 10; ++i) {
    peer_->Publish(kImageOfferChannel, offer);
    loop_.RunUntil([] { return false; }, 0.1);
  }
  EXPECT_GT(num_forged, 3);
  bus_.Unsubscribe(forger);
  Node agent(RemoteNode("agent", ingest_->session_id()), loop_, bus_);
  agent.blobs().Offer(photo);
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
  Await([&] { return !facts_.empty(); }, "the photo");
  EXPECT_TRUE(std::holds_alternative<image_t>(facts_[0])) << "something was refused before";
}

class VanishedAgentsTest : public IngestServiceTest {
 protected:
  VanishedAgentsTest() {
    options_.intake.max_pending = 8;
    options_.intake.max_pending_agent = 4;
    options_.intake.bounds.rests_after_s = 0.5;
    options_.intake.bounds.vanished_after_s = 1;
    Restart();
  }

  image_offer_t OfferOfVanished(int number, const std::string& agent) {
    image_offer_t offer{};
    offer.agent = agent;
    offer.name = std::to_string(number) + ".jpg";
    offer.size_bytes = 100000;
    offer.blob_id = HashBytes(&number, sizeof(number));
    offer.owner = "gone";
    return offer;
  }
  std::string LastReason() const { return acks_.empty() ? "" : acks_.back().reason; }
};

TEST_F(VanishedAgentsTest, LeaveTheirPlacesToOthers) {
  for (int i = 0; i < 64; ++i) {
    peer_->Publish(kImageOfferChannel, OfferOfVanished(i, "gone-" + std::to_string(i)));
  }
  const double start_s = loop_.now_s();
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  EXPECT_LT(loop_.now_s() - start_s, 8);
}

TEST_F(VanishedAgentsTest, AnAgentHasItsOwnPlacesOnly) {
  options_.intake.bounds.rests_after_s = 60;
  Restart();
  for (int i = 0; i < 5; ++i) peer_->Publish(kImageOfferChannel, OfferOfVanished(i, "gone"));
  Await([&] { return acks_.size() == 5; }, "five answers");
  EXPECT_EQ(LastReason(), "other photos are being received; offer again");
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
}

TEST_F(VanishedAgentsTest, AreTakenUpWhenTheyAreBack) {
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("a.jpg", photo);
  offer.owner = "agent";
  peer_->Publish(kImageOfferChannel, offer);
  loop_.RunUntil([] { return false; }, 1);
  acks_.clear();
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return !acks_.empty(); }, "an answer");
  EXPECT_NE(LastReason().find("nothing comes"), std::string::npos) << LastReason();
  Node agent(RemoteNode("agent", ingest_->session_id()), loop_, bus_);
  agent.blobs().Offer(photo);
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
}

TEST_F(VanishedAgentsTest, AreBoundedInNumber) {
  options_.intake.max_pending = 32;
  options_.intake.bounds.rests_after_s = 0.1;
  Restart();
  std::string state;
  bus_.Subscribe<heartbeat_t>(kHeartbeatChannel, [&](const heartbeat_t& beat) {
    if (beat.instance == "ingest") state = beat.state;
  });
  const auto is_told = [&] {
    return state.find("forgotten until offered again") != std::string::npos;
  };
  const double end_s = loop_.now_s() + 3 * kDeadlineS;
  while (!is_told() && loop_.now_s() < end_s) {
    for (int i = 0; i < 400; ++i) {
      peer_->Publish(kImageOfferChannel, OfferOfVanished(i, "gone-" + std::to_string(i / 4)));
    }
    loop_.RunUntil(is_told, 1);
  }
  EXPECT_TRUE(is_told()) << state;
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
}

}  // namespace skein::photo_intake_test
