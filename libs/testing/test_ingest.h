// For tests: the whole of ingest on an in-process bus, against agents, workers, a mapper and a
// merger played by the test.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/formats.h"
#include "ingest/ingest_service.h"
#include "ledger/fact_ids.h"
#include "node/ledger_follower.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"

namespace skein {

inline NodeOptions IngestNode(const TestFolder& folder, const std::string& configuration) {
  NodeOptions options;
  options.service = options.instance = "ingest";
  options.session_dir = (folder / "session").string();
  options.configuration = configuration;
  return options;
}

inline NodeOptions RemoteNode(const std::string& instance, const std::string& session_id) {
  NodeOptions options;
  options.service = options.instance = instance;
  options.session_id = session_id;
  return options;
}

class IngestServiceTest : public testing::Test {
 protected:
  static constexpr double kDeadlineS = 20;

  IngestServiceTest() {
    options_.intake.bounds.vanished_after_s = 0.3;
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
  void AskToFinish(int64_t command_id, const std::string& within_s = "") {
    command_t command{};
    command.command_id = command_id;
    command.verb = "finish";
    command.argument = within_s;
    peer_->Publish(kCommandChannel, command);
  }
  const finish_t* Finished(int8_t state) const {
    return Find<finish_t>([&](const finish_t& f) { return f.state == state; });
  }

  TestFolder folder_;
  IngestOptions options_;
  std::string configuration_;
  std::atomic<double> held_up_s_{0};  // how long the loop has been held up so far
  PollLoop loop_{[this] { return MonotonicS() + held_up_s_; }};
  Bus bus_{"memq://", loop_};
  std::unique_ptr<Node> ingest_;
  std::unique_ptr<IngestService> service_;
  std::unique_ptr<Node> peer_;
  std::unique_ptr<LedgerFollower> follower_;
  Submission::State answer_state_ = Submission::State::kCommitted;  // of the latest Submit
  std::vector<image_ack_t> acks_;
  std::vector<Fact> facts_;
};

}  // namespace skein
