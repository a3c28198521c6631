// The whole service on an in-process bus, against agents, workers, a mapper and a merger played by
// the test.
#include "ingest/ingest_service.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "core/file.h"
#include "core/hash.h"
#include "formats/formats.h"
#include "ledger/fact_ids.h"
#include "node/ledger_follower.h"
#include "node/work_client.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"

namespace skein {
namespace {

constexpr double kDeadlineS = 20;

NodeOptions IngestNode(const TestFolder& folder, const std::string& configuration) {
  NodeOptions options;
  options.service = options.instance = "ingest";
  options.session_dir = (folder / "session").string();
  options.configuration = configuration;
  return options;
}

NodeOptions RemoteNode(const std::string& instance, const std::string& session_id) {
  NodeOptions options;
  options.service = options.instance = instance;
  options.session_id = session_id;
  return options;
}

class IngestServiceTest : public testing::Test {
 protected:
  IngestServiceTest() {
    options_.intake.vanished_after_s = 0.3;
    Restart();
    peer_ = std::make_unique<Node>(RemoteNode("peer", ingest_->session_id()), loop_, bus_);
    bus_.Subscribe<image_ack_t>(kImageAckChannel,
                                [this](const image_ack_t& ack) { acks_.push_back(ack); });
    follower_ = std::make_unique<LedgerFollower>(
        *peer_, 1, [this](const Fact& fact) { facts_.push_back(fact); });
  }

  void Restart() {
    service_.reset();
    ingest_.reset();
    ingest_ = std::make_unique<Node>(IngestNode(folder_, configuration_), loop_, bus_);
    service_ = std::make_unique<IngestService>(*ingest_, options_);
  }

  SessionPaths Paths() const { return {folder_ / "session"}; }

  // Runs the loop until the condition holds.
  void Await(const std::function<bool()>& condition, const std::string& what) {
    ASSERT_TRUE(loop_.RunUntil(condition, kDeadlineS)) << "never happened: " << what;
  }

  image_offer_t MakeOffer(const std::string& name, const Bytes& bytes) {
    image_offer_t offer{};
    offer.agent = "alice";
    offer.name = name;
    offer.size_bytes = static_cast<int64_t>(bytes.size());
    offer.blob_id = peer_->blobs().Offer(bytes);
    offer.owner = "peer";
    return offer;
  }

  // Repeats the offer until it is decided.
  image_ack_t Decide(const image_offer_t& offer) {
    acks_.clear();
    const auto decided = [&] {
      return std::find_if(acks_.begin(), acks_.end(), [&](const image_ack_t& ack) {
        return ack.name == offer.name && ack.blob_id == offer.blob_id &&
               ack.status != image_ack_t::WAIT;
      });
    };
    for (int i = 0; i < 100 && decided() == acks_.end(); ++i) {
      peer_->Publish(kImageOfferChannel, offer);
      loop_.RunUntil([&] { return decided() != acks_.end(); }, 0.2);
    }
    EXPECT_NE(decided(), acks_.end()) << "offer of " << offer.name << " was never decided";
    return decided() == acks_.end() ? image_ack_t{} : *decided();
  }
  image_ack_t Publish(const std::string& name, const Bytes& bytes) {
    return Decide(MakeOffer(name, bytes));
  }

  // Submits, and waits for the answer: "" if committed, else why not.
  std::string Submit(const Fact& fact, Node* author = nullptr) {
    std::optional<std::string> answer;
    (author == nullptr ? *peer_ : *author).submitter().Submit(fact, [&](const Submission& done) {
      answer = done.committed() ? "" : done.reason;
      answer_state_ = done.state;
    });
    Await([&] { return answer.has_value(); }, "an answer to " + Header(fact).fact_id);
    return answer.value_or("no answer");
  }

  template <class T>
  const T* Find(const std::function<bool(const T&)>& matches) const {
    for (const Fact& fact : facts_) {
      const auto* found = std::get_if<T>(&fact);
      if (found != nullptr && matches(*found)) return found;
    }
    return nullptr;
  }

  features_t Features(int64_t image_id) {
    features_t fact{};
    fact.header.fact_id = "features/" + std::to_string(image_id);
    fact.image_id = image_id;
    fact.num_keypoints = 1;
    fact.keypoints_blob = peer_->blobs().Offer(EncodeKeypoints({Keypoint()}));
    Descriptors descriptors;
    descriptors.data.assign(128, static_cast<uint8_t>(image_id));
    fact.descriptors_blob = peer_->blobs().Offer(EncodeDescriptors(descriptors));
    fact.global_blob = peer_->blobs().Offer(EncodeGlobalDescriptor({"vlad", {1}}));
    fact.global_model = "vlad";
    return fact;
  }
  candidates_t Candidates(int64_t image_id) {
    candidates_t fact{};
    fact.header.fact_id = "candidates/" + std::to_string(image_id);
    fact.image_id = image_id;
    return fact;
  }
  matches_t Matches(int64_t image_id) {
    matches_t fact{};
    fact.header.fact_id = "matches/" + std::to_string(image_id);
    fact.image_id = image_id;
    return fact;
  }
  // A photo that went through matching.
  void AddMatchedPhoto(int64_t image_id) {
    EXPECT_EQ(Publish(std::to_string(image_id) + ".jpg", SmallJpeg(image_id)).image_id, image_id);
    EXPECT_EQ(Submit(Features(image_id)), "");
    EXPECT_EQ(Submit(Candidates(image_id)), "");
    EXPECT_EQ(Submit(Matches(image_id)), "");
  }
  seed_t Seed(int64_t image_id1, int64_t image_id2) {
    seed_t seed{};
    seed.header.fact_id = "seed/" + std::to_string(image_id1) + "-" + std::to_string(image_id2);
    seed.image_id1 = image_id1;
    seed.image_id2 = image_id2;
    return seed;
  }
  registration_t Registration(int64_t image_id, int64_t submap_id, int64_t epoch) {
    registration_t fact{};
    fact.header.fact_id = "registration/" + std::to_string(submap_id) + "/" +
                          std::to_string(epoch) + "/" + std::to_string(image_id);
    fact.image_id = image_id;
    fact.submap_id = submap_id;
    fact.epoch = epoch;
    fact.state = registration_t::REGISTERED;
    fact.cam_from_world_qwxyz[0] = 1;
    return fact;
  }
  submap_model_t FinalModel(int64_t submap_id, int64_t epoch, int64_t ledger_seq) {
    submap_model_t fact{};
    fact.header.fact_id = SubmapModelFactId(submap_id, epoch, static_cast<int>(ledger_seq));
    fact.submap_id = submap_id;
    fact.epoch = epoch;
    fact.kind = submap_model_t::FINAL;
    fact.num_images = 2;
    fact.ledger_seq = ledger_seq;
    fact.model_blob = peer_->blobs().Offer(EncodeModelArchive(
        {{"cameras.bin", {1}}, {"images.bin", {2, 2}}, {"points3D.bin", {}}, {"side.bin", {9}}}));
    return fact;
  }
  void AskToFinish(int64_t command_id) {
    command_t command{};
    command.command_id = command_id;
    command.verb = "finish";
    peer_->Publish(kCommandChannel, command);
  }
  const finish_t* Finished(int8_t state) const {
    return Find<finish_t>([&](const finish_t& f) { return f.state == state; });
  }

  TestFolder folder_;
  IngestOptions options_;
  std::string configuration_;
  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  std::unique_ptr<Node> ingest_;
  std::unique_ptr<IngestService> service_;
  std::unique_ptr<Node> peer_;
  std::unique_ptr<LedgerFollower> follower_;
  Submission::State answer_state_ = Submission::State::kCommitted;  // of the latest Submit
  std::vector<image_ack_t> acks_;
  std::vector<Fact> facts_;
};

TEST_F(IngestServiceTest, StoresAPhotoDurablyAndTellsEveryone) {
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

TEST_F(IngestServiceTest, AnswersARepeatedOfferAlikeAlsoAfterARestart) {
  const image_offer_t good = MakeOffer("a.jpg", SmallJpeg());
  const image_offer_t bad = MakeOffer("bad.jpg", {1, 2, 3});
  EXPECT_EQ(Decide(good).status, +image_ack_t::STORED);
  const std::string reason = Decide(bad).reason;
  Restart();
  EXPECT_EQ(Decide(good).status, +image_ack_t::STORED);
  EXPECT_EQ(Decide(good).image_id, 1);
  EXPECT_EQ(Decide(bad).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Decide(bad).reason, reason);
  Await([&] { return facts_.size() == 2; }, "both facts");
}

TEST_F(IngestServiceTest, KnowsAContentThatIsThereAlready) {
  const Bytes photo = SmallJpeg();
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
  const image_ack_t copy = Publish("copy.jpg", photo);
  EXPECT_EQ(copy.status, +image_ack_t::DUPLICATE);
  EXPECT_EQ(copy.image_id, 1);
  Restart();
  EXPECT_EQ(Publish("copy.jpg", photo).status, +image_ack_t::DUPLICATE);
}

TEST_F(IngestServiceTest, KeepsBothOfTwoPhotosOfOneName) {
  const image_offer_t second = MakeOffer("a.jpg", SmallJpeg(2));
  EXPECT_EQ(Publish("a.jpg", SmallJpeg(1)).image_id, 1);
  EXPECT_EQ(Decide(second).image_id, 2);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "a~2.jpg").string()), SmallJpeg(2));
  Restart();
  EXPECT_EQ(Decide(second).status, +image_ack_t::STORED);
  EXPECT_EQ(Decide(second).image_id, 2);
}

TEST_F(IngestServiceTest, NamesAndContentsOfOffersThatComeAtOnceDoNotCollide) {
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

TEST_F(IngestServiceTest, SharesACameraAmongPhotosOfOneSize) {
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

TEST_F(IngestServiceTest, TakesTheConfigurationsOfOthersOnce) {
  NodeOptions options = RemoteNode("mapper-1", ingest_->session_id());
  options.service = "mapper";
  options.configuration = "[mapper]\n";
  const configuration_t fact = ConfigurationOf(options);
  EXPECT_EQ(Submit(fact), "");
  EXPECT_EQ(Submit(fact), "");
  Await([&] { return !facts_.empty(); }, "the fact");
  EXPECT_EQ(std::get<configuration_t>(facts_[0]).instance, "mapper-1");
  EXPECT_EQ(facts_.size(), 1u);
}

TEST_F(IngestServiceTest, TellsKnownIntrinsics) {
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

TEST_F(IngestServiceTest, RefusesUnsafeNamesAndTellsWhy) {
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
  Await([&] { return facts_.size() == 8; }, "seven refusals and a photo");
}

TEST_F(IngestServiceTest, RefusesWrongSizesAndHashes) {
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("small.jpg", photo);
  offer.size_bytes -= 1;
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  offer = MakeOffer("large.jpg", photo);
  offer.size_bytes += 1;
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  offer = MakeOffer("hash.jpg", photo);
  offer.blob_id = "not a hash";
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
  offer = MakeOffer("zero.jpg", {});
  EXPECT_EQ(Decide(offer).reason, "empty file");
  offer = MakeOffer("huge.jpg", photo);
  offer.size_bytes = int64_t{1} << 40;
  EXPECT_EQ(Decide(offer).status, +image_ack_t::REFUSED);
}

TEST_F(IngestServiceTest, SetsAsideBadPhotosAndGoesOn) {
  Bytes cut = SmallJpeg();
  cut.resize(cut.size() / 2);
  const std::string text = "a text file called .jpg";
  EXPECT_EQ(Publish("cut.jpg", cut).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Publish("text.jpg", Bytes(text.begin(), text.end())).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Publish("dot.png", Encode(Noise(1, 1), ".png")).status, +image_ack_t::REFUSED);
  EXPECT_EQ(Publish("grey.jpg", Encode(Noise(96, 80, CV_8UC1), ".jpg")).status,
            +image_ack_t::STORED);
  EXPECT_EQ(Publish("deep.png", Encode(Noise(96, 80, CV_16UC3), ".png")).status,
            +image_ack_t::STORED);
}

TEST_F(IngestServiceTest, MendsWhatACrashLeftBetweenFileAndFact) {
  const Bytes photo = SmallJpeg();
  std::filesystem::create_directories(Paths().Images() / "alice");
  std::ofstream(Paths().Image("alice", "a.jpg")) << "left by a crash";
  ASSERT_TRUE(BlobStore(Paths().Blobs()).Put(photo).ok());
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "a.jpg").string()), photo);
}

TEST_F(IngestServiceTest, SaysWhyItCannotStoreAndTakesThePhotoLater) {
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

TEST_F(IngestServiceTest, CommitsOneOfTwoResultsAndAcknowledgesBoth) {
  Publish("a.jpg", SmallJpeg());
  EXPECT_EQ(Submit(Features(1)), "");
  EXPECT_EQ(Submit(Features(1)), "");
  Await([&] { return facts_.size() == 2; }, "the features");
  EXPECT_TRUE(BlobStore(Paths().Blobs()).Has(std::get<features_t>(facts_[1]).keypoints_blob));
}

TEST_F(IngestServiceTest, RefusesFactsThatFitNothing) {
  EXPECT_EQ(Submit(Features(7)), "no such photo");
  EXPECT_EQ(answer_state_, Submission::State::kRefused);
  Publish("a.jpg", SmallJpeg());
  EXPECT_EQ(Submit(Matches(1)), "photo has no candidates yet");
  features_t misnamed = Features(1);
  misnamed.header.fact_id = "features/2";
  EXPECT_EQ(Submit(misnamed), "fact_id must be features/1");
  image_t image{};
  image.header.fact_id = "image/x";
  EXPECT_NE(Submit(image), "");
  submap_lease_t lease{};
  lease.header.fact_id = SubmapLeaseFactId(1, 1);
  EXPECT_EQ(Submit(lease), "leases are ingest's to give");
}

TEST_F(IngestServiceTest, HandsOutWorkAsItAppears) {
  std::vector<int64_t> given;
  WorkClient features(*peer_, "features", 2,
                      [&](const work_t& work) { given.push_back(work.item_id); });
  for (int i = 1; i <= 3; ++i) Publish(std::to_string(i) + ".jpg", SmallJpeg(i));
  Await([&] { return given.size() == 2; }, "two photos");
  EXPECT_EQ(given, (std::vector<int64_t>{1, 2}));
  EXPECT_EQ(Submit(Features(1)), "");
  features.Done(1);
  Await([&] { return given.size() == 3; }, "the third photo");
}

TEST_F(IngestServiceTest, ParksWhatFailsForGoodAndSaysSo) {
  WorkClient features(*peer_, "features", 1, [&](const work_t& work) {
    features.Fail(work.item_id, "no such model", true);
  });
  Publish("a.jpg", SmallJpeg());
  const auto is_parked = [](const failure_t& f) { return f.parked && f.image_id == 1; };
  Await([&] { return Find<failure_t>(is_parked) != nullptr; }, "the failure");
  EXPECT_EQ(Find<failure_t>(is_parked)->reason, "no such model (peer)");
  EXPECT_EQ(Find<failure_t>(is_parked)->name, "a.jpg");
}

TEST_F(IngestServiceTest, RefusesTheFactsOfAnOlderEpoch) {
  AddMatchedPhoto(1);
  AddMatchedPhoto(2);
  EXPECT_EQ(Submit(Seed(1, 2)), "");
  EXPECT_EQ(Submit(Seed(2, 1)), "photo is in a seed already");
  std::vector<int64_t> epochs;
  {
    WorkClient mapper(*peer_, "submap", 1,
                      [&](const work_t& work) { epochs.push_back(work.epoch); });
    Await([&] { return epochs.size() == 1; }, "the submap");
    EXPECT_EQ(Submit(Registration(1, 1, 1)), "");
    EXPECT_EQ(Submit(Registration(2, 1, 2)).substr(0, 15), "epoch 2 is over");
  }
  // The first mapper falls silent; another takes over.
  Node other(RemoteNode("other", ingest_->session_id()), loop_, bus_);
  WorkClient successor(other, "submap", 1,
                       [&](const work_t& work) { epochs.push_back(work.epoch); });
  Await([&] { return epochs.size() == 2; }, "the takeover");
  EXPECT_EQ(epochs[1], 2);
  EXPECT_NE(Submit(Registration(2, 1, 1)).find("other has the submap in epoch 2"),
            std::string::npos);
  EXPECT_EQ(answer_state_, Submission::State::kNotLeased);
  registration_t forged = Registration(2, 1, 2);
  forged.header.fact_id += "/forged";
  EXPECT_EQ(Submit(forged), "submap is leased to other");
  EXPECT_EQ(Submit(Registration(2, 1, 2), &other), "");
}

TEST_F(IngestServiceTest, FinishesWithModelsAndReportAndOpensAgain) {
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

TEST_F(IngestServiceTest, TakesNoNewPhotoWhileItFinishes) {
  AddMatchedPhoto(1);
  AskToFinish(5);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  peer_->Publish(kImageOfferChannel, MakeOffer("late.jpg", SmallJpeg(2)));
  Await([&] { return !acks_.empty() && acks_.back().name == "late.jpg"; }, "the answer");
  EXPECT_EQ(acks_.back().status, +image_ack_t::WAIT);
  EXPECT_NE(acks_.back().reason.find("finishing"), std::string::npos);
}

TEST_F(IngestServiceTest, GivesUpAnAgentThatVanishedWhenAFinishWaits) {
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

TEST_F(IngestServiceTest, RefusesBytesThatAreNotWhatTheirHashPromises) {
  // A hostile agent: its hash is that of another content.
  const Bytes photo = SmallJpeg();
  image_offer_t offer = MakeOffer("lie.jpg", photo);
  offer.blob_id = HashBytes("another content", 15);
  offer.owner = "liar";
  bus_.Subscribe<blob_request_t>(kBlobRequestChannel, [&](const blob_request_t& request) {
    if (request.owner != "liar") return;
    blob_chunk_t chunk{};
    chunk.session_id = request.session_id;
    chunk.blob_id = request.blob_id;
    chunk.total_bytes = chunk.size = static_cast<int32_t>(photo.size());
    chunk.data = photo;
    bus_.PublishBulk(request.reply_channel, chunk);
  });
  const image_ack_t ack = Decide(offer);
  EXPECT_EQ(ack.status, +image_ack_t::REFUSED);
  EXPECT_NE(ack.reason.find("do not match"), std::string::npos) << ack.reason;
  EXPECT_FALSE(BlobStore(Paths().Blobs()).Has(offer.blob_id));
  EXPECT_EQ(Publish("a.jpg", photo).status, +image_ack_t::STORED);
}

TEST_F(IngestServiceTest, TakesThePhotoOfAnAgentThatVanishedHalfWayWhenItComesBack) {
  const Bytes photo = Encode(Noise(1000, 800), ".png");
  auto agent = std::make_unique<Node>(RemoteNode("agent", ingest_->session_id()), loop_, bus_);
  image_offer_t offer = MakeOffer("half.png", photo);
  offer.owner = "agent";
  agent->blobs().Offer(photo);
  const auto requests =
      bus_.Subscribe<blob_request_t>(kBlobRequestChannel, [&](const blob_request_t& request) {
        const bool half_way = request.owner == "agent" && request.offset > 0;
        if (half_way) loop_.Post([&] { agent.reset(); });
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

TEST_F(IngestServiceTest, CountsMessagesOfAnotherTypeOnAnyChannelAndGoesOn) {
  std::vector<std::string> channels = {kImageOfferChannel.name,  kWorkRequestChannel.name,
                                       kWorkFailedChannel.name,  kCommandChannel.name,
                                       kBlobRequestChannel.name, kLedgerRequestChannel.name};
  ForEachSubmitChannel([&](const auto& channel) { channels.push_back(channel.name); });
  for (const std::string& channel : channels) {
    const int64_t before = bus_.counters().num_decode_failures;
    bus_.Publish(Channel<demand_t>{channel.c_str()}, demand_t{});
    Await([&] { return bus_.counters().num_decode_failures > before; }, "the count of " + channel);
  }
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  EXPECT_EQ(Submit(Features(1)), "");
}

}  // namespace
}  // namespace skein
