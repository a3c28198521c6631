#include "web/http.h"

#include <gtest/gtest.h>

#include <fstream>

#include "testing/test_folder.h"
#include "web/access.h"
#include "web/event_log.h"
#include "web/static_files.h"
#include "web/thumbnails.h"

namespace skein {
namespace {

TEST(Http, TargetsAreSplitAndDecoded) {
  const auto request = ParseTarget("/api/a%20b?from=3&x=%2F+y&flag&from=4");
  ASSERT_TRUE(request);
  EXPECT_EQ(request->path, "/api/a b");
  EXPECT_EQ(request->query.at("from"), "4") << "the last one counts";
  EXPECT_EQ(request->query.at("x"), "/ y");
  EXPECT_EQ(request->query.at("flag"), "");
}

TEST(Http, MalformedTargetsAreRefused) {
  for (const char* target :
       {"", "api", "http://x/", "*", "/%", "/%4", "/%zz", "/a%00b", "/?a=%0"}) {
    EXPECT_FALSE(ParseTarget(target)) << target;
  }
}

void ExpectRange(const std::string& header, int status, uint64_t first, uint64_t length) {
  const RangeAnswer answer = ParseRange(header, 100);
  EXPECT_EQ(answer.status, status) << header;
  EXPECT_EQ(answer.range.first, first) << header;
  EXPECT_EQ(answer.range.length, length) << header;
}

TEST(Http, RangesAreThoseOfTheBody) {
  ExpectRange("bytes=0-9", 206, 0, 10);
  ExpectRange("bytes=90-", 206, 90, 10);
  ExpectRange("bytes=90-1000", 206, 90, 10);
  ExpectRange("bytes=-10", 206, 90, 10);
  ExpectRange("bytes=-1000", 206, 0, 100);
  ExpectRange("bytes=100-", 416, 0, 0);
  ExpectRange("bytes=-0", 416, 0, 0);
}

TEST(Http, RangesThatAreNoneGiveTheWhole) {
  for (const char* header : {"", "bytes", "bytes=", "bytes=-", "bytes=a-b", "bytes=9-3",
                             "lines=1-2", "bytes=0-1,5-6", "bytes=99999999999999999999-"}) {
    ExpectRange(header, 200, 0, 100);
  }
}

AccessRequest FromHost(const std::string& host) { return {"GET", host, std::nullopt, "127.0.0.1"}; }

TEST(Access, RequestsNameTheServerAsItIsReached) {
  EXPECT_TRUE(DecideAccess(FromHost("127.0.0.1:8470")).allowed());
  EXPECT_TRUE(DecideAccess(FromHost("localhost:8470")).allowed());
  EXPECT_TRUE(DecideAccess(FromHost("LOCALHOST")).allowed());
  for (const char* host : {"evil.example", "evil.example:8470", "127.0.0.1.evil.example", "", "[",
                           "localhost.evil.example", "192.168.0.1"}) {
    EXPECT_EQ(DecideAccess(FromHost(host)).status, 403) << host;
  }
  EXPECT_EQ(DecideAccess({"GET", std::nullopt, std::nullopt, "127.0.0.1"}).status, 403);
  EXPECT_EQ(DecideAccess({"GET", "localhost", std::nullopt, "192.168.0.1"}).status, 403);
  EXPECT_TRUE(DecideAccess({"GET", "192.168.0.1:80", std::nullopt, "192.168.0.1"}).allowed());
  EXPECT_TRUE(DecideAccess({"GET", "[::1]:80", std::nullopt, "::1"}).allowed());
}

TEST(Access, NobodyWrites) {
  EXPECT_TRUE(DecideAccess({"HEAD", "localhost", std::nullopt, "127.0.0.1"}).allowed());
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", ""}) {
    EXPECT_EQ(DecideAccess({method, "localhost", std::nullopt, "127.0.0.1"}).status, 405);
  }
}

TEST(Access, WebSocketsAreForTheServersOwnPages) {
  const auto socket = [](std::optional<std::string> origin) {
    return DecideAccess({"GET", "localhost:8470", std::move(origin), "127.0.0.1", true}).status;
  };
  EXPECT_EQ(socket("http://localhost:8470"), 0);
  EXPECT_EQ(socket(std::nullopt), 0) << "no browser";
  for (const char* origin : {"http://evil.example", "http://localhost", "https://localhost:8470",
                             "null", "http://localhost:8471", ""}) {
    EXPECT_EQ(socket(origin), 403) << origin;
  }
}

class StaticFilesTest : public ::testing::Test {
 protected:
  StaticFilesTest() {
    Write("page/index.html");
    Write("page/assets/app.js");
    Write("page/.hidden");
    Write("page/.git/config");
    Write("secret.txt");
    std::filesystem::create_symlink(folder_.path() / "secret.txt",
                                    folder_.path() / "page/link.txt");
    std::filesystem::create_directory_symlink(folder_.path(), folder_.path() / "page/out");
  }
  void Write(const std::string& name) {
    const auto path = folder_.path() / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << name;
  }
  HttpResponse Get(const std::string& path) const {
    return StaticFiles(folder_.path() / "page").Get(path);
  }

  TestFolder folder_;
};

TEST_F(StaticFilesTest, GivesTheFilesOfItsFolder) {
  EXPECT_EQ(Get("/").file.filename(), "index.html");
  EXPECT_EQ(Get("/").content_type, "text/html; charset=utf-8");
  EXPECT_EQ(Get("/assets/app.js").content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(Get("/assets/app.js").status, 200);
}

TEST_F(StaticFilesTest, GivesNothingElse) {
  for (const char* path :
       {"/../secret.txt", "/assets/../../secret.txt", "/./index.html", "//etc/passwd", "/assets",
        "/assets/", "/assets//app.js", "/.hidden", "/.git/config", "/link.txt", "/out/secret.txt",
        "/none.js", "/..\\secret.txt", "", "index.html"}) {
    const HttpResponse response = Get(path);
    EXPECT_EQ(response.status, 404) << path;
    EXPECT_TRUE(response.file.empty()) << path;
  }
}

TEST(StaticFiles, AFolderThatIsNotThereSaysSo) {
  EXPECT_NE(StaticFiles("/no/such/folder").Get("/").text.find("--page"), std::string::npos);
}

TEST(EventLog, GivesPagesInOrder) {
  EventLog log;
  for (int64_t seq = 1; seq <= 10; ++seq) {
    log.Append(seq, seq % 2 == 0 ? "" : std::to_string(seq));
  }
  EXPECT_EQ(log.head(), 10);
  EventLog::Page page = log.Get(1, 3);
  EXPECT_EQ(page.events, "1,3,5");
  EXPECT_EQ(page.next, 7);
  page = log.Get(page.next, 3);
  EXPECT_EQ(page.events, "7,9");
  EXPECT_EQ(page.next, 11);
  EXPECT_EQ(log.Get(11).events, "");
  EXPECT_EQ(log.Get(4, 10, 7).events, "5,7");
}

std::shared_ptr<const Bytes> SomeBytes(size_t size) { return std::make_shared<const Bytes>(size); }

TEST(Thumbnails, ThoseThatWereNotAskedForLongestGo) {
  ThumbnailCache cache(100);
  cache.Add(1, SomeBytes(40));
  cache.Add(2, SomeBytes(40));
  EXPECT_NE(cache.Find(1), nullptr);
  cache.Add(3, SomeBytes(40));
  EXPECT_EQ(cache.Find(2), nullptr);
  EXPECT_NE(cache.Find(1), nullptr);
  EXPECT_EQ(cache.size_bytes(), 80u);
  cache.Add(4, SomeBytes(101));
  EXPECT_EQ(cache.Find(4), nullptr) << "larger than the cache";
  cache.Add(3, SomeBytes(40));
  EXPECT_EQ(cache.size_bytes(), 80u) << "once";
}

}  // namespace
}  // namespace skein
