// What ingest removes, and what it makes of a folder that lacks files or has too many.
#include "ingest/garbage.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "node/work_client.h"
#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein::garbage_test {

namespace fs = std::filesystem;

class GarbageTest : public IngestServiceTest {
 protected:
  GarbageTest() {
    options_.garbage_period_s = 0.05;
    Restart();
  }

  fs::path PathOf(const std::string& blob) const { return BlobStore(Paths().Blobs()).Path(blob); }
  std::string Store(const Bytes& bytes) { return *BlobStore(Paths().Blobs()).Put(bytes); }
  void MakeOld(const fs::path& file) {
    fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::hours(2));
  }
};

TEST_F(GarbageTest, GoesOnceItIsOld) {
  const image_ack_t photo = Publish("a.jpg", SmallJpeg());
  const std::string orphan = Store({1, 2, 3}), young = Store({4, 5, 6});
  const fs::path temporary = PathOf(orphan).string() + ".tmp-1-2";
  ASSERT_TRUE(WriteFileAtomic(temporary.string(), Bytes{7}).ok());
  for (const fs::path& file : {PathOf(orphan), PathOf(photo.blob_id), temporary}) MakeOld(file);
  Await([&] { return !fs::exists(PathOf(orphan)) && !fs::exists(temporary); }, "they go");
  EXPECT_TRUE(fs::exists(PathOf(photo.blob_id)));
  EXPECT_TRUE(fs::exists(PathOf(young)));
}

TEST_F(GarbageTest, AModelGoesSoonAfterANewerOneWhateverItsAge) {
  for (const uint8_t id : {1, 2}) AddMatchedPhoto(id);
  ASSERT_EQ(Submit(Seed(1, 2)), "");
  bool is_leased = false;
  const WorkClient mapper(*peer_, "submap", 1, [&](const work_t&) { is_leased = true; });
  Await([&] { return is_leased; }, "the submap");
  for (const int64_t id : {1, 2}) ASSERT_EQ(Submit(Registration(id, 1, 1)), "");
  std::vector<std::string> blobs;
  for (const uint8_t number : {1, 2, 3}) {
    submap_model_t checkpoint = FinalModel(1, 1, number);
    checkpoint.kind = submap_model_t::CHECKPOINT;
    checkpoint.model_blob = peer_->blobs().Offer({number});
    ASSERT_EQ(Submit(checkpoint), "");
    blobs.push_back(checkpoint.model_blob);
  }
  Await([&] { return !fs::exists(PathOf(blobs[0])) && !fs::exists(PathOf(blobs[1])); }, "they go");
  loop_.RunUntil([] { return false; }, 0.5);
  EXPECT_TRUE(fs::exists(PathOf(blobs[2])));
}

TEST_F(GarbageTest, IsNotCollectedDuringAFinish) {
  AskToFinish(1);
  Await([&] { return Finished(finish_t::DRAINED) != nullptr; }, "DRAINED");
  const std::string orphan = Store({1, 2, 3});
  MakeOld(PathOf(orphan));
  loop_.RunUntil([] { return false; }, 0.5);
  EXPECT_TRUE(fs::exists(PathOf(orphan)));
}

TEST_F(GarbageTest, APhotoInTheFolderThatNoFactNamesIsTakenIn) {
  Publish("a.jpg", SmallJpeg(1));
  const fs::path left = Paths().Image("bob", "walk/b.jpg"), copy = Paths().Image("bob", "copy.jpg");
  fs::create_directories(left.parent_path());
  ASSERT_TRUE(WriteFileAtomic(left.string(), SmallJpeg(2)).ok());
  ASSERT_TRUE(WriteFileAtomic(copy.string(), SmallJpeg(1)).ok());
  Restart();
  Await([&] { return facts_.size() == 2; }, "it is taken in");
  const auto& image = std::get<image_t>(facts_[1]);
  EXPECT_EQ(image.agent, "bob");
  EXPECT_EQ(image.name, "walk/b.jpg");
  EXPECT_EQ(*ReadFile(left.string()), SmallJpeg(2));
  Restart();
  loop_.RunUntil([] { return false; }, 0.5);
  EXPECT_EQ(facts_.size(), 2u) << "a content that is known is no photo";
}

TEST_F(GarbageTest, APhotoWhoseFileIsLostIsPulledAgain) {
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  const int64_t image_id = Decide(offer).image_id;
  fs::remove(PathOf(offer.blob_id));
  fs::remove(Paths().Image("alice", "a.jpg"));
  peer_->blobs().Offer(SmallJpeg());
  EXPECT_EQ(Decide(offer).image_id, image_id);
  EXPECT_EQ(*ReadFile(Paths().Image("alice", "a.jpg").string()), SmallJpeg());
  EXPECT_EQ(facts_.size(), 1u);
}

TEST_F(GarbageTest, WithoutRoomOnTheDiskPhotosWait) {
  options_.intake.min_free_bytes = int64_t{1} << 60;
  Restart();
  const image_offer_t offer = MakeOffer("a.jpg", SmallJpeg());
  peer_->Publish(kImageOfferChannel, offer);
  Await([&] { return !acks_.empty(); }, "an answer");
  EXPECT_EQ(acks_[0].status, +image_ack_t::WAIT);
  EXPECT_NE(acks_[0].reason.find("disk is almost full"), std::string::npos);
  EXPECT_EQ(acks_[0].reason.find("--min-free"), std::string::npos) << "a page has no options";
  std::string problem;
  const auto heartbeats =
      peer_->bus().Subscribe<heartbeat_t>(kHeartbeatChannel, [&](const heartbeat_t& told) {
        if (told.service == "ingest") problem = told.problem;
      });
  Await([&] { return !problem.empty(); }, "a heartbeat");
  peer_->bus().Unsubscribe(heartbeats);
  EXPECT_EQ(problem.find("--min-free"), std::string::npos);
  EXPECT_NE(problem.find("\nMake room on that computer, on the disk that holds " +
                         fs::absolute(Paths().root).string() + "."),
            std::string::npos)
      << problem;
  options_.intake.min_free_bytes = 0;
  Restart();
  EXPECT_EQ(Decide(offer).status, +image_ack_t::STORED);
}

}  // namespace skein::garbage_test
