#include "ingest/ingest_service.h"

#include <gtest/gtest.h>

#include "testing/test_ingest.h"
#include "testing/test_photos.h"

namespace skein {
namespace {

TEST_F(IngestServiceTest, NotesWhatItRunsWithOnce) {
  configuration_ = "[ingest]\nlease = 6\n";
  Restart();
  Await([&] { return facts_.size() == 1; }, "the first configuration");
  Restart();
  configuration_ = "[ingest]\nlease = 9\n";
  Restart();
  Await([&] { return facts_.size() == 2; }, "two configurations");
  const auto& configuration = std::get<configuration_t>(facts_[1]);
  EXPECT_EQ(configuration.service, "ingest");
  EXPECT_EQ(configuration.text, configuration_);
}

TEST_F(IngestServiceTest, CountsMessagesOfAnotherTypeOnAnyChannelAndGoesOn) {
  std::vector<std::string> channels = {kImageOfferChannel.name,  kWorkRequestChannel.name,
                                       kWorkFailedChannel.name,  kCommandChannel.name,
                                       kBlobRequestChannel.name, kLedgerRequestChannel.name};
  ForEachSubmitChannel([&](const auto& channel) { channels.push_back(channel.name); });
  for (const std::string& channel : channels) {
    const int64_t before = bus_.counters().num_decode_failures;
    bus_.Publish(Channel<demand_t>{channel.c_str()}, demand_t{});
    Await([&] { return bus_.counters().num_decode_failures > before; }, "the count of " + channel);
  }
  EXPECT_EQ(Publish("a.jpg", SmallJpeg()).status, +image_ack_t::STORED);
  EXPECT_EQ(Submit(Features(1)), "");
}

}  // namespace
}  // namespace skein
