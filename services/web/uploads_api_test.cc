#include "web/uploads_api.h"

#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

#include "testing/test_folder.h"

namespace skein::uploads_api_test {

using nlohmann::json;

const std::string kKnown(64, 'a'), kUnknown(64, '0');

// The ledger has one photo, which alice sent.
class UploadsApiTest : public testing::Test {
 protected:
  UploadsApiTest() {
    image_t image{};
    image.header.seq = 1;
    image.image_id = 1;
    image.agent = "alice";
    image.name = "1.jpg";
    image.blob_id = kKnown;
    view_.Apply(Fact(image));
  }

  UploadNews News() {
    UploadNews news;
    news.has_read_ledger = [this] { return has_read_ledger_.load(); };
    return news;
  }
  HttpResponse Ask(const std::string& method, const std::string& name,
                   const std::string& photo = "") {
    HttpRequest request;
    request.method = method;
    request.visitor.name = "alice";
    request.body = json({{"photos", json::array({json::array({photo, "a.jpg"})})}}).dump();
    std::promise<HttpResponse> answer;
    api_.Handle(name, request,
                [&answer](HttpResponse response) { answer.set_value(std::move(response)); });
    return answer.get_future().get();
  }
  json StateOf(const std::string& photo) {
    return json::parse(Ask("POST", "states", photo).text)["states"][0];
  }

  TestFolder folder_;
  SessionView view_;
  std::atomic<bool> has_read_ledger_{true};
  JobPool jobs_{1};
  UploadStore store_{folder_ / "uploads", UploadLimits(),
                     [this](std::function<void()> job) { jobs_.Run(std::move(job)); }};
  UploadsApi api_{view_, store_, jobs_, News()};
};

// A web server that has just begun knows of no photo.
TEST_F(UploadsApiTest, NoPhotoIsUnknownBeforeTheLedgerIsRead) {
  has_read_ledger_ = false;
  EXPECT_EQ(Ask("POST", "states", kUnknown).status, 503);
  EXPECT_EQ(Ask("HEAD", kUnknown).status, 503);
  EXPECT_EQ(Ask("POST", "states", kKnown).status, 200) << "this one it knows";
  EXPECT_EQ(Ask("HEAD", kKnown).status, 200);
  has_read_ledger_ = true;
  EXPECT_EQ(StateOf(kUnknown)["state"], "unknown");
  EXPECT_EQ(Ask("HEAD", kUnknown).status, 404);
}

TEST_F(UploadsApiTest, TellsWhyAPhotoIsRefused) {
  store_.Refuse("alice", kUnknown, {failure_t::TOO_LARGE, "no photo"});
  const json refused = StateOf(kUnknown);
  EXPECT_EQ(refused["state"], "refused");
  EXPECT_EQ(refused["cause"], "too large");
  EXPECT_EQ(refused["reason"], "no photo");
}

TEST_F(UploadsApiTest, TakesBodiesForItsOwnPathsAlone) {
  const auto takes = [this](const std::string& path) {
    HttpRequest request;
    request.path = path;
    return api_.MakeSink(request) != nullptr;
  };
  EXPECT_TRUE(takes("/api/uploads/" + kUnknown));
  for (const char* path :
       {"/", "/api/uploads", "/api/uploads/a/b", "/api/finish", "/x/api/uploads/a"}) {
    EXPECT_FALSE(takes(path)) << path;
  }
}

}  // namespace skein::uploads_api_test
