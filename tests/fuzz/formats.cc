// The contents of blobs, one format a target.
#include "formats/formats.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {
namespace {

template <class Value>
void DecodeAndEncode(const uint8_t* data, size_t size, Result<Value> (*decode)(const Bytes&),
                     Bytes (*encode)(const Value&)) {
  const Bytes bytes = ToBytes(data, size);
  const Result<Value> value = decode(bytes);
  if (value.ok()) Expect(encode(*value) == bytes, "a value has one sequence of bytes");
}

}  // namespace

SKEIN_FUZZ_TARGET(keypoints) { DecodeAndEncode(data, size, DecodeKeypoints, EncodeKeypoints); }
SKEIN_FUZZ_TARGET(descriptors) {
  DecodeAndEncode(data, size, DecodeDescriptors, EncodeDescriptors);
}
SKEIN_FUZZ_TARGET(global_descriptor) {
  DecodeAndEncode(data, size, DecodeGlobalDescriptor, EncodeGlobalDescriptor);
}
SKEIN_FUZZ_TARGET(two_view_pairs) {
  DecodeAndEncode(data, size, DecodeTwoViewPairs, EncodeTwoViewPairs);
}
SKEIN_FUZZ_TARGET(model_archive) {
  DecodeAndEncode(data, size, DecodeModelArchive, EncodeModelArchive);
}
SKEIN_FUZZ_TARGET(shared_images) {
  DecodeAndEncode(data, size, DecodeSharedImages, EncodeSharedImages);
}

}  // namespace skein::fuzz
