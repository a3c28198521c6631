#include "mapper/photo_reports.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace skein::photo_reports_test {

// A mapper's process that begins where the ledger is at `seq`.
class Process {
 public:
  explicit Process(int64_t seq) { reports_.NumberFrom(seq); }

  void Tell(int64_t image_id, PhotoEvent::State state) {
    PhotoEvent event;
    event.image_id = image_id;
    event.state = state;
    reports_.Tell({event});
  }
  // Of the facts that were submitted the latest one.
  registration_t last() const { return submitted_.back(); }
  size_t num_submitted() const { return submitted_.size(); }
  void Commit(size_t i) { committed_[i](static_cast<int64_t>(i)); }
  // Tells and commits. Returns the fact's id.
  std::string Commit(int64_t image_id, PhotoEvent::State state) {
    Tell(image_id, state);
    const std::string id = last().header.fact_id;
    Commit(num_submitted() - 1);
    return id;
  }

 private:
  SessionState session_;
  std::vector<registration_t> submitted_;
  std::vector<Submissions::OnCommitted> committed_;
  PhotoReports reports_{session_, Lease{3, 5},
                        [this](const Fact& fact, Submissions::OnCommitted committed, auto&&...) {
                          submitted_.push_back(std::get<registration_t>(fact));
                          committed_.push_back(std::move(committed));
                        },
                        [] {}};
};

// The first one may be lost and submitted again, and ingest would take it for the newer one.
TEST(PhotoReports, TheNextFactOfAPhotoWaitsForTheOneBefore) {
  Process process(10);
  process.Tell(7, PhotoEvent::State::kDeferred);
  process.Tell(7, PhotoEvent::State::kRegistered);
  EXPECT_EQ(process.num_submitted(), 1);
  process.Tell(8, PhotoEvent::State::kRegistered);
  EXPECT_EQ(process.num_submitted(), 2) << "another photo does not wait";
  process.Commit(0);
  ASSERT_EQ(process.num_submitted(), 3);
  EXPECT_EQ(process.last().image_id, 7);
  EXPECT_TRUE(process.last().state == registration_t::REGISTERED);
}

TEST(PhotoReports, NumbersThePhotosFactsApart) {
  Process process(10);
  std::set<std::string> ids;
  for (const auto state : {PhotoEvent::State::kRegistered, PhotoEvent::State::kWithdrawn,
                           PhotoEvent::State::kRegistered}) {
    EXPECT_TRUE(ids.insert(process.Commit(7, state)).second);
  }
  EXPECT_TRUE(ids.insert(process.Commit(8, PhotoEvent::State::kRegistered)).second);
}

// Else ingest takes the second fact for a repeat of the first, and the withdrawal is lost.
TEST(PhotoReports, TakesNoIdOfAnEarlierProcessOfTheEpoch) {
  Process first(10);
  const std::string registered = first.Commit(7, PhotoEvent::State::kRegistered);
  Process second(11);
  EXPECT_NE(second.Commit(7, PhotoEvent::State::kWithdrawn), registered);
}

}  // namespace skein::photo_reports_test
