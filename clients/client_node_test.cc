#include "clients/client_node.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

#include "clients/launched.h"
#include "core/file.h"
#include "testing/test_folder.h"

namespace skein::client_node_test {

class ClientNodeTest : public testing::Test {
 protected:
  ClientNodeTest() {
    options_.session_dir = folder_.path().string();
    options_.node.auth = "off";
    EXPECT_TRUE(OpenOrCreateSession(folder_.path()).ok());
  }
  void Launch(const std::string& url) const {
    EXPECT_TRUE(NoteLaunchedUrl(SessionPaths{folder_.path()}, url).ok());
  }
  // As a folder that was sent tells it.
  void Plant(const std::string& url) const {
    const SessionPaths paths{folder_.path()};
    std::filesystem::create_directories(paths.LaunchedUrl().parent_path());
    const std::string line = url + "\n";
    EXPECT_TRUE(WriteFileAtomic(paths.LaunchedUrl().string(), line.data(), line.size()).ok());
  }

  TestFolder folder_;
  ClientOptions options_;
};

TEST_F(ClientNodeTest, HearsTheSessionWhereItWasLaunched) {
  Launch("memq://");
  EXPECT_EQ(MakeClientNode("status", Role::kViewer, options_)->bus().url().provider, "memq");
  std::string name = "alice";
  EXPECT_EQ(MakeAgentNode(options_, &name)->bus().url().provider, "memq");
}

TEST_F(ClientNodeTest, TheCommandLinesUrlGoesFirst) {
  Launch("tcpq://127.0.0.1:1");
  options_.node.lcm_url = "memq://";
  EXPECT_EQ(MakeClientNode("status", Role::kViewer, options_)->bus().url().provider, "memq");
}

TEST_F(ClientNodeTest, NeitherCommandNorAgentGoesWhereASentFolderLeads) {
  std::string name = "alice";
  for (const char* url :
       {"tcpq://203.0.113.7:7700", "udpm://239.255.76.67:7667?ttl=9", "nonsense"}) {
    Plant(url);
    EXPECT_THROW(MakeClientNode("status", Role::kViewer, options_), std::runtime_error) << url;
    EXPECT_THROW(MakeAgentNode(options_, &name), std::runtime_error) << url;
  }
  Plant("memq://");
  EXPECT_EQ(MakeClientNode("status", Role::kViewer, options_)->bus().url().provider, "memq");
  Plant("tcpq://203.0.113.7:7700");
  options_.node.lcm_url = "memq://";
  EXPECT_EQ(MakeClientNode("status", Role::kViewer, options_)->bus().url().provider, "memq");
}

}  // namespace skein::client_node_test
