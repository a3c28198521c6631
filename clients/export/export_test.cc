// What `skein export` reads out of a session folder, and what it writes.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <stdexcept>

#include "blobs/blob_store.h"
#include "clients/export/database.h"
#include "clients/export/photo_source.h"
#include "clients/export/unmirrored.h"
#include "core/file.h"
#include "export/model_writer.h"
#include "export/session_models.h"
#include "formats/formats.h"
#include "geometry/model_poses.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"
#include "session/read_session.h"
#include "sfm/database.h"
#include "sfm/model_files.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"

namespace skein::export_test {

namespace fs = std::filesystem;

// Photos side by side that see the same four points, one camera.
Reconstruction MakeModel(int num_photos, const std::string& camera_model) {
  Reconstruction model;
  Camera camera;
  camera.SetCameraId(1);
  camera.InitializeWithName(camera_model, 1000, 1200, 900);
  model.AddCamera(camera);
  for (int i = 0; i < num_photos; ++i) {
    Image image;
    image.SetImageId(i + 1);
    image.SetCameraId(1);
    image.SetName("alice/" + std::to_string(i) + ".jpg");
    image.SetPoints2D(std::vector<Eigen::Vector2d>(4, Eigen::Vector2d(600, 450)));
    image.SetQvec(Eigen::Vector4d(1, 0, 0, 0));
    image.SetTvec(Eigen::Vector3d(-i, 0, 0));
    model.AddImage(image);
    model.RegisterImage(i + 1);
  }
  for (int p = 0; p < 4; ++p) {
    Track track;
    for (int i = 0; i < num_photos; ++i) track.AddElement(i + 1, p);
    model.AddPoint3D(Eigen::Vector3d(p, 1, 5), track);
  }
  return model;
}

Bytes ArchiveOf(const Reconstruction& model, const fs::path& scratch) {
  fs::create_directories(scratch);
  EXPECT_TRUE(WriteModelBinary(model, scratch).ok());
  ModelArchive archive;
  for (const char* name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    archive[name] = *ReadFile((scratch / name).string());
  }
  return EncodeModelArchive(archive);
}

class ExportTest : public testing::Test {
 protected:
  ExportTest() : ledger_(*Ledger::Open(paths_.Ledger())) {}

  template <class T>
  void Commit(T fact, const std::string& fact_id) {
    fact.header.fact_id = fact_id;
    fact.header.seq = ledger_->head() + 1;
    const Fact any = fact;
    ASSERT_TRUE(
        ledger_->Append({{fact.header.seq, fact_id, FactKindName(any), 1, EncodeFact(any)}}).ok());
  }
  std::string Put(const Bytes& bytes) { return *BlobStore(paths_.Blobs()).Put(bytes); }

  // A model of so many photos.
  void CommitModel(int64_t submap_id, int8_t kind, int num_photos) {
    submap_model_t model{};
    model.submap_id = submap_id;
    model.kind = kind;
    model.num_images = num_photos;
    model.ledger_seq = ledger_->head();
    model.model_blob = Put(ArchiveOf(MakeModel(num_photos, "SIMPLE_RADIAL"), folder_ / "tmp"));
    Commit(model, "model/" + std::to_string(ledger_->head()));
  }
  void CommitPhoto(int64_t id, const std::vector<int64_t>& others) {
    image_t image{};
    image.image_id = id;
    image.camera_id = 1;
    image.agent = "alice";
    image.name = std::to_string(id) + ".jpg";
    image.width_px = 1200;
    image.height_px = 900;
    image.focal_px = 1000;
    image.focal_from_exif = 1;
    image.has_gps = id == 1;
    image.latitude_deg = 48.5;
    Commit(image, "image/" + std::to_string(id));
    features_t features{};
    features.image_id = id;
    features.num_keypoints = 2;
    Keypoints keypoints(2);
    keypoints[1].x = static_cast<float>(id);
    keypoints[1].scale_px = 2;
    features.keypoints_blob = Put(EncodeKeypoints(keypoints));
    Descriptors descriptors;
    descriptors.data.assign(2 * 128, static_cast<uint8_t>(id));
    features.descriptors_blob = Put(EncodeDescriptors(descriptors));
    Commit(features, "features/" + std::to_string(id));
    TwoViewPairs pairs;
    for (const int64_t other : others) {
      TwoViewPair pair;
      pair.other_id = other;
      pair.geometry = 2;
      pair.inliers = {{0, 1}, {1, 0}};
      pairs.push_back(pair);
    }
    matches_t matches{};
    matches.image_id = id;
    if (!pairs.empty()) matches.pairs_blob = Put(EncodeTwoViewPairs(pairs));
    Commit(matches, "matches/" + std::to_string(id));
  }
  std::vector<ExportModel> Models() const {
    auto models = ReadSessionModels(paths_);
    EXPECT_TRUE(models.ok()) << models.error();
    return models.ok() ? std::move(*models) : std::vector<ExportModel>();
  }

  // Of CommitStoredPhoto.
  image_t Photo(const std::string& name) const {
    const auto state = ReadSession(*ledger_);
    for (const auto& [id, photo] : state->photos()) {
      if (photo.image.agent + "/" + photo.image.name == name) return photo.image;
    }
    throw std::logic_error("no photo " + name);
  }

  // Left half bright, as stored.
  void CommitStoredPhoto(int64_t id, int orientation, const std::string& agent = "alice") {
    cv::Mat pixels(80, 96, CV_8UC3, cv::Scalar::all(20));
    pixels.colRange(0, 48).setTo(cv::Scalar::all(220));
    ExifBuilder exif;
    exif.Short(0, 0x0112, static_cast<uint16_t>(orientation));
    image_t image{};
    image.image_id = id;
    image.agent = agent;
    image.name = std::to_string(id) + ".jpg";
    image.orientation = static_cast<int8_t>(orientation);
    image.blob_id = Put(exif.Into(Encode(pixels, ".jpg")));
    Commit(image, "image/" + std::to_string(id));
  }

  TestFolder folder_;
  const SessionPaths paths_{folder_.path()};
  std::unique_ptr<Ledger> ledger_;
};

TEST_F(ExportTest, WritesMirroredPhotosAsTheModelsHaveThem) {
  const fs::path out = folder_ / "unmirrored";
  CommitStoredPhoto(1, 1);
  CommitStoredPhoto(2, 6);
  EXPECT_EQ(*WriteUnmirrored(paths_, out), 0);
  EXPECT_FALSE(fs::exists(out));
  CommitStoredPhoto(3, 5);
  ASSERT_EQ(*WriteUnmirrored(paths_, out), 1);
  const cv::Mat flipped = cv::imread((out / "alice" / "3.jpg").string());
  ASSERT_EQ(flipped.size(), cv::Size(96, 80));
  EXPECT_NEAR(flipped.at<cv::Vec3b>(40, 10)[0], 20, 5);
  EXPECT_NEAR(flipped.at<cv::Vec3b>(40, 85)[0], 220, 5);
}

// A ledger that somebody sent may name any agent.
TEST_F(ExportTest, WritesNoMirroredPhotoOutsideOfItsFolder) {
  const fs::path victim = folder_ / "elsewhere" / "1.jpg";
  fs::create_directories(victim.parent_path());
  ASSERT_TRUE(WriteFileAtomic(victim.string(), std::string("mine")).ok());
  CommitStoredPhoto(1, 5, "../elsewhere");
  EXPECT_FALSE(WriteUnmirrored(paths_, folder_ / "unmirrored").ok());
  EXPECT_EQ(fs::file_size(victim), 4u);
}

TEST_F(ExportTest, WritesNoMirroredPhotoWhereAnAbsoluteNameLeads) {
  fs::create_directories(folder_ / "elsewhere");
  CommitStoredPhoto(1, 5, (folder_ / "elsewhere").string());
  EXPECT_FALSE(WriteUnmirrored(paths_, folder_ / "unmirrored").ok());
  EXPECT_TRUE(fs::is_empty(folder_ / "elsewhere"));
}

TEST_F(ExportTest, PhotosAreAsTheModelsHaveThem) {
  CommitStoredPhoto(1, 6);
  CommitStoredPhoto(2, 2);
  const Result<PhotoSource> of_session = PhotosOfSession(paths_);
  ASSERT_TRUE(of_session.ok()) << of_session.error();
  const fs::path folder = folder_ / "photos";
  fs::create_directories(folder / "alice");
  for (const char* name : {"alice/1.jpg", "alice/2.jpg"}) {
    const image_t image = Photo(name);
    ASSERT_TRUE(
        WriteFileAtomic((folder / name).string(), *BlobStore(paths_.Blobs()).Get(image.blob_id))
            .ok());
  }
  const Result<PhotoSource> of_folder = PhotosOfFolder(folder);
  ASSERT_TRUE(of_folder.ok()) << of_folder.error();
  for (const PhotoSource& photos : {*of_session, *of_folder}) {
    const Result<cv::Mat3b> turned = photos("alice/1.jpg");
    ASSERT_TRUE(turned.ok()) << turned.error();
    EXPECT_EQ(turned->size(), cv::Size(96, 80)) << "as stored";
    EXPECT_NEAR((*turned)(40, 10)[0], 220, 5);
    const Result<cv::Mat3b> mirrored = photos("alice/2.jpg");
    ASSERT_TRUE(mirrored.ok()) << mirrored.error();
    EXPECT_NEAR((*mirrored)(40, 10)[0], 20, 5);
    EXPECT_FALSE(photos("alice/3.jpg").ok());
  }
  EXPECT_FALSE((*of_folder)("../images/alice/1.jpg").ok()) << "a name that leaves the folder";
}

TEST_F(ExportTest, TakesTheNewestModelOfEachLivingSubmapLargestFirst) {
  CommitModel(1, submap_model_t::CHECKPOINT, 2);
  CommitModel(2, submap_model_t::CHECKPOINT, 3);
  CommitModel(3, submap_model_t::CHECKPOINT, 9);
  CommitModel(1, submap_model_t::FINAL, 5);
  submap_lease_t lease{};
  lease.submap_id = 1;
  Commit(lease, "lease");
  submap_end_t end{};
  end.submap_id = 3;
  Commit(end, "end");
  const std::vector<ExportModel> models = Models();
  ASSERT_EQ(models.size(), 2u);
  EXPECT_EQ(models[0].reconstruction->NumRegImages(), 5u);
  EXPECT_EQ(models[0].label, "map 1, final at 3");
  EXPECT_EQ(models[1].reconstruction->NumRegImages(), 3u);
  EXPECT_EQ(models[1].label, "map 2, checkpoint at 1");
}

TEST_F(ExportTest, FallsBackOnTheFinishedModels) {
  EXPECT_TRUE(Models().empty());
  fs::create_directories(paths_.Sparse() / "0");
  ASSERT_TRUE(WriteModelBinary(MakeModel(4, "SIMPLE_RADIAL"), paths_.Sparse() / "0").ok());
  ASSERT_EQ(Models().size(), 1u);
  EXPECT_EQ(Models()[0].reconstruction->NumRegImages(), 4u);
}

TEST_F(ExportTest, SaysWhichModelIsDamaged) {
  CommitModel(1, submap_model_t::CHECKPOINT, 3);
  submap_model_t submap{};
  submap.submap_id = 2;
  submap.kind = submap_model_t::CHECKPOINT;
  submap.model_blob = Put({1, 2, 3});
  Commit(submap, "submap/damaged");
  EXPECT_FALSE(ReadSessionModels(paths_).ok());
}

TEST_F(ExportTest, ReadsThePositionsOfPhotosThatHaveOne) {
  CommitPhoto(1, {});
  CommitPhoto(2, {});
  const auto positions = ReadPositions(paths_);
  ASSERT_TRUE(positions.ok()) << positions.error();
  ASSERT_EQ(positions->size(), 1u);
  EXPECT_EQ(positions->at("alice/1.jpg").latitude_deg, 48.5);
}

TEST_F(ExportTest, DatabaseHoldsWhatColmapNeeds) {
  CommitPhoto(1, {});
  CommitPhoto(2, {1});
  CommitPhoto(3, {1, 2});
  candidates_t candidates{};
  candidates.image_id = 3;
  candidates.other_ids = {1, 2};
  candidates.distances = {0.5F, 0.75F};
  candidates.num_candidates = 2;
  Commit(candidates, "candidates/3");
  const fs::path file = folder_ / "database.db";
  const auto counts = WriteDatabase(paths_, file);
  ASSERT_TRUE(counts.ok()) << counts.error();
  EXPECT_EQ(counts->images, 3);
  EXPECT_EQ(counts->pairs, 3);
  const ColmapDatabase database(file.string());
  EXPECT_EQ(database.NumCameras(), 1u);
  EXPECT_EQ(database.ReadCamera(1).MeanFocalLength(), 1000);
  EXPECT_TRUE(database.ReadCamera(1).HasPriorFocalLength());
  EXPECT_EQ(database.ReadAllImages().at(1).Name(), "alice/2.jpg");
  ASSERT_EQ(database.ReadKeypoints(2).size(), 2u);
  EXPECT_EQ(database.ReadKeypoints(2)[1].x, 2);
  EXPECT_NEAR(database.ReadKeypoints(2)[1].scale_px, 2, 1e-5);
  EXPECT_EQ(database.ReadDescriptors(3).row(1)[127], 3);
  const auto geometry = database.ReadTwoViewGeometry(3, 1);
  EXPECT_EQ(geometry.config, 2);
  ASSERT_EQ(geometry.inlier_matches.size(), 2u);
  EXPECT_EQ(geometry.inlier_matches[0].point2D_idx1, 0u);
  EXPECT_EQ(geometry.inlier_matches[0].point2D_idx2, 1u);
  EXPECT_FALSE(WriteDatabase(paths_, file).ok()) << "it is there already";
}

// colmap.github.io/database.html, by SQL alone.
TEST_F(ExportTest, DatabaseIsAsColmapDocumentsIt) {
  CommitPhoto(1, {});
  CommitPhoto(2, {1});
  const fs::path file = folder_ / "database.db";
  ASSERT_TRUE(WriteDatabase(paths_, file).ok());
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open_v2(file.c_str(), &db, SQLITE_OPEN_READONLY, nullptr), SQLITE_OK);
  const auto query = [&](const std::string& sql) {
    std::string row;
    sqlite3_stmt* statement = nullptr;
    EXPECT_EQ(sqlite3_prepare_v2(db, sql.c_str(), -1, &statement, nullptr), SQLITE_OK) << sql;
    while (sqlite3_step(statement) == SQLITE_ROW) {
      for (int i = 0; i < sqlite3_column_count(statement); ++i) {
        const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement, i));
        row += std::string(row.empty() ? "" : " ") + (text == nullptr ? "NULL" : text);
      }
    }
    sqlite3_finalize(statement);
    return row;
  };
  // 2: SIMPLE_RADIAL. params: f, cx, cy, k as doubles; f = 1000.
  EXPECT_EQ(query("SELECT camera_id, model, width, height, prior_focal_length, length(params), "
                  "hex(substr(params, 1, 8)) FROM cameras"),
            "1 2 1200 900 1 32 0000000000408F40");
  EXPECT_EQ(query("SELECT image_id, name, camera_id FROM images ORDER BY image_id"),
            "1 alice/1.jpg 1 2 alice/2.jpg 1");
  // x, y and an affine shape, as floats.
  EXPECT_EQ(query("SELECT rows, cols, length(data) FROM keypoints WHERE image_id = 2"), "2 6 48");
  EXPECT_EQ(query("SELECT rows, cols, length(data), hex(substr(data, 1, 1)) FROM descriptors "
                  "WHERE image_id = 2"),
            "2 128 256 02");
  // pair_id = 2147483647 * smaller id + larger id; columns: keypoint of the smaller, of the larger.
  for (const char* table : {"matches", "two_view_geometries"}) {
    EXPECT_EQ(query("SELECT pair_id, rows, cols, hex(data) FROM " + std::string(table)),
              "2147483649 2 2 01000000000000000000000001000000");
  }
  EXPECT_EQ(query("SELECT config FROM two_view_geometries"), "2");
  sqlite3_close(db);
}

TEST_F(ExportTest, LeavesNoHalfDatabase) {
  CommitPhoto(1, {});
  features_t features{};
  features.image_id = 1;
  features.keypoints_blob = std::string(64, 'a');
  Commit(features, "features/lost");
  const fs::path file = folder_ / "database.db";
  const auto counts = WriteDatabase(paths_, file);
  ASSERT_FALSE(counts.ok());
  EXPECT_NE(counts.error().find("features/lost"), std::string::npos) << counts.error();
  EXPECT_FALSE(fs::exists(file));
}

TEST(ModelWriter, ColmapFormatsReadBackAlike) {
  const Reconstruction model = MakeModel(3, "OPENCV");
  for (const char* format : {"bin", "text"}) {
    const TestFolder folder;
    ASSERT_TRUE(WriteModel(model, format, folder.path()).ok()) << format;
    const auto read = ReadModelFolder(folder.path());
    ASSERT_TRUE(read.ok()) << read.error();
    EXPECT_EQ(read->reconstruction->NumRegImages(), 3u);
    EXPECT_EQ(read->reconstruction->NumPoints3D(), 4u);
    EXPECT_EQ(read->reconstruction->Camera(1).Params(), model.Camera(1).Params());
    EXPECT_LT((read->reconstruction->Image(3).ProjectionCenter() - Eigen::Vector3d(2, 0, 0)).norm(),
              1e-9);
  }
}

TEST(ModelWriter, WritesTheFilesOfEachFormat) {
  const std::pair<std::string, std::vector<std::string>> expected[] = {
      {"ply", {"points.ply"}},
      {"nerfstudio", {"transforms.json", "points.ply"}},
      {"bundler", {"bundle.out", "bundle.out.list.txt"}},
      {"nvm", {"model.nvm"}}};
  const Reconstruction model = MakeModel(3, "SIMPLE_RADIAL");
  for (const auto& [format, files] : expected) {
    const TestFolder folder;
    const Status written = WriteModel(model, format, folder.path());
    EXPECT_TRUE(written.ok()) << format << ": " << written.error();
    for (const std::string& file : files) EXPECT_GT(fs::file_size(folder / file), 0u) << file;
  }
}

TEST(ModelWriter, SaysWhatAFormatCannotHold) {
  const TestFolder folder;
  const Reconstruction model = MakeModel(3, "OPENCV");
  for (const char* format : {"bundler", "nvm"}) {
    const Status written = WriteModel(model, format, folder.path());
    ASSERT_FALSE(written.ok()) << format;
    EXPECT_NE(written.error().find("OPENCV"), std::string::npos) << written.error();
  }
  EXPECT_FALSE(WriteModel(model, "obj", folder.path()).ok());
}

TEST(ModelWriter, TellsThatAFolderCannotBeWrittenTo) {
  const TestFolder folder;
  EXPECT_FALSE(WriteModel(MakeModel(3, "SIMPLE_RADIAL"), "nerfstudio", folder / "none").ok());
}

}  // namespace skein::export_test
