#include "photo/photo_name.h"

#include <gtest/gtest.h>

namespace skein::photo_name_test {

TEST(PhotoName, TakesWhatCamerasAndFoldersCallPhotos) {
  for (const std::string name : {"P1180141.JPG", "a", "left/0001.png", "with space.jpg",
                                 "\xe5\x86\x99\xe7\x9c\x9f.jpg", "..jpg", "a..b/c...d"}) {
    EXPECT_TRUE(CheckPhotoName(name).ok()) << name;
  }
  EXPECT_TRUE(CheckPhotoName(std::string(255, 'a')).ok());
}

TEST(PhotoName, RefusesPathTraversal) {
  for (const std::string name :
       {"../a.jpg", "a/../b.jpg", "a/..", "..", "/etc/passwd", "//a", "a//b", "a/", "./a", "."}) {
    EXPECT_FALSE(CheckPhotoName(name).ok()) << name;
  }
}

TEST(PhotoName, RefusesEmptyLongAndUnprintable) {
  EXPECT_FALSE(CheckPhotoName("").ok());
  EXPECT_FALSE(CheckPhotoName(std::string(256, 'a')).ok());
  EXPECT_FALSE(CheckPhotoName(std::string(300, 'a')).ok());
  EXPECT_FALSE(CheckPhotoName("a\nb").ok());
  EXPECT_FALSE(CheckPhotoName("a\x7f").ok());
  EXPECT_FALSE(CheckPhotoName(std::string("a\0b", 3)).ok());
}

// U+009B begins a terminal's command as ESC [ does; U+202E shows "gpj.exe" as "exe.jpg".
constexpr const char* kControls[] = {"\xc2\x80",     "\xc2\x9b",     "\xc2\x9f",
                                     "\xe2\x80\xa8", "\xe2\x80\xaa", "\xe2\x80\xae",
                                     "\xe2\x81\xa6", "\xe2\x81\xa9"};
// Their neighbours: no-break space, non-breaking hyphen and more.
constexpr const char* kShown[] = {"\xc2\xa0",     "\xe2\x80\xa7", "\xe2\x80\xaf",
                                  "\xe2\x81\xa5", "\xe2\x81\xaa", "\xf0\x9f\x93\xb7"};

TEST(PhotoName, RefusesControlCharactersBeyondAscii) {
  for (const std::string control : kControls) {
    EXPECT_FALSE(CheckPhotoName("a" + control + "b").ok());
    EXPECT_FALSE(CheckAgentName(control).ok());
  }
  for (const std::string shown : kShown) EXPECT_TRUE(CheckPhotoName("a" + shown + "b").ok());
}

TEST(PhotoName, RefusesInvalidUtf8) {
  for (const std::string name :
       {"\xff", "\xc3", "\xc0\xaf", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\xe2\x82", "a\x80"}) {
    const Status status = CheckPhotoName(name);
    ASSERT_FALSE(status.ok());
    EXPECT_NE(status.error().find("UTF-8"), std::string::npos);
  }
}

TEST(AgentName, IsOnePathComponent) {
  EXPECT_TRUE(CheckAgentName("alice").ok());
  EXPECT_TRUE(CheckAgentName(std::string(64, 'a')).ok());
  for (const std::string agent : {"", "..", ".hidden", "a/b", "/a", "a\\b", "a\tb", "\xff"}) {
    EXPECT_FALSE(CheckAgentName(agent).ok()) << agent;
  }
  EXPECT_FALSE(CheckAgentName(std::string(65, 'a')).ok());
}

TEST(Printable, ShowsWhatATerminalCanAndNoMore) {
  EXPECT_EQ(Printable("a\x1b[31mb\xff"), "a?[31mb?");
  EXPECT_EQ(Printable("\xc3\xa9"), "\xc3\xa9");
  for (const std::string control : kControls) EXPECT_EQ(Printable(control + "31m"), "?31m");
  for (const std::string shown : kShown) EXPECT_EQ(Printable(shown), shown);
  EXPECT_EQ(Printable(std::string(200, 'x'), 10), "xxxxxxxxxx...");
}

TEST(NumberedName, KeepsFolderAndExtension) {
  EXPECT_EQ(NumberedName("a/b.jpg", 2), "a/b~2.jpg");
  EXPECT_EQ(NumberedName("b", 3), "b~3");
  EXPECT_EQ(NumberedName("a.d/b", 2), "a.d/b~2");
  EXPECT_EQ(NumberedName(".jpg", 2), ".jpg~2");
}

TEST(NumberedName, StaysValidWhenTheNameIsAsLongAsCanBe) {
  const std::string numbered = NumberedName(std::string(251, 'a') + ".jpg", 12);
  EXPECT_EQ(numbered.size(), 255u);
  EXPECT_TRUE(CheckPhotoName(numbered).ok());
  std::string accents;
  while (accents.size() < 250) accents += "\xc3\xa9";
  EXPECT_TRUE(CheckPhotoName(NumberedName(accents + ".jpg", 2)).ok());
}

}  // namespace skein::photo_name_test
