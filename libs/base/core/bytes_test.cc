#include "core/bytes.h"

#include <gtest/gtest.h>

#include "core/result.h"

namespace skein::bytes_test {

TEST(Bytes, ReadsBackWhatWasWritten) {
  ByteWriter writer;
  writer.Put<int32_t>(-7);
  writer.Put(2.5);
  writer.PutString("skein");
  writer.PutBytes({1, 2, 3});
  writer.PutString("");
  const Bytes bytes = writer.Take();
  EXPECT_EQ(writer.size(), 0u);

  ByteReader reader(bytes);
  int32_t number = 0;
  double real = 0;
  std::string text, empty = "x";
  Bytes blob;
  ASSERT_TRUE(reader.Get(&number) && reader.Get(&real) && reader.GetString(&text));
  ASSERT_TRUE(reader.GetBytes(&blob) && reader.GetString(&empty));
  EXPECT_EQ(number, -7);
  EXPECT_EQ(real, 2.5);
  EXPECT_EQ(text, "skein");
  EXPECT_EQ(blob, (Bytes{1, 2, 3}));
  EXPECT_EQ(empty, "");
  EXPECT_EQ(reader.remaining(), 0u);
}

TEST(Bytes, RefusesToReadBeyondTheEndAndConsumesNothing) {
  const Bytes bytes = {1, 2, 3};
  ByteReader reader(bytes);
  int32_t number = 5;
  EXPECT_FALSE(reader.Get(&number));
  EXPECT_EQ(number, 5);
  EXPECT_EQ(reader.remaining(), 3u);
  EXPECT_FALSE(reader.Skip(4));
}

TEST(Bytes, RefusesALengthThatTheBufferDoesNotHold) {
  ByteWriter writer;
  writer.Put<uint64_t>(~uint64_t{0});
  writer.Put<uint8_t>(1);
  ByteReader reader(writer.bytes());
  Bytes blob;
  std::string text;
  EXPECT_FALSE(reader.GetBytes(&blob));
  EXPECT_FALSE(reader.GetString(&text));
  EXPECT_EQ(reader.remaining(), 9u);
}

TEST(Result, HoldsAValueOrAnError) {
  Result<int> good = 3;
  Result<int> bad = Result<int>::Error("no");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(*good, 3);
  EXPECT_EQ(good.error(), "");
  EXPECT_FALSE(bad.ok());
  EXPECT_EQ(bad.error(), "no");
  EXPECT_THROW(bad.value(), std::logic_error);
  EXPECT_THROW(Result<int>{Status::Ok()}, std::logic_error);
}

TEST(Result, KeepsTheCodeOfAFailure) {
  const Result<int> missing = NotFound("no blob");
  EXPECT_EQ(missing.code(), StatusCode::kNotFound);
  EXPECT_EQ(missing.status().code, StatusCode::kNotFound);
  EXPECT_EQ(Result<int>(3).code(), StatusCode::kOk);
  EXPECT_EQ(Result<int>(3).status().code, StatusCode::kOk);
}

TEST(Status, NamesWhereItFailedWithoutLosingItsCode) {
  const Status damaged = DataLoss("cut short").Within("a.bin");
  EXPECT_EQ(damaged.code, StatusCode::kDataLoss);
  EXPECT_EQ(damaged.error(), "a.bin: cut short");
  EXPECT_TRUE(Status::Ok().Within("a.bin").ok());
}

TEST(Result, HoldsAStringAsValue) {
  Result<std::string> value = std::string("text");
  ASSERT_TRUE(value.ok());
  EXPECT_EQ(*value, "text");
}

}  // namespace skein::bytes_test
