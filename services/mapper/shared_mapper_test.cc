#include "testing/mapper_service_rig.h"

namespace skein::shared_mapper_test {

class SharedMapperTest : public MapperServiceTest {
 protected:
  SharedMapperTest() : MapperServiceTest(ManyHomes(), 0) {}

  void TellDemand(int num_waiting) {
    demand_t demand{};
    demand.author = "merger";
    demand.kind = "submap";
    demand.num_waiting = num_waiting;
    ingest_node_.Publish(kDemandChannel, demand);
  }

  // Gives the mapper one submap more.
  void GiveOneMore(int64_t submap_id, int64_t image_id1, int64_t image_id2) {
    TellDemand(1);
    Await([&] { return capacity_ > 0; }, "room for another submap");
    TellDemand(0);
    Seed(image_id1, image_id2, submap_id);
    CommitLease(kMapper, 1, submap_id);
    Grant(kMapper, submap_id);
    Await([&] { return capacity_ == 0; }, "the submap taken");
  }

  void GiveThree() {
    Give(8);
    Await([&] { return Registered(kSubmap).size() == 8; }, "the first submap's photos");
    GiveOneMore(2, 3, 5);
    GiveOneMore(3, 4, 6);
    for (const int64_t submap_id : {2, 3}) {
      Await([&] { return Registered(submap_id).size() == 8; }, "the other submaps' photos");
    }
  }
};

TEST_F(SharedMapperTest, SubmapsOfOneMapperGrowInTurn) {
  GiveThree();
  Match(9, 13);
  for (const int64_t submap_id : {1, 2, 3}) {
    Await([&] { return Registered(submap_id).size() == 13; }, "all photos in every submap");
  }
}

TEST_F(SharedMapperTest, TakesNoFurtherSubmapUnlessOneWaits) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "all photos registered");
  EXPECT_FALSE(loop_.RunUntil([&] { return capacity_ > 0; }, 0.5));
}

TEST_F(SharedMapperTest, TheEndOfOneSubmapLeavesTheOthers) {
  GiveThree();
  ingest_.Commit(MakeSubmapEnd(2, 1, "no more"));
  CommitLease("mapper-2", 2, 3);
  Match(9, 13);
  Await([&] { return Registered(kSubmap).size() == 13; }, "all photos in the first");
  EXPECT_EQ(Registered(2).size(), 8u);
  EXPECT_EQ(Registered(3).size(), 8u);
  EXPECT_TRUE(holds_submap_);
}

TEST_F(SharedMapperTest, EachSubmapOfAMapperGetsItsFinalModel) {
  GiveThree();
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  for (const int64_t submap_id : {1, 2, 3}) {
    const auto is_final = [&](const Fact& fact) {
      return IsModel(fact, submap_model_t::FINAL) &&
             std::get<submap_model_t>(fact).submap_id == submap_id;
    };
    Await([&] { return Find(is_final); }, "a final model");
  }
}

TEST_F(SharedMapperTest, MergesTwoOfItsOwnSubmaps) {
  // Ingest holds the blobs of a fact before it commits it.
  ingest_.Refuse([this](const Fact& fact) -> std::optional<RefusedFact> {
    if (IsMerge(fact, merge_t::FROZEN)) {
      const auto blob = node_.blobs().GetLocal(std::get<merge_t>(fact).model_blob);
      if (blob.ok()) ingest_node_.blobs().Offer(*blob);
    }
    return std::nullopt;
  });
  GiveThree();
  for (const int64_t submap_id : {1, 2}) Ask({3, 4, 5}, submap_id);
  Await([&] { return num_answers_ == 2; }, "both submaps' poses and points");
  Order(2, kSubmap);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  ingest_.Commit(MakeSubmapEnd(2, 1, "merged", kSubmap));
  Match(9, 13);
  for (const int64_t submap_id : {1, 3}) {
    Await([&] { return Registered(submap_id).size() == 13; }, "the photos that came later");
  }
  EXPECT_EQ(Registered(2).size(), 8u);
}

}  // namespace skein::shared_mapper_test
