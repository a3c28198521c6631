#include "blobs/blob_store.h"

#include <gtest/gtest.h>

#include <fstream>
#include <thread>

#include "core/hash.h"
#include "testing/test_folder.h"

namespace skein::blob_store_test {

const Bytes kContent = {1, 2, 3, 0, 255};

TEST(BlobStore, ReturnsWhatWasPutUnderItsHash) {
  TestFolder folder;
  BlobStore store(folder / "blobs");
  const auto id = store.Put(kContent);
  ASSERT_TRUE(id.ok()) << id.error();
  EXPECT_EQ(*id, HashBytes(kContent.data(), kContent.size()));
  EXPECT_TRUE(store.Has(*id));
  EXPECT_EQ(*store.Get(*id), kContent);
}

TEST(BlobStore, KeepsAnEmptyBlob) {
  TestFolder folder;
  BlobStore store(folder / "blobs");
  const auto id = store.Put({});
  ASSERT_TRUE(id.ok()) << id.error();
  EXPECT_TRUE(store.Get(*id)->empty());
}

TEST(BlobStore, KnowsNoMissingBlobAndNoPathAsId) {
  TestFolder folder;
  BlobStore store(folder / "blobs");
  EXPECT_FALSE(store.Has(std::string(64, 'a')));
  EXPECT_FALSE(store.Get(std::string(64, 'a')).ok());
  EXPECT_FALSE(store.Has("../../etc/passwd"));
  EXPECT_FALSE(store.Get("../../etc/passwd").ok());
  EXPECT_THROW(store.Path("../../etc/passwd"), std::invalid_argument);
}

TEST(BlobStore, NoticesAndMendsADamagedBlob) {
  TestFolder folder;
  BlobStore store(folder / "blobs");
  const std::string id = *store.Put(kContent);
  std::ofstream(store.Path(id), std::ios::binary | std::ios::trunc) << "other";
  EXPECT_FALSE(store.Get(id).ok());
  ASSERT_TRUE(store.Put(kContent).ok());
  EXPECT_EQ(*store.Get(id), kContent);
}

TEST(BlobStore, SaysWhyItCannotWrite) {
  TestFolder folder;
  std::ofstream(folder / "blobs") << "a file where the folder should be";
  BlobStore store(folder / "blobs");
  const auto id = store.Put(kContent);
  ASSERT_FALSE(id.ok());
  EXPECT_NE(id.error().find("blobs"), std::string::npos);
}

TEST(BlobStore, WritersOfOneBlobDoNotDisturbEachOther) {
  TestFolder folder;
  const Bytes content(100000, 7);
  std::vector<std::thread> writers;
  for (int i = 0; i < 4; ++i) {
    writers.emplace_back([&] {
      BlobStore store(folder / "blobs");
      for (int round = 0; round < 5; ++round) EXPECT_TRUE(store.Put(content).ok());
    });
  }
  for (auto& writer : writers) writer.join();
  BlobStore store(folder / "blobs");
  EXPECT_EQ(*store.Get(HashBytes(content.data(), content.size())), content);
}

}  // namespace skein::blob_store_test
