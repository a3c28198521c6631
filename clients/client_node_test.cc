#include "clients/client_node.h"

#include <gtest/gtest.h>

#include <filesystem>

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
  void Launch(const std::string& url) {
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

TEST_F(ClientNodeTest, AFolderThatWasNeverLaunchedHasNoUrl) {
  EXPECT_EQ(LaunchedUrl(SessionPaths{folder_.path()}), "");
  Launch("");
  EXPECT_EQ(LaunchedUrl(SessionPaths{folder_.path()}), "");
}

}  // namespace skein::client_node_test
