#include "mapper/shape_teller.h"

#include <gtest/gtest.h>

#include "testing/synthetic_scene.h"
#include "testing/test_node.h"

namespace skein {
namespace {

constexpr double kDeadlineS = 20;

class ShapeTellerTest : public testing::Test {
 protected:
  ShapeTellerTest() {
    SyntheticOptions options;
    options.num_photos = 8;
    scene_ = MakeScene(options);
    bus_.Subscribe<submap_shape_t>(kSubmapShapeChannel,
                                   [this](const submap_shape_t& shape) { told_ = shape; });
    OnMap([this](SceneMap* map) { AddToMap(scene_, scene_.pairs, map); });
  }

  void OnMap(const std::function<void(SceneMap*)>& change) {
    bool done = false;
    submap_.Run(
        [change](Submap& submap) {
          change(&submap.map());
          return true;
        },
        [&done](bool) { done = true; });
    ASSERT_TRUE(loop_.RunUntil([&] { return done; }, kDeadlineS));
  }
  void Register(const std::vector<ImageId>& ids) {
    OnMap([&](SceneMap* map) { RegisterAtTruth(scene_, ids, Eigen::Vector3d::Zero(), map); });
  }
  void Look() {
    shape_wanted_t wanted{};
    wanted.author = "viewer";
    viewer_.Publish(kShapeWantedChannel, wanted);
  }
  // Runs the loop, with somebody who looks and the teller's tick, once a second.
  bool Await(const std::function<bool()>& condition, double deadline_s) {
    const auto timer = loop_.AddTimer(0.5, [this] {
      Look();
      teller_.Tick();
    });
    const bool holds = loop_.RunUntil(condition, deadline_s);
    loop_.CancelTimer(timer);
    return holds;
  }

  PollLoop loop_;
  Bus bus_{"memq://", loop_};
  Node node_{TestOptions("mapper-1"), loop_, bus_};
  Node viewer_{TestOptions("viewer"), loop_, bus_};
  WorkerThread worker_{loop_};
  std::atomic<int64_t> current_{0};
  SubmapWorker submap_{worker_, current_, 1, SubmapOptions()};
  ShapeDesk desk_{node_};
  ShapeTeller teller_{node_, submap_, desk_, Lease{1, 1}};
  SyntheticScene scene_;
  submap_shape_t told_{};
};

TEST_F(ShapeTellerTest, ANewPhotoDoesNotWaitForTheNextCopyOfALargeMap) {
  Register({1, 2, 3, 4, 5, 6});
  teller_.NoteChange(true);
  ASSERT_TRUE(Await([&] { return told_.num_images == 6; }, kDeadlineS));
  const int num_points = told_.num_points;
  desk_.NoteCopy(10);  // as long as that of a large map: none for 500 s
  teller_.NoteChange(false);
  EXPECT_FALSE(Await([&] { return told_.num_images != 6; }, 2.5)) << "nothing is new";
  Register({7, 8});
  teller_.NoteChange(true);
  ASSERT_TRUE(Await([&] { return told_.num_images == 8; }, kDeadlineS));
  EXPECT_GT(told_.num_points, num_points);
  EXPECT_GT(desk_.due_s(), loop_.now_s() + 400) << "its time counts, too";
}

}  // namespace
}  // namespace skein
