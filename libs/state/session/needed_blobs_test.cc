#include "session/needed_blobs.h"

#include <gtest/gtest.h>

#include "testing/test_ledger.h"

namespace skein::needed_blobs_test {

class NeededBlobsTest : public testing::Test {
 protected:
  NeededBlobsTest() {
    for (const int64_t id : {1, 2}) {
      ledger_.Seed(id, 10 * id, 10 * id + 1);
      ledger_.Lease(id, 1);
    }
  }

  void Model(int64_t submap_id, const std::string& blob, int64_t merge_seq = 0) {
    submap_model_t model{};
    model.submap_id = submap_id;
    model.kind = submap_model_t::CHECKPOINT;
    model.model_blob = blob;
    model.merge_seq = merge_seq;
    ledger_.Commit(model);
  }
  void Freeze(int64_t merge_id, const std::string& blob) {
    merge_t frozen = ledger_.state().FindMerge(merge_id)->ordered();
    frozen.header = {};
    frozen.state = merge_t::FROZEN;
    frozen.model_blob = blob;
    ledger_.Commit(frozen);
  }
  std::set<std::string> Needed() const { return NeededBlobs(ledger_.state()); }

  TestLedger ledger_;
};

using Set = std::set<std::string>;

TEST_F(NeededBlobsTest, ArePhotosFeaturesAndMatches) {
  image_t image{};
  image.image_id = 1;
  image.blob_id = "photo";
  ledger_.Commit(image);
  features_t features{};
  features.image_id = 1;
  features.keypoints_blob = "keypoints";
  features.descriptors_blob = "descriptors";
  features.global_blob = "global";
  ledger_.Commit(features);
  matches_t matches{};
  matches.image_id = 1;
  matches.pairs_blob = "pairs";
  ledger_.Commit(matches);
  EXPECT_EQ(Needed(), (Set{"photo", "keypoints", "descriptors", "global", "pairs"}));
}

TEST_F(NeededBlobsTest, AreTheNewestModelsOfLiveSubmaps) {
  Model(1, "old");
  Model(1, "new");
  Model(2, "other");
  EXPECT_EQ(Needed(), (Set{"new", "other"}));
  ledger_.End(2);
  EXPECT_EQ(Needed(), (Set{"new"}));
}

TEST_F(NeededBlobsTest, KeepAMergedModelUntilTheTargetsHoldsIt) {
  Model(1, "source");
  Model(2, "target");
  const int64_t merge = ledger_.Order(1, 2);
  Freeze(merge, "frozen");
  EXPECT_EQ(Needed(), (Set{"source", "target", "frozen"}));
  ledger_.MergeStep(merge, merge_t::DONE);
  EXPECT_EQ(Needed(), (Set{"target", "frozen"}));
  Model(2, "merged", merge);
  EXPECT_EQ(Needed(), (Set{"merged"}));
}

TEST_F(NeededBlobsTest, KeepTheFrozenModelOfASourceThatGoesOn) {
  Model(1, "source");
  const int64_t merge = ledger_.Order(1, 2);
  Freeze(merge, "frozen");
  ledger_.MergeStep(merge, merge_t::UNDONE);
  EXPECT_EQ(Needed(), (Set{"source", "frozen"}));
  ledger_.End(1);
  EXPECT_EQ(Needed(), Set{});
}

}  // namespace skein::needed_blobs_test
