#include "mapper/photo_reports.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

namespace skein {
namespace {

// A mapper's process that begins where the ledger is at `seq`.
class Process {
 public:
  explicit Process(int64_t seq) { reports_.NumberFrom(seq); }

  // Returns the fact's id.
  std::string Tell(int64_t image_id, PhotoEvent::State state) {
    PhotoEvent event;
    event.image_id = image_id;
    event.state = state;
    reports_.Tell({event});
    return fact_ids_.back();
  }

 private:
  SessionState session_;
  std::vector<std::string> fact_ids_;
  PhotoReports reports_{
      session_, Lease{3, 5},
      [this](const Fact& fact, auto&&...) { fact_ids_.push_back(Header(fact).fact_id); }, [] {}};
};

TEST(PhotoReports, NumbersThePhotosFactsApart) {
  Process process(10);
  std::set<std::string> ids;
  for (const auto state : {PhotoEvent::State::kRegistered, PhotoEvent::State::kWithdrawn,
                           PhotoEvent::State::kRegistered}) {
    EXPECT_TRUE(ids.insert(process.Tell(7, state)).second);
  }
  EXPECT_TRUE(ids.insert(process.Tell(8, PhotoEvent::State::kRegistered)).second);
}

// Else ingest takes the second fact for a repeat of the first, and the withdrawal is lost.
TEST(PhotoReports, TakesNoIdOfAnEarlierProcessOfTheEpoch) {
  Process first(10);
  const std::string registered = first.Tell(7, PhotoEvent::State::kRegistered);
  Process second(11);
  EXPECT_NE(second.Tell(7, PhotoEvent::State::kWithdrawn), registered);
}

}  // namespace
}  // namespace skein
