#include "relay/relay_options.h"

#include <gtest/gtest.h>

#include <optional>
#include <utility>
#include <vector>

namespace skein::relay_options_test {

constexpr int kMany = 10'000;

RelayProgramOptions OfSession(std::vector<int> ports) {
  RelayProgramOptions options;
  options.ports = std::move(ports);
  options.node.session_dir = "session";
  options.node.lcm_url = "tcpqs://10.0.0.5:7800";
  return options;
}

double RateOf(const RelayProgramOptions& options, int port) {
  return options.OfPort(port, kMany).max_messages_per_s;
}

TEST(RelayProgramOptions, TheBulkPortHasTheHigherRateInAProcessOfItsOwn) {
  const double rate = RateOf(OfSession({7800}), 7800);
  EXPECT_DOUBLE_EQ(rate, RelayOptions{}.max_messages_per_s);
  EXPECT_DOUBLE_EQ(RateOf(OfSession({7801}), 7801), 5 * rate);
}

TEST(RelayProgramOptions, TheBulkPortHasTheHigherRateBehindTheSessionsPort) {
  const double rate = RateOf(OfSession({7800, 7801}), 7800);
  EXPECT_DOUBLE_EQ(rate, RelayOptions{}.max_messages_per_s);
  EXPECT_DOUBLE_EQ(RateOf(OfSession({7800, 7801}), 7801), 5 * rate);
}

TEST(RelayProgramOptions, ThePortsShareTheDescriptors) {
  const RelayProgramOptions options = OfSession({7800, 7801});
  EXPECT_EQ(options.OfPort(7801, 100).max_clients, 50);
  EXPECT_EQ(options.OfPort(7801, kMany).max_clients, options.relay.max_clients);
}

TEST(RelayProgramOptions, TheFirstPortAloneIsListenedToInTheClear) {
  RelayProgramOptions options = OfSession({7800, 7801});
  options.relay.watch_port = 7802;
  EXPECT_EQ(options.OfPort(7800, kMany).watch_port, 7802);
  EXPECT_EQ(options.OfPort(7801, kMany).watch_port, std::nullopt);
}

}  // namespace skein::relay_options_test
