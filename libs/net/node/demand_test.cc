#include "node/demand.h"

#include <gtest/gtest.h>

namespace skein::demand_test {

demand_t Demand(const std::string& author, int num_waiting, const std::string& kind = "submap") {
  demand_t demand{};
  demand.author = author;
  demand.kind = kind;
  demand.num_waiting = num_waiting;
  return demand;
}

work_request_t Request(const std::string& worker, int capacity,
                       const std::string& kind = "submap") {
  work_request_t request{};
  request.worker = worker;
  request.kind = kind;
  request.capacity = capacity;
  return request;
}

TEST(DemandBook, IsShortOfWhatWaitsBeyondTheIdleWorkers) {
  DemandBook book("submap");
  EXPECT_EQ(book.NumShort(0), 0);
  book.OnDemand(Demand("ingest", 2), 0);
  book.OnDemand(Demand("merger", 1), 0);
  EXPECT_EQ(book.NumShort(0), 3);
  book.OnRequest(Request("mapper-1", 0), 0);  // busy
  EXPECT_EQ(book.NumShort(0), 3);
  book.OnRequest(Request("mapper-2", 1), 0);  // idle
  EXPECT_EQ(book.NumShort(0), 2);
  book.OnDemand(Demand("ingest", 0), 0.1);  // replaces what it said
  EXPECT_EQ(book.NumShort(0.1), 0);
}

TEST(DemandBook, IsNeverShortOfLessThanNothing) {
  DemandBook book("submap");
  book.OnRequest(Request("mapper-1", 1), 0);
  EXPECT_EQ(book.NumShort(0), 0);
  book.OnDemand(Demand("ingest", -5), 0);
  book.OnRequest(Request("mapper-1", -7), 0);
  EXPECT_EQ(book.NumShort(0), 0);
}

TEST(DemandBook, OtherKindsDoNotCount) {
  DemandBook book("submap");
  book.OnDemand(Demand("ingest", 4, "features"), 0);
  book.OnRequest(Request("features-1", 1, "features"), 0);
  EXPECT_EQ(book.NumShort(0), 0);
  EXPECT_TRUE(book.Workers(0).empty());
}

TEST(DemandBook, ForgetsWhoIsSilent) {
  DemandBook book("submap", 3);
  book.OnDemand(Demand("merger", 1), 0);
  book.OnRequest(Request("mapper-1", 1), 0);
  book.OnDemand(Demand("merger", 1), 3);
  EXPECT_EQ(book.NumShort(3), 0);
  EXPECT_EQ(book.NumShort(3.1), 1);  // mapper-1 is gone
  EXPECT_TRUE(book.Workers(3.1).empty());
  EXPECT_EQ(book.NumShort(6.1), 0);  // and so is the merger
}

}  // namespace skein::demand_test
