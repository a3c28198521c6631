#include "photo/heif.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "photo/photo_check.h"

namespace skein::heif_test {

Bytes FileOf(const std::string& major, const std::vector<std::string>& compatible) {
  std::string box = "ftyp" + major + std::string(4, '\0');
  for (const std::string& brand : compatible) box += brand;
  box = std::string(3, '\0') + static_cast<char>(box.size() + 4) + box;
  box += std::string(100, '\1') + "heic";  // what follows tells nothing
  return Bytes(box.begin(), box.end());
}

std::string NameOf(const Bytes& file) {
  const char* name = HeifName(file);
  return name == nullptr ? "" : name;
}

TEST(Heif, IsToldByTheBrandsOfItsFirstBox) {
  EXPECT_EQ(NameOf(FileOf("heic", {"mif1", "heic"})), "HEIC");  // an iPhone's
  EXPECT_EQ(NameOf(FileOf("mif1", {"mif1", "heic"})), "HEIC");
  EXPECT_EQ(NameOf(FileOf("heic", {})), "HEIC");
  EXPECT_EQ(NameOf(FileOf("abcd", {"efgh", "hevc"})), "HEIC");
  EXPECT_EQ(NameOf(FileOf("avif", {"avif", "mif1"})), "AVIF");
  EXPECT_EQ(NameOf(FileOf("mif1", {"miaf", "avif"})), "AVIF");
}

TEST(Heif, IsNotToldOfOtherFiles) {
  EXPECT_EQ(NameOf(FileOf("isom", {"isom", "mp42"})), "");  // a video
  EXPECT_EQ(NameOf(FileOf("qt  ", {})), "");
  EXPECT_EQ(NameOf({}), "");
  EXPECT_EQ(NameOf({0xff, 0xd8, 0xff, 0xe0}), "");
  const Bytes whole = FileOf("heic", {"mif1"});
  EXPECT_EQ(NameOf(Bytes(whole.begin(), whole.begin() + 15)), "");
}

TEST(Heif, ClaimsOfTheBoxLeadNowhere) {
  Bytes file = FileOf("abcd", {"efgh"});
  for (const uint8_t byte : {uint8_t{0}, uint8_t{0xff}}) {
    file[0] = file[1] = file[2] = file[3] = byte;
    EXPECT_EQ(NameOf(file), "");
  }
}

TEST(Heif, IsRefusedWithWhatToDo) {
  const Result<PhotoHeader> header = CheckHeader(FileOf("heic", {"mif1"}), {});
  ASSERT_FALSE(header.ok());
  EXPECT_EQ(header.status().error().rfind("HEIC photo: JPEG, PNG and TIFF are taken", 0), 0u);
  EXPECT_NE(header.status().error().find("Most Compatible"), std::string::npos);
}

}  // namespace skein::heif_test
