#include "clients/companions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace skein::companions_test {

namespace fs = std::filesystem;

// Takes the companions of these files of a folder "in", and names them.
std::vector<std::string> Companions(const std::vector<std::string>& names) {
  std::vector<fs::path> photos;
  for (const std::string& name : names) photos.push_back(fs::path("in") / name);
  std::vector<std::string> taken;
  for (const fs::path& path : TakeCompanions(&photos)) {
    taken.push_back(path.lexically_relative("in").string());
  }
  EXPECT_EQ(photos.size() + taken.size(), names.size());
  std::sort(taken.begin(), taken.end());
  return taken;
}

using Strings = std::vector<std::string>;

TEST(Companions, AreBesideTheirPhotoWithASuffix) {
  const Strings companions = {"1-mask.tif",   "1.depth.png", "1.jpg.mask.png",
                              "1_Depth.TIFF", "1_seg.png",   "1_segmentation.png"};
  Strings all = companions;
  all.push_back("1.jpg");
  EXPECT_EQ(Companions(all), companions);
  EXPECT_EQ(Companions(companions), Strings()) << "without the photo";
  EXPECT_EQ(Companions({"1.color.jpg", "1.depth.png"}), Strings{"1.depth.png"});
}

TEST(Companions, AreInAFolderBesideTheirPhotos) {
  EXPECT_EQ(Companions({"1.jpg", "depth/1.png"}), Strings{"depth/1.png"});
  EXPECT_EQ(Companions({"day/images/1.png", "day/Masks/1.png"}), Strings{"day/Masks/1.png"});
  EXPECT_EQ(Companions({"rgb/1.jpg", "masks/1.jpg.png"}), Strings{"masks/1.jpg.png"});
  EXPECT_EQ(Companions({"color/1.jpg", "depth_maps/1_depth.png"}),
            Strings{"depth_maps/1_depth.png"});
  EXPECT_EQ(Companions({"photos/1.jpg", "other/1_mask.png"}), Strings{"other/1_mask.png"});
}

TEST(Companions, AreNoneByTheirNameAlone) {
  EXPECT_EQ(Companions({"water_depth.png", "mask.png", "_mask.png", "masks/1.png"}), Strings());
  EXPECT_EQ(Companions({"depth/1.png", "depth/2.png", "masks/1.png"}), Strings());
  EXPECT_EQ(Companions({"masks/1.jpg", "masks/1.png"}), Strings()) << "a folder of photos";
  EXPECT_EQ(Companions({"1.jpg", "left/1.png", "masks/2.png"}), Strings());
  EXPECT_EQ(Companions({"1.jpg", "1_mask.jpg"}), Strings()) << "JPEG loses what they tell";
  EXPECT_EQ(Companions({"a/1.jpg", "b/1_mask.png"}), Strings());
}

TEST(Companions, AreToldByFolderOrSuffix) {
  EXPECT_EQ(KindOfCompanion("in/masks/1.png"), "in masks");
  EXPECT_EQ(KindOfCompanion("in/1_depth.png"), "*_depth.png");
  EXPECT_EQ(KindOfCompanion("in/1.jpg.mask.png"), "*.mask.png");
}

}  // namespace skein::companions_test
