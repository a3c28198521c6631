#include "web/session_api.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <future>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "core/hash.h"
#include "formats/formats.h"
#include "formats/mesh_chunk.h"
#include "sfm/model_io.h"
#include "testing/synthetic_scene.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"

namespace skein::session_api_test {

using nlohmann::json;

constexpr int64_t kSubmap = 4;

// A finished session of one map: eight photos of a synthetic scene, with blobs in memory.
class SessionApiTest : public ::testing::Test {
 protected:
  explicit SessionApiTest(bool has_gps = true) : has_gps_(has_gps) {
    FillMap(scene_, &map_);
    map_.ColourPoints();
    for (size_t i = 0; i < scene_.photos.size(); ++i) AddPhoto(static_cast<int64_t>(i) + 1);
    seed_t seed{};
    seed.submap_id = kSubmap;
    seed.image_id1 = 1;
    seed.image_id2 = 2;
    Commit(seed);
    AddModel();
    source_.session_id = "0123456789abcdef";
    source_.session_dir = folder_.path();
    source_.page_dir = folder_ / "page";
    source_.may_use_model = [this](int64_t) { return may_use_model_; };
    source_.on_look = [this] { ++num_looks_; };
    source_.fetch = [this](const std::string& id, const std::string&,
                           const SessionSource::Done& done) {
      const auto blob = blobs_.find(id);
      done(blob == blobs_.end() ? Result<Bytes>(NotFound("no blob")) : Result<Bytes>(blob->second));
    };
    api_ = std::make_unique<SessionApi>(view_, source_, 2);
  }

  template <class T>
  void Commit(T fact) {
    fact.header.seq = view_.events().head() + 1;
    fact.header.utime_us = fact.header.seq * 1'000'000;
    fact.header.fact_id = std::to_string(fact.header.seq);
    view_.Apply(Fact(fact));
  }
  std::string Keep(Bytes bytes) {
    const std::string id = HashBytes(bytes.data(), bytes.size());
    blobs_[id] = std::move(bytes);
    return id;
  }

  void AddPhoto(int64_t id) {
    image_t image{};
    image.image_id = id;
    image.agent = "alice";
    image.name = std::to_string(id) + ".jpg";
    image.width_px = 640;
    image.height_px = 400;
    image.orientation = 6;  // upright after a turn
    image.blob_id = Keep(SmallJpeg(static_cast<uint64_t>(id), 640, 400));
    SetPosition(&image);
    Commit(image);
    features_t features{};
    features.image_id = id;
    features.keypoints_blob = Keep(EncodeKeypoints(scene_.photos[id - 1].keypoints));
    Commit(features);
    const TwoViewPairs& pairs = scene_.pairs[id - 1];
    matches_t matches{};
    matches.image_id = id;
    for (const TwoViewPair& pair : pairs) {
      two_view_t told{};
      told.other_id = pair.other_id;
      told.num_inliers = static_cast<int32_t>(pair.inliers.size());
      matches.pairs.push_back(told);
    }
    matches.num_pairs = static_cast<int32_t>(matches.pairs.size());
    if (!pairs.empty()) matches.pairs_blob = Keep(EncodeTwoViewPairs(pairs));
    Commit(matches);
  }
  // Ten metres a unit of the scene, whose y axis points down.
  void SetPosition(image_t* image) const {
    const auto i = static_cast<size_t>(image->image_id - 1);
    const Eigen::Vector3d centre = 10 * scene_.Center(i);
    image->has_gps = image->has_altitude = has_gps_;
    image->latitude_deg = 48 + centre.z() / 111'200;
    image->longitude_deg = 11 + centre.x() / 74'400;
    image->altitude_m = 500 - centre.y();
  }
  void AddModel(const std::string& ending = ".jpg") {
    submap_model_t model{};
    model.submap_id = kSubmap;
    model.kind = submap_model_t::FINAL;
    model.num_images = 8;
    Reconstruction written = map_.reconstruction();
    for (const ImageId id : written.RegImageIds()) {
      written.Image(id).SetName("alice/" + std::to_string(id) + ending);
    }
    model.model_blob = Keep(EncodeModelArchive(EncodeModel(written)));
    Commit(model);
  }

  HttpResponse Get(const std::string& target) {
    std::promise<HttpResponse> answer;
    api_->Handle(*ParseTarget(target),
                 [&answer](HttpResponse response) { answer.set_value(std::move(response)); });
    return answer.get_future().get();
  }
  json GetJson(const std::string& target) {
    const HttpResponse response = Get(target);
    EXPECT_EQ(response.status, 200) << target << ": " << response.text;
    return json::parse(response.text);
  }
  int StatusOf(const std::string& target) {
    const HttpResponse response = Get(target);
    if (response.status != 200) {
      EXPECT_TRUE(json::parse(response.text)["error"].is_string()) << target;
    }
    return response.status;
  }
  std::string ChunkPath(const json& shape, size_t index) {
    const json& chunk = shape["chunks"][index];
    return "/api/submaps/4/chunks/" + chunk["id"].dump();
  }

  const SyntheticScene scene_ = MakeScene({});
  SceneMap map_;
  TestFolder folder_;
  SessionView view_;
  std::map<std::string, Bytes> blobs_;
  SessionSource source_;
  const bool has_gps_;
  bool may_use_model_ = true;
  std::atomic<int> num_looks_{0};
  std::unique_ptr<SessionApi> api_;
};

class SessionApiWithoutGpsTest : public SessionApiTest {
 protected:
  SessionApiWithoutGpsTest() : SessionApiTest(false) {}
};

TEST_F(SessionApiTest, TellsTheSession) {
  const json session = GetJson("/api/session");
  EXPECT_EQ(session["session_id"], "0123456789abcdef");
  EXPECT_EQ(session["live"], false);
  EXPECT_EQ(session["head"], view_.events().head());
  EXPECT_GT(session["page_limits"]["points"], 0);
}

TEST_F(SessionApiTest, GivesEventsFromAPlaceOn) {
  const json all = GetJson("/api/events");
  EXPECT_EQ(all["events"].size(), 3u * 8 + 2);
  EXPECT_EQ(GetJson("/api/events?from=1"), all);
  const json some = GetJson("/api/events?from=20");
  EXPECT_EQ(some["events"][0]["seq"], 20);
  EXPECT_EQ(some["head"], 26);
  EXPECT_EQ(some["next"], 27);
  EXPECT_TRUE(GetJson("/api/events?from=999")["events"].empty());
  EXPECT_EQ(StatusOf("/api/events?from=x"), 400);
  EXPECT_EQ(StatusOf("/api/events?from=-1"), 400);
}

TEST_F(SessionApiTest, GivesAtMostTwoThousandEventsAtOnce) {
  for (int i = 0; i < 2500; ++i) Commit(failure_t{});
  json page = GetJson("/api/events?from=1");
  EXPECT_EQ(page["events"].size(), 2000u);
  EXPECT_EQ(page["next"], 2001);
  page = GetJson("/api/events?from=2001");
  EXPECT_EQ(page["events"].size(), 526u);
  EXPECT_EQ(page["next"], page["head"].get<int64_t>() + 1);
}

TEST_F(SessionApiTest, TheShapeOfAModelHoldsAllItsPoints) {
  const json shape = GetJson("/api/submaps/4");
  EXPECT_EQ(shape["submap"], kSubmap);
  EXPECT_EQ(shape["version"], view_.events().head() * 1'000'000);
  EXPECT_EQ(shape["photos"].size(), 8u);
  EXPECT_EQ(shape["photos"][0]["pose"].size(), 7u);
  EXPECT_EQ(shape["cameras"]["1"]["fx"], 1000);
  size_t num_points = 0;
  for (size_t i = 0; i < shape["chunks"].size(); ++i) {
    const HttpResponse chunk =
        Get(ChunkPath(shape, i) + "?v=" + shape["chunks"][i]["version"].dump());
    ASSERT_EQ(chunk.status, 200);
    EXPECT_TRUE(chunk.immutable && chunk.ranges);
    const Result<ShapeChunk> decoded = DecodeShapeChunk(*chunk.bytes);
    ASSERT_TRUE(decoded.ok());
    num_points += decoded->points.size();
  }
  EXPECT_EQ(num_points, map_.reconstruction().NumPoints3D());
  EXPECT_GT(num_looks_, 0);
}

TEST_F(SessionApiTest, AVersionThatIsGoneNamesTheNewest) {
  const json shape = GetJson("/api/submaps/4");
  const HttpResponse gone = Get(ChunkPath(shape, 0) + "?v=1");
  EXPECT_EQ(gone.status, 404);
  EXPECT_EQ(json::parse(gone.text)["version"], shape["chunks"][0]["version"]);
  EXPECT_EQ(StatusOf(ChunkPath(shape, 0)), 400);
  EXPECT_EQ(StatusOf("/api/submaps/4/chunks/999?v=1"), 404);
}

TEST_F(SessionApiTest, DensePointsAreGivenByTheirOwnersChunks) {
  EXPECT_EQ(StatusOf("/api/submaps/4/dense"), 404);
  ShapeChunk chunk;
  chunk.step = 1;
  chunk.points.resize(3);
  auto points = std::make_shared<DensePoints>();
  points->owner = "dense";
  points->version = 50;
  points->manifest.photos = {{2, 1.5, 0.25f, {{131072, 49, 3, Keep(EncodeShapeChunk(chunk))}}}};
  api_->dense().Set(kSubmap, points);
  const json dense = GetJson("/api/submaps/4/dense");
  EXPECT_EQ(dense["version"], 50);
  EXPECT_EQ(dense["photos"][0]["image"], 2);
  EXPECT_EQ(dense["photos"][0]["scale"], 1.5);
  EXPECT_EQ(dense["photos"][0]["chunks"][0]["points"], 3);
  const HttpResponse bytes = Get("/api/submaps/4/dense/131072?v=49");
  ASSERT_EQ(bytes.status, 200);
  EXPECT_TRUE(bytes.immutable && bytes.ranges);
  EXPECT_EQ(DecodeShapeChunk(*bytes.bytes)->points.size(), 3u);
  const HttpResponse gone = Get("/api/submaps/4/dense/131072?v=48");
  EXPECT_EQ(gone.status, 404);
  EXPECT_EQ(json::parse(gone.text)["version"], 49);
  EXPECT_EQ(StatusOf("/api/submaps/4/dense/131072"), 400);
  EXPECT_EQ(StatusOf("/api/submaps/4/dense/5?v=49"), 404);
  EXPECT_TRUE(api_->dense().Drop(kSubmap));
  EXPECT_EQ(StatusOf("/api/submaps/4/dense"), 404);
}

TEST_F(SessionApiTest, AMeshIsGivenByItsOwnersChunks) {
  EXPECT_EQ(StatusOf("/api/submaps/4/mesh"), 404);
  MeshChunk chunk;
  chunk.step = 1;
  chunk.vertices.resize(3);
  chunk.triangles = {{0, 1, 2}};
  auto points = std::make_shared<DensePoints>();
  points->owner = "dense";
  points->version = 50;
  api_->dense().Set(kSubmap, points);
  EXPECT_EQ(StatusOf("/api/submaps/4/mesh"), 404) << "points alone";
  points = std::make_shared<DensePoints>(*points);
  const std::string blob = Keep(EncodeMeshChunk(chunk));
  points->manifest.mesh = {
      0.5, {{2, {1, 0, 0, 0}, {1, 2, 3}}}, {{70, 49, 3, 1, blob}, {71, 49, 3, 2, blob}}};
  api_->dense().Set(kSubmap, points);
  const json mesh = GetJson("/api/submaps/4/mesh");
  EXPECT_EQ(mesh["version"], 50);
  EXPECT_EQ(mesh["voxel"], 0.5);
  EXPECT_EQ(mesh["frame"][0]["image"], 2);
  EXPECT_EQ(mesh["frame"][0]["pose"], json({1, 0, 0, 0, 1, 2, 3}));
  EXPECT_EQ(mesh["chunks"][0]["triangles"], 1);
  const HttpResponse bytes = Get("/api/submaps/4/mesh/70?v=49");
  ASSERT_EQ(bytes.status, 200);
  EXPECT_TRUE(bytes.immutable);
  EXPECT_EQ(DecodeMeshChunk(*bytes.bytes)->triangles.size(), 1u);
  EXPECT_EQ(StatusOf("/api/submaps/4/mesh/71?v=49"), 500)
      << "not of the size that it is said to be";
  EXPECT_EQ(json::parse(Get("/api/submaps/4/mesh/70?v=48").text)["version"], 49);
  EXPECT_EQ(StatusOf("/api/submaps/4/mesh/70"), 400);
  EXPECT_EQ(StatusOf("/api/submaps/4/mesh/5?v=49"), 404);
}

// Each photo sees the point where the keypoint is.
TEST_F(SessionApiTest, APointTellsWhoSeesIt) {
  const json shape = GetJson("/api/submaps/4");
  const std::string version = "?v=" + shape["chunks"][0]["version"].dump();
  const json point = GetJson(ChunkPath(shape, 0) + "/points/7" + version);
  ASSERT_GE(point["photos"].size(), 2u);
  const Eigen::Vector3d xyz(point["xyz"][0], point["xyz"][1], point["xyz"][2]);
  for (const json& photo : point["photos"]) {
    const size_t i = photo["image"].get<size_t>() - 1;
    const Eigen::Vector3d at = scene_.rotations[i] * xyz + scene_.translations[i];
    EXPECT_NEAR(1000 * at.x() / at.z() + 600, photo["x"].get<double>(), 3);
    EXPECT_NEAR(1000 * at.y() / at.z() + 450, photo["y"].get<double>(), 3);
  }
  EXPECT_EQ(StatusOf(ChunkPath(shape, 0) + "/points/100000" + version), 404);
  EXPECT_EQ(StatusOf(ChunkPath(shape, 0) + "/points/x" + version), 404);
}

TEST_F(SessionApiTest, ANewerModelReplacesTheShape) {
  const json before = GetJson("/api/submaps/4");
  map_.Deregister(8);
  AddModel();
  const json after = GetJson("/api/submaps/4");
  EXPECT_GT(after["version"], before["version"]);
  EXPECT_EQ(after["photos"].size(), 7u);
}

TEST_F(SessionApiTest, AMappersShapeIsWaitedFor) {
  may_use_model_ = false;
  EXPECT_EQ(StatusOf("/api/submaps/4"), 404);
  auto told = std::make_shared<Shape>();
  told->submap_id = kSubmap;
  told->version = 1;
  EXPECT_TRUE(api_->shapes().Set(told));
  EXPECT_EQ(GetJson("/api/submaps/4")["version"], 1) << "it is newer than what the model would be";
  auto older = std::make_shared<Shape>(*told);
  older->version = 0;
  EXPECT_FALSE(api_->shapes().Set(older));
}

TEST_F(SessionApiTest, SubmapsThatEndedSaySo) {
  submap_end_t end{};
  end.submap_id = kSubmap;
  end.merged_into = 9;
  Commit(end);
  const HttpResponse response = Get("/api/submaps/4");
  EXPECT_EQ(response.status, 404);
  EXPECT_NE(response.text.find("map 9 has its photos"), std::string::npos);
}

TEST_F(SessionApiTest, ThumbnailsAreUprightAndSmall) {
  const HttpResponse response = Get("/api/photos/2/thumbnail");
  ASSERT_EQ(response.status, 200);
  EXPECT_EQ(response.content_type, "image/jpeg");
  const cv::Mat image = cv::imdecode(*response.bytes, cv::IMREAD_COLOR);
  EXPECT_EQ(image.rows, kThumbnailSidePx);
  EXPECT_EQ(image.cols, 200);
  EXPECT_EQ(Get("/api/photos/2/thumbnail").bytes, response.bytes) << "from the cache";
}

// Another session may follow at the same host and port, and it has a photo 2, too.
TEST_F(SessionApiTest, BrowsersKeepAPhotoUnderTheAddressThatNamesItsCommit) {
  const json events = GetJson("/api/events")["events"];
  const auto photo = std::find_if(events.begin(), events.end(), [](const json& event) {
    return event["kind"] == "photo" && event["image"] == 2;
  });
  ASSERT_NE(photo, events.end());
  for (const std::string path : {"/api/photos/2", "/api/photos/2/thumbnail"}) {
    EXPECT_TRUE(Get(path + "?v=" + (*photo)["t"].dump()).immutable) << path;
    EXPECT_FALSE(Get(path + "?v=1").immutable) << path;
    EXPECT_FALSE(Get(path).immutable) << path;
  }
}

TEST_F(SessionApiTest, PhotosAreGivenAsStored) {
  const HttpResponse response = Get("/api/photos/2");
  EXPECT_EQ(response.content_type, "image/jpeg");
  EXPECT_EQ(*response.bytes, SmallJpeg(2, 640, 400));
  for (const char* path :
       {"/api/photos/99", "/api/photos/99/thumbnail", "/api/photos/99/matches",
        "/api/photos/2/matches/99", "/api/photos/2/nothing", "/api/photos", "/api/photos/0"}) {
    EXPECT_EQ(StatusOf(path), 404) << path;
  }
  EXPECT_EQ(StatusOf("/api/photos/x"), 400);
  EXPECT_EQ(StatusOf("/api/photos/99999999999999999999"), 400);
}

// A JPEG may hold HTML or CSS in a comment.
TEST_F(SessionApiTest, APhotoIsShownAsNothingButAPhoto) {
  for (const char* name : {"page.html", "style.css", "code.js", "x.svg", "issuer.crt", "none"}) {
    image_t image{};
    image.image_id = 100;
    image.agent = "mallory";
    image.name = name;
    image.blob_id = Keep(SmallJpeg(2, 640, 400));
    Commit(image);
    EXPECT_EQ(Get("/api/photos/100").content_type, "application/octet-stream") << name;
  }
}

TEST_F(SessionApiTest, MatchesAreTheVerifiedPairsStrongestFirst) {
  const json matches = GetJson("/api/photos/4/matches");
  ASSERT_GE(matches.size(), 3u);
  for (size_t i = 1; i < matches.size(); ++i) {
    EXPECT_GE(matches[i - 1]["inliers"], matches[i]["inliers"]);
  }
}

// The later photo's fact holds the pair; from the other side it is the same, the sides exchanged.
TEST_F(SessionApiTest, AMatchIsTheSameFromBothSides) {
  const json there = GetJson("/api/photos/4/matches/3")["points"];
  const json back = GetJson("/api/photos/3/matches/4")["points"];
  ASSERT_GT(there.size(), 20u);
  ASSERT_EQ(there.size(), back.size());
  for (size_t i = 0; i < there.size(); ++i) {
    EXPECT_EQ(there[i][0], back[i][2]);
    EXPECT_EQ(there[i][1], back[i][3]);
    EXPECT_EQ(there[i][2], back[i][0]);
  }
  for (const TwoViewPair& pair : scene_.pairs[3]) {
    if (pair.other_id != 3) continue;
    ASSERT_EQ(pair.inliers.size(), there.size());
    EXPECT_NEAR(scene_.photos[3].keypoints[pair.inliers[0].first].x, there[0][0].get<double>(),
                0.01);
    EXPECT_NEAR(scene_.photos[2].keypoints[pair.inliers[0].second].x, there[0][2].get<double>(),
                0.01);
  }
}

TEST_F(SessionApiTest, TheReportComesWithTheFirstFinish) {
  EXPECT_EQ(StatusOf("/api/report"), 404);
  std::ofstream(folder_ / "report.json") << "{}";
  EXPECT_EQ(Get("/api/report").file, folder_ / "report.json");
}

// While a finish runs, too: ingest takes an earlier deadline then.
TEST_F(SessionApiTest, AFinishIsAskedForWithItsSeconds) {
  std::vector<double> asked;
  source_.finish = [&asked](double within_s, const std::function<void(Status)>& done) {
    asked.push_back(within_s);
    done(Status::Ok());
  };
  api_ = std::make_unique<SessionApi>(view_, source_, 2);
  const auto ask = [this](const std::string& body) {
    HttpRequest request = *ParseTarget("/api/finish");
    request.method = "POST";
    request.body = body;
    std::promise<HttpResponse> answer;
    api_->Handle(request,
                 [&answer](HttpResponse response) { answer.set_value(std::move(response)); });
    return answer.get_future().get().status;
  };
  EXPECT_EQ(ask(""), 202);
  EXPECT_EQ(ask(R"({"within_s": 90.5})"), 202);
  EXPECT_EQ(ask(R"({"within_s": 30})"), 202);
  EXPECT_EQ(asked, (std::vector<double>{0, 90.5, 30}));
  for (const char* wrong :
       {R"({"within_s": -1})", R"({"within_s": 1e6})", R"({"within_s": "soon"})", "[", "[1]"}) {
    EXPECT_EQ(ask(wrong), 400) << wrong;
  }
  EXPECT_EQ(asked.size(), 3u);
}

TEST_F(SessionApiTest, MetricsAreThoseOfTheSession) {
  const HttpResponse response = Get("/metrics");
  EXPECT_EQ(response.status, 200);
  EXPECT_EQ(response.content_type, "text/plain; version=0.0.4; charset=utf-8");
  for (const char* line :
       {"\nskein_photos_accepted_total 8\n", "\nskein_disk_available_bytes ",
        "\nskein_submaps{state=\"live\"} 1\n", "\nskein_workers{stage=\"mapper\"} 0\n"}) {
    EXPECT_NE(response.text.find(line), std::string::npos) << line;
  }
  EXPECT_EQ(StatusOf("/metrics/x"), 404);
}

// Counters that begin at 0 once more would look like a second session's.
TEST_F(SessionApiTest, ThereAreNoMetricsBeforeTheLedgerIsRead) {
  std::atomic<bool> has_read_ledger{false};
  source_.has_read_ledger = [&has_read_ledger] { return has_read_ledger.load(); };
  source_.processes = [] {
    heartbeat_t beat{};
    beat.service = "mapper";
    return HeardProcesses{{"mapper-1", {beat, 0, 0}}};
  };
  api_ = std::make_unique<SessionApi>(view_, source_, 2);
  EXPECT_EQ(StatusOf("/metrics"), 503);
  has_read_ledger = true;
  EXPECT_NE(Get("/metrics").text.find("\nskein_workers{stage=\"mapper\"} 1\n"), std::string::npos);
}

TEST_F(SessionApiTest, PhotosThatTheDiskHoldsUpHoldUpNothingElse) {
  std::promise<void> disk_answers;
  source_.fetch = [answers = disk_answers.get_future().share()](
                      const std::string&, const std::string&, const SessionSource::Done& done) {
    answers.wait();
    done(NotFound("no blob"));
  };
  api_ = std::make_unique<SessionApi>(view_, source_, 2);
  std::vector<std::promise<HttpResponse>> photos(5);
  for (std::promise<HttpResponse>& photo : photos) {
    api_->Handle(*ParseTarget("/api/photos/1"),
                 [&photo](HttpResponse response) { photo.set_value(std::move(response)); });
  }
  std::promise<HttpResponse> report;
  api_->Handle(*ParseTarget("/api/report"),
               [&report](HttpResponse response) { report.set_value(std::move(response)); });
  EXPECT_EQ(report.get_future().wait_for(std::chrono::seconds(20)), std::future_status::ready);
  disk_answers.set_value();
  for (std::promise<HttpResponse>& photo : photos) EXPECT_EQ(photo.get_future().get().status, 404);
}

TEST_F(SessionApiTest, UploadsAreAnsweredByTheirOwner) {
  EXPECT_EQ(StatusOf("/api/uploads/states"), 404) << "nothing is uploaded here";
  source_.uploads = [](const std::string& name, const HttpRequest&, const Respond& respond) {
    respond(JsonResponse(name));
  };
  api_ = std::make_unique<SessionApi>(view_, source_, 2);
  EXPECT_EQ(Get("/api/uploads/states").text, "states");
  EXPECT_EQ(StatusOf("/api/uploads/states/x"), 404);
}

TEST_F(SessionApiTest, ModelsCanBeSaved) {
  const HttpResponse zip = Get("/download/model.zip");
  ASSERT_EQ(zip.status, 200) << zip.text;
  std::ifstream in(zip.file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  EXPECT_EQ(bytes.compare(0, 2, "PK"), 0);
  for (const char* name : {"0/cameras.bin", "0/images.bin", "0/points3D.bin"}) {
    EXPECT_NE(bytes.find(name), std::string::npos) << name;
  }
  std::filesystem::path kept;
  {
    const HttpResponse ply = Get("/download/points.ply");
    ASSERT_EQ(ply.status, 200) << ply.text;
    EXPECT_EQ(ply.download_name, "points.ply");
    kept = ply.file;
    EXPECT_TRUE(std::filesystem::exists(kept));
  }
  EXPECT_FALSE(std::filesystem::exists(kept)) << "it goes once it was sent";
  EXPECT_EQ(Get("/download/nerfstudio.zip").status, 200);
  EXPECT_EQ(StatusOf("/download/other"), 404);
}

// A worker's pair, or one of a folder that was sent: 8 bytes a match, and a hundred in the answer.
TEST_F(SessionApiTest, RefusesMoreMatchesThanAPhotoHasKeypoints) {
  matches_t matches{};
  for (size_t i = 0; i < scene_.pairs.size() && matches.num_pairs == 0; ++i) {
    if (scene_.pairs[i].empty()) continue;
    TwoViewPair pair = scene_.pairs[i].front();
    pair.inliers.assign(100'000, pair.inliers.front());
    two_view_t told{};
    told.other_id = pair.other_id;
    told.num_inliers = 100'000;
    matches.image_id = static_cast<int64_t>(i) + 1;
    matches.pairs = {told};
    matches.num_pairs = 1;
    matches.pairs_blob = Keep(EncodeTwoViewPairs({pair}));
  }
  ASSERT_EQ(matches.num_pairs, 1);
  Commit(matches);
  const HttpResponse answer = Get("/api/photos/" + std::to_string(matches.image_id) + "/matches/" +
                                  std::to_string(matches.pairs.front().other_id));
  EXPECT_NE(answer.status, 200);
  EXPECT_LT(answer.text.size(), 1000u);
}

// A guest who takes each file slowly, over many connections.
TEST_F(SessionApiTest, ADownloadThatIsBeingSentTakesNoRoomTwice) {
  std::vector<HttpResponse> sent;
  for (int i = 0; i < 64; ++i) sent.push_back(Get("/download/model.zip"));
  for (const HttpResponse& each : sent) EXPECT_EQ(each.file, sent.front().file);
  // Models that are replaced meanwhile.
  int num_refused = 0;
  for (int i = 0; i < 64; ++i) {
    AddModel("-" + std::to_string(i) + ".jpg");
    sent.push_back(Get("/download/model.zip"));
    num_refused += sent.back().status == 503;
  }
  EXPECT_GT(num_refused, 32);
  sent.clear();
  EXPECT_EQ(Get("/download/model.zip").status, 200);
}

TEST_F(SessionApiTest, ModelsCanBeSavedInMetres) {
  const HttpResponse zip = Get("/download/model.zip?georeferenced");
  ASSERT_EQ(zip.status, 200) << zip.text;
  std::ifstream in(zip.file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  EXPECT_NE(bytes.find("0/georeference.json"), std::string::npos);
  EXPECT_EQ(Get("/download/points.ply?georeferenced").status, 200);
}

TEST_F(SessionApiWithoutGpsTest, SaysWhyAModelIsNotInMetres) {
  const HttpResponse zip = Get("/download/model.zip?georeferenced");
  EXPECT_EQ(zip.status, 404);
  EXPECT_NE(zip.text.find("0 registered photos carry a position"), std::string::npos) << zip.text;
  EXPECT_EQ(Get("/download/model.zip").status, 200) << "the next one may be made";
}

TEST_F(SessionApiTest, WhatIsMissingIsAnError) {
  blobs_.clear();
  for (const char* path : {"/api/submaps/4", "/api/photos/2", "/api/photos/2/thumbnail",
                           "/api/photos/4/matches/3", "/download/model.zip"}) {
    EXPECT_EQ(StatusOf(path), 404) << path;
  }
  EXPECT_EQ(StatusOf("/download/points.ply"), 404) << "the next one may be made";
}

TEST_F(SessionApiTest, OtherPathsAreNone) {
  for (const char* path : {"/api", "/api/", "/api/none", "/api/session/x", "/api/submaps",
                           "/api/submaps/5", "/api/submaps/4/x", "/download", "/none"}) {
    EXPECT_EQ(StatusOf(path), 404) << path;
  }
  EXPECT_EQ(StatusOf("/api/submaps/x"), 400);
}

}  // namespace skein::session_api_test
