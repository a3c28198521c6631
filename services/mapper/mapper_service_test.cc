#include "testing/mapper_service_rig.h"

namespace skein::mapper_service_test {

TEST_F(MapperServiceTest, RegistersThePhotosOfItsSubmap) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  EXPECT_TRUE(holds_submap_);
}

TEST_F(MapperServiceTest, TellsTheShapeOfItsMapWhileSomebodyLooks) {
  submap_shape_t told{};
  int num_told = 0;
  bus_.Subscribe<submap_shape_t>(kSubmapShapeChannel, [&](const submap_shape_t& shape) {
    told = shape;
    ++num_told;
  });
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  EXPECT_FALSE(loop_.RunUntil([&] { return num_told > 0; }, 1.5)) << "nobody looks";
  WantShapes();
  Await([&] { return num_told > 0; }, "a shape");
  EXPECT_EQ(told.submap_id, kSubmap);
  EXPECT_EQ(told.epoch, 1);
  EXPECT_EQ(told.owner, kMapper);
  EXPECT_EQ(told.num_images, 6);
  const Result<ShapeManifest> manifest = DecodeShapeManifest(FetchShape(told.manifest_blob));
  ASSERT_TRUE(manifest.ok()) << manifest.error();
  EXPECT_EQ(manifest->photos.size(), 6u);
  EXPECT_EQ(static_cast<int64_t>(manifest->version), told.version);
  int64_t num_points = 0;
  for (const ShapeManifest::Chunk& chunk : manifest->chunks) {
    const Result<ShapeChunk> points = DecodeShapeChunk(FetchShape(chunk.points_blob));
    const Result<PointTracks> tracks = DecodePointTracks(FetchShape(chunk.tracks_blob));
    ASSERT_TRUE(points.ok() && tracks.ok());
    EXPECT_EQ(points->points.size(), tracks->ends.size());
    num_points += static_cast<int64_t>(points->points.size());
  }
  EXPECT_GT(num_points, 100);
  EXPECT_EQ(num_points, told.num_points);

  // The snapshot is told repeatedly, and a new one when the map grows.
  const int64_t version = told.version;
  const int before = num_told;
  Await([&] { return num_told > before; }, "the shape once more");
  WantShapes();
  Match(7, 8);
  Await([&] { return told.num_images == 8; }, "a shape with the new photos");
  EXPECT_GT(told.version, version);
}

// It is loaded for a comparison, and its matches contradict a map without it.
TEST_F(MapperServiceTest, AFinishLeavesAPhotoToTheSubmapThatHoldsIt) {
  Give(7);
  Await([&] { return Registered().size() == 7; }, "all photos registered");
  HoldElsewhere(8, 10);
  Match(8, 8);
  Ask({8});
  Await([&] { return num_answers_ == 1; }, "the answer");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "the final model");
  EXPECT_EQ(States(8).size(), 1u) << "the other submap's";
}

TEST_F(MapperServiceTest, TheFinalModelTellsOfItsPlaceAndCheckpointsDoNot) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  const auto is_checkpoint = [](const Fact& f) { return IsModel(f, submap_model_t::CHECKPOINT); };
  Await([&] { return Find(is_checkpoint); }, "a checkpoint");
  const auto& checkpoint = std::get<submap_model_t>(*Find(is_checkpoint));
  EXPECT_EQ(checkpoint.place.num_photos, 0);
  EXPECT_EQ(checkpoint.georeference.reason, "");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  const auto is_final = [](const Fact& f) { return IsModel(f, submap_model_t::FINAL); };
  Await([&] { return Find(is_final); }, "the final model");
  const auto& model = std::get<submap_model_t>(*Find(is_final));
  EXPECT_EQ(model.place.num_photos, 8);
  EXPECT_NE(model.place.sentence, "");
  EXPECT_EQ(model.place.metres_per_unit, 0);
  EXPECT_NE(model.georeference.reason, "") << "no photo carries a position";
}

TEST_F(MapperServiceTest, WhenAFinishIsCutItWritesTheModelAndTriesWhatIsLeftAfterwards) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  CommitFinish(finish_t::REQUESTED);
  CommitFinish(finish_t::CUT);
  Match(9, 9);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  const auto is_final = [](const Fact& f) { return IsModel(f, submap_model_t::FINAL); };
  Await([&] { return Find(is_final); }, "the final model");
  EXPECT_EQ(std::get<submap_model_t>(*Find(is_final)).num_images, 8);
  EXPECT_TRUE(States(9).empty());
  CommitFinish(finish_t::DONE);
  Await([&] { return IsRegistered(9); }, "the photo registered");
}

TEST_F(MapperServiceTest, WhenAFinishIsCutAMergeThatHasNotBegunIsUndone) {
  Give(8);
  Await([&] { return Registered().size() == 8; }, "all photos registered");
  CommitFinish(finish_t::REQUESTED);
  Order(2, kSubmap);
  CommitFinish(finish_t::CUT);
  const auto is_undone = [](const Fact& f) { return IsMerge(f, merge_t::UNDONE); };
  Await([&] { return Find(is_undone); }, "UNDONE");
  EXPECT_EQ(std::get<merge_t>(*Find(is_undone)).reason, "the time of the finish was up");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "the final model");
}

TEST_F(MapperServiceTest, TakesBackAPhotoThatTheLedgerRefusesAndGoesOn) {
  RefuseFirst(1, submit_reply_t::REFUSED, "pose is not finite or not a rotation",
              [](const Fact& fact) { return IsRegistration(fact, 5); });
  Give(6);
  Await([&] { return !States(5).empty(); }, "word of the photo");
  EXPECT_EQ(States(5).front(), +registration_t::WITHDRAWN);
  const Fact* told = Find([](const Fact& fact) {
    return std::holds_alternative<registration_t>(fact) &&
           std::get<registration_t>(fact).image_id == 5;
  });
  EXPECT_EQ(std::get<registration_t>(*told).reason,
            "refused by the ledger: pose is not finite or not a rotation");
  // New evidence, and the photo is in.
  Match(7, 13);
  Await([&] { return Registered().size() == 13; }, "all photos registered");
  EXPECT_TRUE(holds_submap_);
}

TEST_F(MapperServiceTest, RejectsAPhotoThatTheLedgerAlwaysRefuses) {
  RefuseFirst(1000, submit_reply_t::REFUSED, "no",
              [](const Fact& fact) { return IsRegistration(fact, 5); });
  Give(13);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "FINAL");
  EXPECT_EQ(Registered().size(), 12u);
  EXPECT_FALSE(States(5).empty());
  EXPECT_FALSE(IsRegistered(5));
  const auto& model = std::get<submap_model_t>(
      *Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }));
  EXPECT_EQ(model.num_images, 12);
}

TEST_F(MapperServiceTest, DissolvesASubmapWhoseFirstPairIsRefused) {
  RefuseFirst(1, submit_reply_t::REFUSED, "no",
              [](const Fact& fact) { return IsRegistration(fact, 1); });
  Give(3);
  Await([&] { return Find([](const Fact& f) { return IsEnd(f); }); }, "ENDED");
  Await([&] { return !holds_submap_; }, "the submap given back");
}

TEST_F(MapperServiceTest, EndsWhenTheSubmapIsAnothers) {
  RefuseFirst(1000, submit_reply_t::NOT_LEASED, "epoch 1 is over",
              [](const Fact& fact) { return IsRegistration(fact, 5) || IsRegistration(fact, 6); });
  Give(6);
  Await([&] { return holds_submap_; }, "the submap held");
  Await([&] { return !holds_submap_; }, "the submap given back");
  EXPECT_TRUE(States(5).empty());
}

TEST_F(MapperServiceTest, EndsWhenTheLedgerTellsOfANewerEpoch) {
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  CommitLease("mapper-2", 2);
  Await([&] { return !holds_submap_; }, "the submap given back");
}

TEST_F(MapperServiceTest, SubmitsRefusedModelsAgain) {
  int num_refused = 0;
  std::map<int8_t, int> left{{submap_model_t::CHECKPOINT, 2}, {submap_model_t::FINAL, 2}};
  ingest_.Refuse([&](const Fact& fact) -> std::optional<RefusedFact> {
    const auto* submap = std::get_if<submap_model_t>(&fact);
    if (submap == nullptr || left[submap->kind] == 0) return std::nullopt;
    --left[submap->kind];
    ++num_refused;
    return RefusedFact{submit_reply_t::REFUSED, "no"};
  });
  Give(6);
  const auto committed = [&](int8_t state) {
    return Find([state](const Fact& fact) { return IsModel(fact, state); }) != nullptr;
  };
  Await([&] { return committed(submap_model_t::CHECKPOINT); }, "a checkpoint");
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return committed(submap_model_t::FINAL); }, "the final model");
  EXPECT_EQ(num_refused, 4);
  EXPECT_TRUE(holds_submap_);
}

// As after a restart of the whole session.
TEST_F(MapperServiceTest, WritesAFinalModelInAnEpochThatHasModelsAlready) {
  const std::string model_blob = MakeModel(1, 6);
  for (int n = 1; n <= 5; ++n) CommitCheckpoint(model_blob, n);
  Give(6);
  CommitFinish(finish_t::DRAINED);
  CommitFinish(finish_t::SETTLED);
  Await([&] { return Find([](const Fact& f) { return IsModel(f, submap_model_t::FINAL); }); },
        "FINAL");
}

// Its lease is of the epoch in which the process before it worked, and stands before the model.
TEST_F(MapperServiceTest, GoesOnFromTheLatestModelThoughItIsGrantedTheSubmapBeforeItHasTheLedger) {
  Match(1, 3);
  Seed(1, 3);
  CommitLease("mapper-2", 1);
  CommitCheckpoint(MakeModel(1, 6), 1);
  DeliverCommitted();
  Node node(TestOptions("mapper-2"), loop_, bus_);
  MapperService service(node, RunOptions());
  Grant("mapper-2");
  // With the seed alone it would have photos 1 to 3.
  Await([&] { return Registered().size() == 6; }, "all photos of the model");
}

// As after a restart: another process has placed photo 5, this one has yet to do so.
TEST_F(MapperServiceTest, ComparesNoPhotosBeforeTheMapHoldsWhatTheLedgerSaysOfThem) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  CommitRegistration(5, kSubmap);
  Ask({5});
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 0);
  Ask({5});
  Await([&] { return num_answers_ == 1; }, "the answer");
}

// Guests take longer than the merger waits before it asks again.
TEST_F(MapperServiceTest, ARequestThatComesAgainWhileItIsAnsweredIsAnsweredOnce) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  for (int i = 0; i < 3; ++i) Ask({1, 2});
  Await([&] { return num_answers_ == 1; }, "the answer");
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 1);
  Ask({1, 2});
  Await([&] { return num_answers_ == 2; }, "the answer to a request that comes later");
}

TEST_F(MapperServiceTest, ComparesNoPhotoThatIsNotThroughMatching) {
  Give(3);
  Await([&] { return Registered().size() == 3; }, "the first photos registered");
  Ask({4});
  Match(4, 8);
  Await([&] { return IsRegistered(8); }, "the photos after it registered");
  EXPECT_EQ(num_answers_, 0);
}

TEST_F(MapperServiceTest, SourceFreezesAgainWhenRefusedAndGoesOnWhenUndone) {
  RefuseFirst(1, submit_reply_t::REFUSED, "no such merge",
              [](const Fact& fact) { return IsMerge(fact, merge_t::FROZEN); });
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  merge_t merge = Order(kSubmap, 2);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::FROZEN); }); }, "FROZEN");
  merge.header.fact_id = "merge/end";
  merge.state = merge_t::UNDONE;
  ingest_.Commit(merge);
  Match(7, 7);
  Await([&] { return IsRegistered(7); }, "a photo registered after the merge");
}

// A seed that looked good before other photos came.
TEST_F(MapperServiceTest, AMapWhosePairsAreAllRotationsEnds) {
  constexpr int8_t kPanoramic = CovisibilityGraph::Edge::kPanoramic;
  Give(3, kPanoramic);
  Await([&] { return Registered().size() == 3; }, "all photos registered");
  Match(4, 4, kPanoramic);
  Await([&] { return Find(IsEnd); }, "the submap's end");
  EXPECT_FALSE(IsRegistered(4));
}

// The target's mapper may have crashed again and again over this merge.
TEST_F(MapperServiceTest, SourceGoesOnWhenTheTargetEnds) {
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  Order(kSubmap, 2);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::FROZEN); }); }, "FROZEN");
  ingest_.Commit(MakeSubmapEnd(2, 1, "its mapper crashed"));
  Match(7, 7);
  Await([&] { return IsRegistered(7); }, "a photo registered after the merge");
}

TEST_F(MapperServiceTest, TargetGoesOnWhenTheSourceEndsBeforeItIsFrozen) {
  Give(6);
  Await([&] { return Registered().size() == 6; }, "all photos registered");
  Order(2, kSubmap);
  ingest_.Commit(MakeSubmapEnd(2, 1, "its mapper crashed"));
  Match(7, 7);
  Await([&] { return IsRegistered(7); }, "a photo registered after the merge");
}

TEST_F(MapperServiceTest, TargetGoesOnWhenTheSourceEndsWhileItIsAbsorbed) {
  ingest_.Refuse([](const Fact& fact) -> std::optional<RefusedFact> {
    if (!IsMerge(fact, merge_t::DONE) && !IsMerge(fact, merge_t::UNDONE)) return std::nullopt;
    return RefusedFact{submit_reply_t::REFUSED, "merge is over"};
  });
  FreezeForATargetOfEight(5, 12);
  ingest_.Commit(MakeSubmapEnd(2, 1, "its mapper crashed"));
  Match(13, 13);
  Await([&] { return IsRegistered(13); }, "a photo registered after the merge");
  EXPECT_EQ(Registered().count(12), 0u) << "the source's photo";
}

TEST_F(MapperServiceTest, TargetAbsorbsAModel) {
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  EXPECT_EQ(Registered().size(), 12u);
}

TEST_F(MapperServiceTest, AMergeReportsEachPhotoThatCameWithItOnce) {
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }); }, "DONE");
  for (int64_t id = 1; id <= 12; ++id) {
    EXPECT_EQ(States(id), std::vector<int>{registration_t::REGISTERED}) << id;
  }
}

TEST_F(MapperServiceTest, TargetSaysWhyItDoesNotAbsorbAModelAndStaysAsItWas) {
  FreezeForATargetOfEight(10, 13);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }); }, "UNDONE");
  const auto& undone =
      std::get<merge_t>(*Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }));
  EXPECT_EQ(undone.reason, "the poses of only 0 shared images agree");
  for (int64_t id = 1; id <= 8; ++id) {
    EXPECT_EQ(States(id), std::vector<int>{registration_t::REGISTERED}) << id;
  }
  EXPECT_TRUE(States(10).empty());
  Match(9, 9);
  Await([&] { return IsRegistered(9); }, "a photo registered after the merge");
}

TEST_F(MapperServiceTest, TargetBecomesWhatItWasWhenTheMergesEndIsRefused) {
  RefuseFirst(1, submit_reply_t::REFUSED, "merge is over",
              [](const Fact& fact) { return IsMerge(fact, merge_t::DONE); });
  FreezeForATargetOfEight(5, 12);
  Await([&] { return Find([](const Fact& f) { return IsMerge(f, merge_t::UNDONE); }); }, "UNDONE");
  EXPECT_FALSE(Find([](const Fact& f) { return IsMerge(f, merge_t::DONE); }));
  Match(13, 13);
  Await([&] { return IsRegistered(13); }, "a photo registered after the merge");
  for (int64_t id = 1; id <= 8; ++id) EXPECT_TRUE(IsRegistered(id)) << id;
  for (int64_t id = 9; id <= 12; ++id) {
    EXPECT_EQ(States(id),
              (std::vector<int>{registration_t::REGISTERED, registration_t::WITHDRAWN}));
  }
  EXPECT_TRUE(holds_submap_);
}

}  // namespace skein::mapper_service_test
