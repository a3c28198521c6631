// Common parts of the encodings in this folder: header, arrays, lists whose counts are held against
// the bytes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"

namespace skein::encoding {

inline constexpr uint32_t kVersion = 1;

inline ByteWriter Begin(const char* identifier) {
  ByteWriter writer;
  writer.PutRaw(identifier, 4);
  writer.Put(kVersion);
  return writer;
}

inline Status CheckHeader(ByteReader* reader, const std::string& identifier) {
  char found[4];
  uint32_t version = 0;
  if (!reader->GetRaw(found, 4) || !reader->Get(&version)) {
    return DataLoss(identifier + ": too short for a header");
  }
  if (std::string(found, 4) != identifier) return DataLoss(identifier + ": not of this format");
  if (version != kVersion) {
    return DataLoss(identifier + ": version " + std::to_string(version) + " is unknown");
  }
  return Status::Ok();
}

template <class T, size_t N>
void PutArray(ByteWriter* writer, const std::array<T, N>& values) {
  writer->PutRaw(values.data(), sizeof(T) * N);
}

template <class T, size_t N>
bool GetArray(ByteReader* reader, std::array<T, N>* values) {
  return reader->GetRaw(values->data(), sizeof(T) * N);
}

// Reads a count of items of at least `min_item_bytes` each. A damaged count cannot make the caller
// allocate more than the blob holds.
inline bool GetCount(ByteReader* reader, size_t min_item_bytes, uint32_t* count) {
  return reader->Get(count) && *count <= reader->remaining() / min_item_bytes;
}

// Runs `read`, and checks that it consumed everything.
template <class T, class Read>
Result<T> DecodeAll(const Bytes& bytes, const char* identifier, Read read) {
  ByteReader reader(bytes);
  if (Status status = CheckHeader(&reader, identifier); !status.ok()) return status;
  T value;
  if (!read(&reader, &value)) return DataLoss(std::string(identifier) + ": cut short");
  if (reader.remaining() > 0) {
    return DataLoss(std::string(identifier) + ": bytes left over");
  }
  return value;
}

// Reads a count, then as many items.
template <class T, class Read>
bool GetVector(ByteReader* reader, size_t min_item_bytes, std::vector<T>* items, Read read) {
  uint32_t count = 0;
  if (!GetCount(reader, min_item_bytes, &count)) return false;
  items->resize(count);
  for (T& item : *items) {
    if (!read(reader, &item)) return false;
  }
  return true;
}

}  // namespace skein::encoding
