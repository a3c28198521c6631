#include "http/http.h"

#include <gtest/gtest.h>

#include <fstream>

#include "http/access.h"
#include "http/event_log.h"
#include "http/static_files.h"
#include "testing/test_folder.h"

namespace skein::http_test {

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

AccessRequest Asked(const std::string& method, const std::string& path,
                    std::optional<std::string> host = "127.0.0.1:8470") {
  AccessRequest request;
  request.method = method;
  request.path = path;
  request.host = std::move(host);
  request.local_address = "127.0.0.1";
  request.visitor.is_local = true;
  return request;
}
AccessRequest FromHost(std::optional<std::string> host, const std::string& local = "127.0.0.1") {
  AccessRequest request = Asked("GET", "/api/events", std::move(host));
  request.local_address = local;
  return request;
}

TEST(Access, RequestsNameTheServerAsItIsReached) {
  EXPECT_TRUE(DecideAccess(FromHost("127.0.0.1:8470")).allowed());
  EXPECT_TRUE(DecideAccess(FromHost("localhost:8470")).allowed());
  EXPECT_TRUE(DecideAccess(FromHost("LOCALHOST")).allowed());
  for (const char* host : {"evil.example", "evil.example:8470", "127.0.0.1.evil.example", "", "[",
                           "localhost.evil.example", "192.168.0.1"}) {
    EXPECT_EQ(DecideAccess(FromHost(host)).status, 403) << host;
  }
  EXPECT_EQ(DecideAccess(FromHost(std::nullopt)).status, 403);
  EXPECT_EQ(DecideAccess(FromHost("localhost", "192.168.0.1")).status, 403);
  EXPECT_TRUE(DecideAccess(FromHost("192.168.0.1:80", "192.168.0.1")).allowed());
  EXPECT_TRUE(DecideAccess(FromHost("[::1]:80", "::1")).allowed());
  AccessRequest named = FromHost("Laptop.local:8471", "192.168.0.1");
  EXPECT_EQ(DecideAccess(named).status, 403);
  named.public_host = "laptop.local";
  EXPECT_TRUE(DecideAccess(named).allowed());
}

TEST(Access, ByItsOwnPortOneReadsAndInvitesFromThisHost) {
  EXPECT_TRUE(DecideAccess(Asked("HEAD", "/api/report")).allowed());
  EXPECT_TRUE(DecideAccess(Asked("GET", "/api/photos/3")).allowed());
  EXPECT_TRUE(DecideAccess(Asked("GET", "/metrics")).allowed());
  EXPECT_TRUE(DecideAccess(Asked("POST", "/api/invitations")).allowed());
  EXPECT_EQ(DecideAccess(Asked("POST", "/api/finish")).status, 403);
  EXPECT_EQ(DecideAccess(Asked("PATCH", "/api/uploads/0")).status, 403);
  AccessRequest elsewhere = Asked("POST", "/api/invitations", "192.168.0.1");
  elsewhere.local_address = "192.168.0.1";
  EXPECT_EQ(DecideAccess(elsewhere).status, 403);
  for (const char* method : {"POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "CONNECT", ""}) {
    EXPECT_EQ(DecideAccess(Asked(method, "/api/events")).status, 405) << method;
  }
}

TEST(Access, WhosePassHoldsNoMoreIsToldWhy) {
  AccessRequest request = Asked("GET", "/api/session");
  request.visitor = Visitor{};
  EXPECT_EQ(DecideAccess(request).reason.substr(0, 34), "open the link of your invitation; ");
  request.visitor.refusal = "this invitation was revoked";
  EXPECT_EQ(DecideAccess(request).status, 401);
  EXPECT_EQ(DecideAccess(request).reason, "this invitation was revoked");
  request.path = "/";
  EXPECT_TRUE(DecideAccess(request).allowed());
}

// On the session's own host a pass adds the rights of its role to those of the own port.
TEST(Access, ByItsOwnPortAnOperatorsPassFinishes) {
  const auto with_pass = [](const std::string& method, const std::string& path, Role role) {
    AccessRequest request = Asked(method, path);
    request.visitor = Visitor{true, role, "anna"};
    return request;
  };
  EXPECT_TRUE(DecideAccess(Asked("POST", "/api/enter")).allowed());
  EXPECT_TRUE(DecideAccess(with_pass("POST", "/api/finish", Role::kOperator)).allowed());
  EXPECT_TRUE(DecideAccess(with_pass("PATCH", "/api/uploads/0", Role::kAgent)).allowed());
  EXPECT_TRUE(DecideAccess(with_pass("GET", "/api/events", Role::kAgent)).allowed());
  EXPECT_EQ(DecideAccess(with_pass("POST", "/api/finish", Role::kViewer)).status, 403);
  EXPECT_EQ(DecideAccess(with_pass("POST", "/api/finish", Role::kAgent)).status, 403);
}

// A page that the operator opens may reach the own port, but neither by another name nor as another
// origin does it speak for the operator.
TEST(Access, NoOtherPageFinishesWithAnOperatorsPass) {
  AccessRequest request = Asked("POST", "/api/finish");
  request.visitor = Visitor{true, Role::kOperator, "anna"};
  for (const char* origin : {"http://evil.example", "http://127.0.0.1:9999", "null",
                             "https://127.0.0.1:8470", "http://localhost:8470"}) {
    request.origin = origin;
    EXPECT_EQ(DecideAccess(request).status, 403) << origin;
  }
  request.origin = "http://rebound.example:8470";
  request.host = "rebound.example:8470";
  EXPECT_EQ(DecideAccess(request).status, 403) << "DNS rebinding";
}

// Elsewhere the own port is in the clear.
TEST(Access, AnOwnPortForTheNetworkTakesNoPass) {
  for (const char* path : {"/api/enter", "/api/finish"}) {
    AccessRequest request = Asked("POST", path, "192.168.0.1");
    request.local_address = "192.168.0.1";
    request.visitor = Visitor{true, Role::kOperator, "anna"};
    EXPECT_EQ(DecideAccess(request).status, 403) << path;
  }
}

// Each role on each kind of path, a letter where it is let in: nobody, agent, viewer, operator.
TEST(Access, EachRoleTriesEachPath) {
  const auto who_may = [](const std::string& method, const std::string& path) {
    std::string who;
    const std::pair<char, std::optional<Role>> roles[] = {
        {'n', std::nullopt}, {'a', Role::kAgent}, {'v', Role::kViewer}, {'o', Role::kOperator}};
    for (const auto& [letter, role] : roles) {
      AccessRequest request = Asked(method, path);
      request.visitor = Visitor{false, role, role ? "anna" : ""};
      request.agent_of = [](int64_t image_id) { return image_id == 1 ? "anna" : "bert"; };
      if (DecideAccess(request).allowed()) who += letter;
    }
    return who;
  };
  for (const char* path : {"/", "/phone", "/assets/page.js", "/skein.crt"}) {
    EXPECT_EQ(who_may("GET", path), "navo") << path;
  }
  EXPECT_EQ(who_may("POST", "/api/enter"), "navo");
  EXPECT_EQ(who_may("GET", "/api/session"), "avo");
  for (const char* path :
       {"/api/events", "/api/report", "/api/submaps/1", "/api/photos", "/api/photos/1/matches",
        "/api/photos/1/matches/2", "/api/photos/x", "/api/photos/1/thumbnail/x", "/api/",
        "/download/model.zip", "/ws", "/api", "/api/enter"}) {
    EXPECT_EQ(who_may("GET", path), "vo") << path;
  }
  EXPECT_EQ(who_may("GET", "/api/photos/1"), "avo") << "its own";
  EXPECT_EQ(who_may("GET", "/api/photos/1/thumbnail"), "avo");
  EXPECT_EQ(who_may("GET", "/api/photos/2"), "vo");
  EXPECT_EQ(who_may("GET", "/api/photos/2/thumbnail"), "vo");
  EXPECT_EQ(who_may("PATCH", "/api/uploads/00"), "ao");
  EXPECT_EQ(who_may("HEAD", "/api/uploads/00"), "ao");
  EXPECT_EQ(who_may("POST", "/api/uploads/states"), "ao");
  EXPECT_EQ(who_may("GET", "/metrics"), "o");
  EXPECT_EQ(who_may("HEAD", "/metrics"), "o");
  EXPECT_EQ(who_may("POST", "/metrics"), "");
  EXPECT_EQ(who_may("POST", "/api/finish"), "o");
  EXPECT_EQ(who_may("POST", "/api/invitations"), "o");
  for (const char* method : {"PUT", "DELETE", "TRACE", "PATCH", "POST"}) {
    EXPECT_EQ(who_may(method, "/api/photos/1"), "") << method;
  }
}

TEST(Access, WebSocketsAndChangesAreForTheServersOwnPages) {
  const auto socket = [](std::optional<std::string> origin) {
    AccessRequest request = Asked("GET", "/ws", "localhost:8470");
    request.origin = std::move(origin);
    request.is_websocket = true;
    return DecideAccess(request).status;
  };
  const auto change = [](std::optional<std::string> origin, bool is_encrypted) {
    AccessRequest request = Asked("POST", "/api/invitations", "localhost:8470");
    request.origin = std::move(origin);
    request.is_encrypted = is_encrypted;
    return DecideAccess(request).status;
  };
  EXPECT_EQ(socket("http://localhost:8470"), 0);
  EXPECT_EQ(socket(std::nullopt), 0) << "no browser";
  EXPECT_EQ(change("http://localhost:8470", false), 0);
  EXPECT_EQ(change("https://localhost:8470", true), 0);
  EXPECT_EQ(change("http://localhost:8470", true), 403);
  for (const char* origin : {"http://evil.example", "http://localhost", "https://localhost:8470",
                             "null", "http://localhost:8471", ""}) {
    EXPECT_EQ(socket(origin), 403) << origin;
    EXPECT_EQ(change(origin, false), 403) << origin;
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
  EXPECT_TRUE(StaticFiles(folder_.path() / "page").Check().ok());
  EXPECT_EQ(Get("/").file.filename(), "index.html");
  EXPECT_EQ(Get("/").content_type, "text/html; charset=utf-8");
  EXPECT_EQ(Get("/assets/app.js").content_type, "text/javascript; charset=utf-8");
  EXPECT_EQ(Get("/assets/app.js").status, 200);
}

TEST_F(StaticFilesTest, GivesTheCompressedOneToWhoTakesIt) {
  Write("page/assets/app.js.gz");
  Write("page/phone.html");
  const StaticFiles files(folder_.path() / "page");
  EXPECT_EQ(files.Get("/assets/app.js", true).file.filename(), "app.js.gz");
  EXPECT_TRUE(files.Get("/assets/app.js", true).gzipped);
  EXPECT_EQ(files.Get("/assets/app.js", true).content_type, "text/javascript; charset=utf-8");
  EXPECT_FALSE(files.Get("/assets/app.js", false).gzipped);
  EXPECT_FALSE(files.Get("/index.html", true).gzipped) << "there is none";
  EXPECT_EQ(files.Get("/phone", true).file.filename(), "phone.html");
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
  const StaticFiles files("/no/such/folder");
  EXPECT_FALSE(files.Check().ok());
  const HttpResponse response = files.Get("/");
  EXPECT_EQ(response.status, 404);
  EXPECT_EQ(response.content_type, "text/html; charset=utf-8");
  EXPECT_NE(response.text.find("scripts/setup.sh"), std::string::npos);
}

TEST(StaticFiles, AFolderWithoutAPageSaysSo) {
  const TestFolder empty;
  EXPECT_FALSE(StaticFiles(empty.path()).Check().ok());
  EXPECT_NE(StaticFiles(empty.path()).Get("/phone").text.find("scripts/setup.sh"),
            std::string::npos);
  EXPECT_EQ(StaticFiles(empty.path()).Get("/other").content_type, "application/json");
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

}  // namespace skein::http_test
