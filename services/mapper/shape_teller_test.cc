#include "mapper/shape_teller.h"

#include <gtest/gtest.h>

#include "testing/shape_telling_mapper.h"
#include "testing/synthetic_scene.h"

namespace skein::shape_teller_test {

constexpr double kDeadlineS = 20;

class ShapeTellerTest : public testing::Test {
 protected:
  ShapeTellerTest() {
    SyntheticOptions options;
    options.num_photos = 8;
    scene_ = MakeScene(options);
    OnMap([this](SceneMap* map) { AddToMap(scene_, scene_.pairs, map); });
  }

  void OnMap(const std::function<void(SceneMap*)>& change) {
    bool done = false;
    mapper_.Change(change, [&done] { done = true; });
    ASSERT_TRUE(mapper_.loop.RunUntil([&] { return done; }, kDeadlineS));
  }
  void Register(const std::vector<ImageId>& ids) {
    OnMap([&](SceneMap* map) { RegisterAtTruth(scene_, ids, Eigen::Vector3d::Zero(), map); });
  }
  // Runs the loop, with somebody who looks and the teller's tick, once a second.
  bool Await(const std::function<bool()>& condition, double deadline_s) {
    const auto timer = mapper_.loop.AddTimer(0.5, [this] { mapper_.LookAndTick(); });
    const bool holds = mapper_.loop.RunUntil(condition, deadline_s);
    mapper_.loop.CancelTimer(timer);
    return holds;
  }

  ShapeTellingMapper mapper_;
  SyntheticScene scene_;
};

TEST_F(ShapeTellerTest, ANewPhotoDoesNotWaitForTheNextCopyOfALargeMap) {
  Register({1, 2, 3, 4, 5, 6});
  mapper_.teller.NoteChange(true);
  ASSERT_TRUE(Await([&] { return mapper_.told.num_images == 6; }, kDeadlineS));
  const int num_points = mapper_.told.num_points;
  mapper_.desk.NoteCopy(10);  // as long as that of a large map: none for 500 s
  mapper_.teller.NoteChange(false);
  EXPECT_FALSE(Await([&] { return mapper_.told.num_images != 6; }, 2.5)) << "nothing is new";
  Register({7, 8});
  mapper_.teller.NoteChange(true);
  ASSERT_TRUE(Await([&] { return mapper_.told.num_images == 8; }, kDeadlineS));
  EXPECT_GT(mapper_.told.num_points, num_points);
  EXPECT_GT(mapper_.desk.due_s(), mapper_.loop.now_s() + 400) << "its time counts, too";
}

}  // namespace skein::shape_teller_test
