#include "clients/photo_folder.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <chrono>

#include "clients/folder_walk.h"
#include "clients/folder_watch.h"
#include "codecs/exif_reader.h"
#include "core/file.h"
#include "testing/test_folder.h"
#include "testing/test_photos.h"

namespace skein::photo_folder_test {

namespace fs = std::filesystem;

class PhotoFolderTest : public testing::Test {
 protected:
  fs::path Write(const std::string& name, const Bytes& bytes) {
    const fs::path path = folder_ / name;
    fs::create_directories(path.parent_path());
    EXPECT_TRUE(WriteFileAtomic(path.string(), bytes).ok());
    return path;
  }
  std::vector<std::string> Names(const std::string& order) const {
    std::vector<std::string> names;
    for (const PhotoFile& photo : ListPhotos(folder_.path(), *ParsePhotoOrder(order))) {
      names.push_back(photo.name);
    }
    return names;
  }

  TestFolder folder_;
};

TEST_F(PhotoFolderTest, TellsWhatIsNoPhoto) {
  EXPECT_EQ(FindOtherFiles(folder_.path()).kinds, "");
  Write("a.jpg", {1});
  Write("b.TIF", {1});
  Write(".DS_Store", {1});
  EXPECT_EQ(FindOtherFiles(folder_.path()).kinds, "");
  for (const char* name : {"c.HEIC", "deeper/d.heic", "walk.mp4", "README"}) Write(name, {1});
  EXPECT_EQ(FindOtherFiles(folder_.path()).kinds, "2 .heic, 1 .mp4, 1 without an extension");
  for (const char* name : {"1.a", "1.b", "1.c", "1.d", "1.e"}) Write(name, {1});
  EXPECT_EQ(FindOtherFiles(folder_.path()).kinds,
            "2 .heic, 1 .a, 1 .b, 1 .c, 1 .d, 1 .e, 2 others");
}

TEST_F(PhotoFolderTest, TellsHeifByItsBytes) {
  Write("a.heic", {1, 2, 3});
  EXPECT_FALSE(FindOtherFiles(folder_.path()).have_heif);
  Write("b.img",
        {0, 0, 0, 20, 'f', 't', 'y', 'p', 'h', 'e', 'i', 'c', 0, 0, 0, 0, 'm', 'i', 'f', '1'});
  EXPECT_TRUE(FindOtherFiles(folder_.path()).have_heif);
}

// A phone's photo: rotated, with position, time and focal length.
ExifBuilder PhoneExif() {
  ExifBuilder exif;
  exif.Short(0, 0x0112, 6);
  exif.Ascii(1, 0x9003, "2023:05:06 07:08:09");
  exif.Short(1, 0xa405, 26);
  exif.Ascii(2, 1, "N");
  exif.Rationals(2, 2, {{48, 1}, {30, 1}, {0, 1}});
  exif.Ascii(2, 3, "E");
  exif.Rationals(2, 4, {{11, 1}, {15, 1}, {0, 1}});
  return exif;
}

Bytes WithTime(const std::string& time, uint64_t seed) {
  ExifBuilder exif;
  exif.Ascii(1, 0x9003, time);
  return exif.Into(SmallJpeg(seed));
}

void PutBigEndian(Bytes* out, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out->push_back(static_cast<uint8_t>(value >> shift));
}

// The PNG with the block in a chunk right after its header.
Bytes PngWithExif(const Bytes& png, const Bytes& tiff) {
  constexpr size_t kHeaderEnd = 8 + 12 + 13;
  Bytes chunk = {'e', 'X', 'I', 'f'};
  chunk.insert(chunk.end(), tiff.begin(), tiff.end());
  Bytes out(png.begin(), png.begin() + kHeaderEnd);
  PutBigEndian(&out, static_cast<uint32_t>(tiff.size()));
  out.insert(out.end(), chunk.begin(), chunk.end());
  PutBigEndian(&out,
               static_cast<uint32_t>(crc32(0, chunk.data(), static_cast<unsigned>(chunk.size()))));
  out.insert(out.end(), png.begin() + kHeaderEnd, png.end());
  return out;
}

TEST(PhotoOrder, ReadsWhatTheUserMayWrite) {
  EXPECT_EQ(ParsePhotoOrder("name")->kind, PhotoOrder::Kind::kName);
  EXPECT_EQ(ParsePhotoOrder("time")->kind, PhotoOrder::Kind::kTime);
  EXPECT_EQ(ParsePhotoOrder("shuffle:42")->kind, PhotoOrder::Kind::kShuffle);
  EXPECT_EQ(ParsePhotoOrder("shuffle:42")->seed, 42u);
  for (const std::string text : {"", "random", "shuffle", "shuffle:", "shuffle:x", "shuffle:-1",
                                 "shuffle:1 ", "names", "shuffle:99999999999999999999"}) {
    EXPECT_FALSE(ParsePhotoOrder(text).ok()) << text;
  }
}

TEST_F(PhotoFolderTest, ListsPhotosOfAllFoldersByName) {
  for (const std::string name : {"b.JPG", "a.jpeg", "left/c.png", "left/deep/d.TIF", "e.tiff"}) {
    Write(name, SmallJpeg());
  }
  for (const std::string name : {"notes.txt", "jpg", "f.jpg.part", ".jpg/inner.txt"}) {
    Write(name, SmallJpeg());
  }
  EXPECT_EQ(Names("name"), (std::vector<std::string>{"a.jpeg", "b.JPG", "e.tiff", "left/c.png",
                                                     "left/deep/d.TIF"}));
}

TEST_F(PhotoFolderTest, FollowsLinksAndTellsThoseThatLeadNowhere) {
  const TestFolder elsewhere;
  ASSERT_TRUE(WriteFileAtomic((elsewhere / "a.jpg").string(), SmallJpeg()).ok());
  fs::create_directory_symlink(elsewhere.path(), folder_ / "linked");
  fs::create_symlink(elsewhere / "none.jpg", folder_ / "dangling.jpg");
  fs::create_symlink("itself.jpg", folder_ / "itself.jpg");
  EXPECT_EQ(Names("name"), std::vector<std::string>{"linked/a.jpg"});
  EXPECT_EQ(FindOtherFiles(folder_.path()).dangling, "dangling.jpg, itself.jpg");
}

TEST_F(PhotoFolderTest, SkipsWhatIsHiddenThumbnailsAndTrash) {
  Write("a.jpg", {1});
  Write("day 1/b.jpg", {1});
  const char* skipped[] = {"._a.jpg",
                           ".cover.jpg",
                           ".thumbnails/normal/a.png",
                           ".Trash-1000/files/old.jpg",
                           "@eaDir/a.jpg/SYNOPHOTO_THUMB_XL.jpg",
                           "day 1/@eaDir/b.jpg/SYNOPHOTO_THUMB_M.jpg",
                           "day 1/._b.jpg",
                           "Thumbs/a.jpg",
                           "__MACOSX/day 1/._b.jpg",
                           "#recycle/old.jpg",
                           "$Recycle.Bin/S-1/old.jpg"};
  for (const char* name : skipped) Write(name, {1});
  Write("@eaDir/a.jpg/SYNOINDEX_MEDIA_INFO", {1});
  EXPECT_EQ(Names("name"), (std::vector<std::string>{"a.jpg", "day 1/b.jpg"}));
  const OtherFiles others = FindOtherFiles(folder_.path());
  EXPECT_EQ(others.skipped,
            "2 ._*, 2 in @eaDir, 1 .cover.jpg, 1 in #recycle, 1 in $Recycle.Bin, "
            "1 in .Trash-1000, 3 others");
  EXPECT_EQ(others.kinds, "") << "what is in there is nobody's";
}

TEST_F(PhotoFolderTest, TellsDepthMapsAndMasksBesidePhotos) {
  for (const char* name : {"images/1.jpg", "images/1_depth.png", "masks/1.png", "masks/2.png"}) {
    Write(name, {1});
  }
  EXPECT_EQ(Names("name"), (std::vector<std::string>{"images/1.jpg", "masks/2.png"}));
  EXPECT_EQ(FindOtherFiles(folder_.path()).companions, "1 *_depth.png, 1 in masks");
  Write("images/2.jpg", {1});
  EXPECT_EQ(FindOtherFiles(folder_.path()).companions, "2 in masks, 1 *_depth.png");
}

TEST_F(PhotoFolderTest, ReadsAFolderWhoseOwnNameIsHidden) {
  Write(".photos/a.jpg", {1});
  EXPECT_EQ(ListPhotos(folder_ / ".photos", PhotoOrder()).size(), 1u);
}

TEST_F(PhotoFolderTest, ReadsEachFolderOnceAndNoneAbove) {
  const TestFolder elsewhere;
  ASSERT_TRUE(WriteFileAtomic((elsewhere / "x.jpg").string(), Bytes{1}).ok());
  Write("trip/z/a.jpg", {1});
  Write("beside/b.jpg", {1});
  const fs::path trip = folder_ / "trip";
  fs::create_directory_symlink("..", trip / "up");
  fs::create_directory_symlink(".", trip / "itself");
  fs::create_directory_symlink("z", trip / "before z");
  fs::create_directory_symlink("/", trip / "z" / "root");
  fs::create_directory_symlink(elsewhere.path(), trip / "y1");
  fs::create_directory_symlink(elsewhere.path(), trip / "y2");
  std::vector<std::string> names;
  for (const PhotoFile& photo : ListPhotos(trip, PhotoOrder())) names.push_back(photo.name);
  EXPECT_EQ(names, (std::vector<std::string>{"y1/x.jpg", "z/a.jpg"}));
  EXPECT_EQ(FindOtherFiles(trip).repeated, "before z, itself, up, y2, z/root");
}

TEST_F(PhotoFolderTest, ThrowsWhereTheFolderItselfCannotBeRead) {
  EXPECT_THROW(WalkFolder(folder_ / "none"), fs::filesystem_error);
  Write("a.jpg", {1});
  EXPECT_THROW(WalkFolder(folder_ / "a.jpg"), fs::filesystem_error);
}

TEST_F(PhotoFolderTest, OrdersByCaptureTimeElseByThatOfTheFile) {
  Write("a.jpg", WithTime("2023:01:01 00:00:03", 1));
  Write("b.jpg", WithTime("2023:01:01 00:00:01", 2));
  Write("d.jpg", WithTime("2023:01:01 00:00:02", 3));
  Write("c.jpg", WithTime("2023:01:01 00:00:02", 4));
  const fs::path bare = Write("0.jpg", SmallJpeg(5));
  const fs::path text = Write("1.jpg", {'t', 'e', 'x', 't'});
  const auto now = fs::file_time_type::clock::now();
  fs::last_write_time(bare, now);
  fs::last_write_time(text, now - std::chrono::hours(1));
  EXPECT_EQ(Names("time"),
            (std::vector<std::string>{"b.jpg", "c.jpg", "d.jpg", "a.jpg", "1.jpg", "0.jpg"}));
}

TEST_F(PhotoFolderTest, ShufflesAlikeForOneSeedEverywhere) {
  for (int i = 0; i < 8; ++i) Write(std::to_string(i) + ".jpg", {1});
  const std::vector<std::string> shuffled = Names("shuffle:1");
  EXPECT_EQ(shuffled, Names("shuffle:1"));
  EXPECT_NE(shuffled, Names("shuffle:2"));
  EXPECT_NE(shuffled, Names("name"));
  std::vector<std::string> sorted = shuffled;
  std::sort(sorted.begin(), sorted.end());
  EXPECT_EQ(sorted, Names("name"));
}

TEST_F(PhotoFolderTest, SendsPhotosAsTheyAreWhenTheyAreSmallEnough) {
  const Bytes photo = PhoneExif().Into(SmallJpeg(1, 640, 480));
  const fs::path path = Write("a.jpg", photo);
  EXPECT_EQ(*ReadPhoto(path, 0), photo);
  EXPECT_EQ(*ReadPhoto(path, 640), photo);
  EXPECT_NE(*ReadPhoto(path, 639), photo);
}

TEST_F(PhotoFolderTest, ShrinksAPhotoAndKeepsWhatItSaysOfItself) {
  const Bytes photo = PhoneExif().Into(SmallJpeg(1, 640, 480));
  const Bytes small = *ReadPhoto(Write("a.jpg", photo), 320);
  const PhotoHeader header = *ReadPhotoHeader(small);
  EXPECT_EQ(header.width_px, 320) << "as stored: not turned";
  EXPECT_EQ(header.height_px, 240);
  const Exif before = ReadExif(photo, *ReadPhotoHeader(photo));
  const Exif after = ReadExif(small, header);
  EXPECT_EQ(after.orientation, 6);
  EXPECT_EQ(after.capture_utime_us, before.capture_utime_us);
  ASSERT_TRUE(after.gps && after.focal_px && before.focal_px);
  EXPECT_DOUBLE_EQ(after.gps->latitude_deg, 48.5);
  EXPECT_DOUBLE_EQ(after.gps->longitude_deg, 11.25);
  EXPECT_NEAR(*after.focal_px, 0.5 * *before.focal_px, 1e-9) << "of the size that is sent";
}

TEST_F(PhotoFolderTest, ShrinksADronesPhotoWithItsXmp) {
  const std::string packet =
      std::string("http://ns.adobe.com/xap/1.0/") + '\0' +
      "<x xmlns:d=\"http://www.dji.com/drone-dji/1.0/\" d:GpsLatitude=\"48.5\" "
      "d:GpsLongitude=\"11.25\" d:RelativeAltitude=\"70.1\"/>";
  Bytes photo = SmallJpeg(1, 640, 480);
  Bytes segment = {0xff, 0xe1, 0, static_cast<uint8_t>(packet.size() + 2)};
  segment.insert(segment.end(), packet.begin(), packet.end());
  photo.insert(photo.begin() + 2, segment.begin(), segment.end());
  const Bytes small = *ReadPhoto(Write("a.jpg", photo), 320);
  const Exif exif = ReadExif(small, *ReadPhotoHeader(small));
  ASSERT_TRUE(exif.gps);
  EXPECT_EQ(exif.gps->latitude_deg, 48.5);
  EXPECT_EQ(exif.gps->relative_altitude_m, 70.1);
}

TEST_F(PhotoFolderTest, ShrinksAMirroredPhotoAsItIsStored) {
  cv::Mat image(480, 640, CV_8UC3, cv::Scalar::all(20));
  image.colRange(0, 320).setTo(cv::Scalar::all(220));
  ExifBuilder exif;
  exif.Short(0, 0x0112, 2);
  const Bytes small = *ReadPhoto(Write("a.jpg", exif.Into(Encode(image, ".jpg"))), 320);
  EXPECT_EQ(ReadExif(small, *ReadPhotoHeader(small)).orientation, 2);
  const cv::Mat stored = cv::imdecode(small, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
  EXPECT_NEAR(stored.at<cv::Vec3b>(100, 40)[0], 220, 5);
  EXPECT_NEAR(stored.at<cv::Vec3b>(100, 280)[0], 20, 5);
}

TEST_F(PhotoFolderTest, ShrinksADeepPhotoByItsOwnRange) {
  cv::Mat1w counts(300, 400, uint16_t{7000});
  counts.colRange(200, 400).setTo(8900);
  const Bytes small = *ReadPhoto(Write("a.tiff", Encode(counts, ".tiff")), 200);
  const cv::Mat shrunk = cv::imdecode(small, cv::IMREAD_COLOR);
  EXPECT_NEAR(shrunk.at<cv::Vec3b>(70, 40)[0], 0, 5);
  EXPECT_NEAR(shrunk.at<cv::Vec3b>(70, 160)[0], 255, 5);
}

TEST_F(PhotoFolderTest, ShrinksAPngToAJpegWithItsExif) {
  const Bytes plain = Encode(Noise(300, 200), ".png");
  const Bytes small = *ReadPhoto(Write("a.png", PngWithExif(plain, PhoneExif().Tiff())), 150);
  const PhotoHeader header = *ReadPhotoHeader(small);
  EXPECT_EQ(header.format, PhotoFormat::kJpeg);
  EXPECT_EQ(header.width_px, 150);
  EXPECT_EQ(ReadExif(small, header).orientation, 6);
  EXPECT_TRUE(ReadExif(small, header).gps);
  const Bytes without = *ReadPhoto(Write("b.png", plain), 150);
  EXPECT_FALSE(ReadExif(without, *ReadPhotoHeader(without)).gps);
}

TEST_F(PhotoFolderTest, NeverShrinksToNothing) {
  const Bytes small = *ReadPhoto(Write("a.png", Encode(Noise(2000, 2), ".png")), 64);
  EXPECT_EQ(ReadPhotoHeader(small)->width_px, 64);
  EXPECT_EQ(ReadPhotoHeader(small)->height_px, 1);
}

TEST_F(PhotoFolderTest, LeavesWhatCannotBeDecodedToIngest) {
  const Bytes text = {'t', 'e', 'x', 't'};
  EXPECT_EQ(*ReadPhoto(Write("text.jpg", text), 64), text);
  const Bytes bomb = WithClaimedSize(SmallJpeg(), 60000, 60000);
  EXPECT_EQ(*ReadPhoto(Write("bomb.jpg", bomb), 64), bomb);
  EXPECT_EQ(*ReadPhoto(Write("empty.jpg", {}), 64), Bytes());
  EXPECT_FALSE(ReadPhoto(folder_ / "none.jpg", 64).ok());
}

// Each format, cut anywhere, or of full size with zeros in place of what is still to come.
TEST_F(PhotoFolderTest, TakesAPhotoAsWholeOnlyWhenNothingIsMissing) {
  cv::Mat image(300, 400, CV_8UC3);
  cv::randu(image, 0, 255);
  for (const char* extension : {".jpg", ".png", ".tiff"}) {
    const Bytes photo = Encode(image, extension);
    const std::string name = std::string("a") + extension;
    EXPECT_EQ(*ReadWholePhoto(Write(name, photo), 0), photo) << extension;
    EXPECT_EQ(ReadPhotoHeader(*ReadWholePhoto(folder_ / name, 200))->width_px, 200) << extension;
    for (const double share : {0.0, 0.001, 0.1, 0.5, 0.9, 0.999}) {
      const auto size = static_cast<size_t>(share * static_cast<double>(photo.size()));
      Bytes cut(photo.begin(), photo.begin() + static_cast<ptrdiff_t>(size));
      EXPECT_FALSE(ReadWholePhoto(Write(name, cut), 0).ok()) << extension << " cut at " << share;
      cut.resize(photo.size());
      EXPECT_FALSE(ReadWholePhoto(Write(name, cut), 0).ok()) << extension << " zeros at " << share;
    }
  }
}

class FolderWatchTest : public PhotoFolderTest {
 protected:
  std::vector<std::string> Scan() {
    std::vector<std::string> names;
    for (const PhotoFile& photo : watch_.Scan()) names.push_back(photo.name);
    return names;
  }

  FolderWatch watch_{folder_.path(), PhotoOrder()};
};

TEST_F(FolderWatchTest, GivesEachNewPhotoOnce) {
  Write("old.jpg", {1});
  watch_.Skip(ListPhotos(folder_.path(), PhotoOrder()));
  Write("b.jpg", {1});
  Write("a.jpg", {1});
  EXPECT_EQ(Scan(), std::vector<std::string>()) << "it may still grow";
  EXPECT_EQ(Scan(), (std::vector<std::string>{"a.jpg", "b.jpg"}));
  EXPECT_EQ(Scan(), std::vector<std::string>());
}

TEST_F(FolderWatchTest, WaitsForPhotosThatAreStillWritten) {
  Write("a.jpg", {});
  EXPECT_EQ(Scan(), std::vector<std::string>());
  EXPECT_EQ(Scan(), std::vector<std::string>()) << "created, nothing written yet";
  Write("a.jpg", {1});
  EXPECT_EQ(Scan(), std::vector<std::string>());
  Write("a.jpg", {1, 2});
  EXPECT_EQ(Scan(), std::vector<std::string>());
  EXPECT_EQ(Scan(), std::vector<std::string>{"a.jpg"});
}

TEST_F(FolderWatchTest, GivesNoDepthMapWhosePhotoComesInTime) {
  Write("1_depth.png", {1});
  Write("2_depth.png", {1});
  EXPECT_EQ(Scan(), std::vector<std::string>());
  Write("1.jpg", {1});
  EXPECT_EQ(Scan(), std::vector<std::string>{"2_depth.png"}) << "no photo of it is there yet";
  Write("2.jpg", {1});
  EXPECT_EQ(Scan(), std::vector<std::string>{"1.jpg"});
  EXPECT_EQ(Scan(), std::vector<std::string>{"2.jpg"});
}

TEST_F(FolderWatchTest, TellsThatTheFolderIsGone) {
  EXPECT_FALSE(watch_.is_gone());
  fs::remove_all(folder_.path());
  EXPECT_EQ(Scan(), std::vector<std::string>());
  EXPECT_TRUE(watch_.is_gone());
  Write("a.jpg", {1});
  Scan();
  EXPECT_FALSE(watch_.is_gone());
  EXPECT_EQ(Scan(), std::vector<std::string>{"a.jpg"});
}

TEST_F(FolderWatchTest, GivesAPhotoAgainWhenSizeOrTimeChange) {
  const fs::path path = Write("a.jpg", {1});
  watch_.Skip(ListPhotos(folder_.path(), PhotoOrder()));
  Scan();
  EXPECT_EQ(Scan(), std::vector<std::string>());
  Write("a.jpg", {1, 2});
  EXPECT_EQ(Scan(), std::vector<std::string>()) << "it may still change";
  const std::vector<PhotoFile> larger = watch_.Scan();
  ASSERT_EQ(larger.size(), 1u);
  EXPECT_TRUE(larger[0].has_changed);
  EXPECT_EQ(Scan(), std::vector<std::string>());
  fs::last_write_time(path, fs::last_write_time(path) + std::chrono::milliseconds(1));
  EXPECT_EQ(Scan(), std::vector<std::string>());
  EXPECT_EQ(Scan(), std::vector<std::string>{"a.jpg"}) << "of the same size";
  Write("b.jpg", {1});
  Scan();
  EXPECT_FALSE(watch_.Scan().at(0).has_changed) << "it is new";
}

TEST_F(FolderWatchTest, ForgetsNothingWhileTheFolderIsGone) {
  const fs::path elsewhere = folder_.path().string() + "-elsewhere";
  Write("a.jpg", {1});
  watch_.Skip(ListPhotos(folder_.path(), PhotoOrder()));
  fs::rename(folder_.path(), elsewhere);
  Scan();
  EXPECT_TRUE(watch_.is_gone());
  fs::rename(elsewhere, folder_.path());
  for (int i = 0; i < 3; ++i) EXPECT_EQ(Scan(), std::vector<std::string>());
}

}  // namespace skein::photo_folder_test
