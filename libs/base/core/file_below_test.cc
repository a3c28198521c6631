#include "core/file_below.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <climits>
#include <cstring>
#include <fstream>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein::file_below_test {

namespace fs = std::filesystem;

constexpr size_t kMany = 1 << 20;

// A root, and beside it what must stay as it is.
class FileBelowTest : public testing::Test {
 protected:
  FileBelowTest() {
    fs::create_directories(root_ / "a" / "b");
    fs::create_directories(outside_);
    std::ofstream(secret_) << "secret";
    std::ofstream(root_ / "a" / "file") << "content";
  }
  ~FileBelowTest() override { fs::remove_all(folder_); }

  static fs::path MakeFolder() {
    char name[] = "/tmp/skein_file_below_test_XXXXXX";
    return ::mkdtemp(name);
  }
  static std::string Text(const fs::path& file) {
    const Bytes bytes = *ReadFile(file.string());
    return {bytes.begin(), bytes.end()};
  }
  void ExpectUntouched() const {
    EXPECT_EQ(Text(secret_), "secret");
    EXPECT_EQ(FilesUnder(outside_).size(), 1u);
  }

  const fs::path folder_ = MakeFolder();
  const fs::path root_ = folder_ / "root";
  const fs::path outside_ = folder_ / "outside";
  const fs::path secret_ = outside_ / "secret";
};

TEST_F(FileBelowTest, ReadsAndWritesRegularFilesBelowTheRoot) {
  EXPECT_EQ(ReadFileBelow(root_, root_ / "a" / "file", kMany)->size(), 7u);
  ASSERT_TRUE(CreateFoldersBelow(root_, root_ / "c" / "d").ok());
  ASSERT_TRUE(CreateFoldersBelow(root_, root_ / "c" / "d").ok()) << "it is there";
  ASSERT_TRUE(CreateFoldersBelow(root_, root_).ok());
  ASSERT_TRUE(WriteFileBelow(root_, root_ / "c" / "d" / "new", Bytes{'1'}).ok());
  ASSERT_TRUE(WriteFileBelow(root_, root_ / "c" / "d" / "new", Bytes{'2'}).ok());
  EXPECT_EQ(Text(root_ / "c" / "d" / "new"), "2");
  EXPECT_EQ(FilesUnder(root_ / "c").size(), 1u);
  ASSERT_TRUE(RenameBelow(root_, root_ / "c" / "d" / "new", root_ / "moved").ok());
  EXPECT_EQ(Text(root_ / "moved"), "2");
  EXPECT_EQ(ReadFileBelow(root_, root_ / "none", kMany).code(), StatusCode::kNotFound);
}

TEST_F(FileBelowTest, TheRootItselfMayBeALink) {
  fs::create_directory_symlink(root_, folder_ / "link");
  EXPECT_TRUE(ReadFileBelow(folder_ / "link", folder_ / "link" / "a" / "file", kMany).ok());
}

TEST_F(FileBelowTest, RefusesPathsThatLeaveTheRoot) {
  for (const fs::path& path : {root_ / ".." / "outside" / "secret", root_ / "a" / ".." / ".." / "x",
                               secret_, fs::path("/etc/passwd"), root_}) {
    EXPECT_EQ(ReadFileBelow(root_, path, kMany).code(), StatusCode::kInvalidArgument) << path;
    EXPECT_FALSE(WriteFileBelow(root_, path, Bytes{'1'}).ok()) << path;
  }
  EXPECT_FALSE(RenameBelow(root_, root_ / "a" / "file", secret_).ok());
  ExpectUntouched();
}

TEST_F(FileBelowTest, FollowsNoLinkInTheLastComponent) {
  fs::create_symlink(secret_, root_ / "link");
  EXPECT_EQ(ReadFileBelow(root_, root_ / "link", kMany).code(), StatusCode::kInvalidArgument);
  for (const int flags : {O_WRONLY, O_WRONLY | O_APPEND, O_RDWR | O_CREAT, O_WRONLY | O_TRUNC}) {
    EXPECT_FALSE(OpenFileBelow(root_, root_ / "link", flags).ok());
  }
  EXPECT_FALSE(IsFileBelow(root_, root_ / "link"));
  ExpectUntouched();
  ASSERT_TRUE(WriteFileBelow(root_, root_ / "link", Bytes{'1'}).ok()) << "the link is replaced";
  EXPECT_FALSE(fs::is_symlink(root_ / "link"));
  ExpectUntouched();
}

TEST_F(FileBelowTest, FollowsNoLinkOnTheWay) {
  fs::create_directory_symlink(outside_, root_ / "link");
  const Result<Bytes> read = ReadFileBelow(root_, root_ / "link" / "secret", kMany);
  EXPECT_EQ(read.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(read.error().find("link is a symbolic link"), std::string::npos) << read.error();
  EXPECT_FALSE(WriteFileBelow(root_, root_ / "link" / "new", Bytes{'1'}).ok());
  EXPECT_FALSE(CreateFoldersBelow(root_, root_ / "link" / "new").ok());
  EXPECT_FALSE(RenameBelow(root_, root_ / "a" / "file", root_ / "link" / "new").ok());
  EXPECT_FALSE(IsFileBelow(root_, root_ / "link" / "secret"));
  EXPECT_TRUE(FilesUnder(root_ / "link").empty());
  EXPECT_EQ(FilesUnder(root_).size(), 1u);
  ExpectUntouched();
}

// Opening one of these would wait for ever.
TEST_F(FileBelowTest, RefusesFifosSocketsAndDevicesAtOnce) {
  ASSERT_EQ(::mkfifo((root_ / "fifo").c_str(), 0600), 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strcpy(address.sun_path, (root_ / "socket").c_str());
  const FileDescriptor bound(::socket(AF_UNIX, SOCK_STREAM, 0));
  ASSERT_EQ(::bind(bound.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  for (const char* name : {"fifo", "socket"}) {
    const Result<Bytes> read = ReadFileBelow(root_, root_ / name, kMany);
    EXPECT_EQ(read.code(), StatusCode::kInvalidArgument) << name;
    EXPECT_FALSE(OpenFileBelow(root_, root_ / name, O_WRONLY).ok()) << name;
    EXPECT_FALSE(ReadFile((root_ / name).string()).ok()) << name;
  }
  EXPECT_FALSE(ReadFileBelow("/dev", "/dev/zero", kMany).ok());
  EXPECT_FALSE(ReadFileBelow(root_, root_ / "fifo" / "x", kMany).ok()) << "as a folder";
  const std::vector<OddEntry> odd = OddEntriesUnder(root_);
  ASSERT_EQ(odd.size(), 2u);
  EXPECT_EQ(odd[0].kind, "a FIFO");
  EXPECT_EQ(odd[1].kind, "a socket");
}

TEST_F(FileBelowTest, DoesNotWriteInPlaceWhatHasASecondName) {
  fs::create_hard_link(secret_, root_ / "hard");
  EXPECT_FALSE(OpenFileBelow(root_, root_ / "hard", O_WRONLY | O_APPEND).ok());
  EXPECT_TRUE(ReadFileBelow(root_, root_ / "hard", kMany).ok());
  EXPECT_FALSE(CheckFileBelow(root_, root_ / "hard").ok());
  EXPECT_TRUE(CheckFileBelow(root_, root_ / "a" / "file").ok());
  EXPECT_TRUE(CheckFileBelow(root_, root_ / "none").ok());
  ASSERT_TRUE(WriteFileBelow(root_, root_ / "hard", Bytes{'1'}).ok());
  ExpectUntouched();
}

TEST_F(FileBelowTest, ReadsNoMoreThanIsAllowed) {
  EXPECT_TRUE(ReadFileBelow(root_, root_ / "a" / "file", 7).ok());
  EXPECT_EQ(ReadFileBelow(root_, root_ / "a" / "file", 6).code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(ReadFile((root_ / "a" / "file").string(), 6).code(), StatusCode::kInvalidArgument);
}

TEST_F(FileBelowTest, CopiesRegularFilesAndLeavesTheRestOut) {
  fs::create_symlink(secret_, root_ / "a" / "link");
  ASSERT_EQ(::mkfifo((root_ / "a" / "fifo").c_str(), 0600), 0);
  const fs::path to = folder_ / "to";
  fs::create_directory(to);
  ASSERT_TRUE(CopyFilesBelow(root_, root_ / "a", to, to / "copy", kMany).ok());
  ASSERT_TRUE(CopyFilesBelow(root_, root_ / "none", to, to / "none", kMany).ok());
  ASSERT_EQ(FilesUnder(to).size(), 1u);
  EXPECT_EQ(Text(to / "copy" / "file"), "content");
  EXPECT_TRUE(OddEntriesUnder(to).empty());
}

// A link that lies deeper than this process may have folders open, or than a path can tell.
TEST_F(FileBelowTest, NoDepthHidesAnEntry) {
  rlimit limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_NOFILE, &limit), 0);
  const rlimit few{64, limit.rlim_max};
  fs::path deep = root_;
  for (rlim_t i = 0; i < 2 * few.rlim_cur; ++i) deep /= "d";
  fs::create_directories(deep);
  fs::create_symlink(secret_, deep / "link");
  std::ofstream(deep / "file") << "x";
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
  const std::vector<OddEntry> odd = OddEntriesUnder(root_);
  const size_t num_files = FilesUnder(root_).size();
  ASSERT_EQ(::setrlimit(RLIMIT_NOFILE, &limit), 0);
  ASSERT_EQ(odd.size(), 1u);
  EXPECT_EQ(odd[0].path, deep / "link");
  EXPECT_EQ(num_files, 2u);
}

TEST_F(FileBelowTest, WhatCannotBeReadIsOdd) {
  const std::string name(NAME_MAX, 'n');
  FileDescriptor folder(::open(root_.c_str(), O_RDONLY | O_DIRECTORY));
  for (int i = 0; i <= PATH_MAX / NAME_MAX; ++i) {
    ASSERT_EQ(::mkdirat(folder.get(), name.c_str(), 0755), 0);
    folder = FileDescriptor(::openat(folder.get(), name.c_str(), O_RDONLY | O_DIRECTORY));
  }
  const std::vector<OddEntry> odd = OddEntriesUnder(root_);
  ASSERT_EQ(odd.size(), 1u);
  EXPECT_EQ(odd[0].kind, "an entry that cannot be read (File name too long)");
}

TEST_F(FileBelowTest, HashesAFileAndWhatIsBeforeItsEnd) {
  EXPECT_EQ(*HashFileBelow(root_, root_ / "a" / "file"), HashBytes("content", 7));
  EXPECT_EQ(*HashFileBelow(root_, root_ / "a" / "file", 3), HashBytes("cont", 4));
  EXPECT_EQ(*HashFileBelow(root_, root_ / "a" / "file", 7), HashBytes("", 0));
  EXPECT_EQ(HashFileBelow(root_, root_ / "a" / "file", 8).code(), StatusCode::kDataLoss);
  Bytes large(3'000'000, 7);
  ASSERT_TRUE(WriteFileBelow(root_, root_ / "large", large).ok());
  EXPECT_EQ(*HashFileBelow(root_, root_ / "large"), HashBytes(large.data(), large.size()));
}

TEST_F(FileBelowTest, WritesANameAsLongAsFileSystemsTake) {
  const fs::path file = root_ / std::string(255, 'x');
  const Status written = WriteFileBelow(root_, file, Bytes{1, 2});
  EXPECT_TRUE(written.ok()) << written.error();
  EXPECT_EQ(fs::file_size(file), 2u);
}

}  // namespace skein::file_below_test
