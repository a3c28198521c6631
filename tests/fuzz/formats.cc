// The contents of blobs, one format a target: FORMAT is its name in formats/formats.h.
#include "formats/formats.h"

#include "fuzz/fuzz.h"

#define SKEIN_JOIN_2(a, b) a##b
#define SKEIN_JOIN(a, b) SKEIN_JOIN_2(a, b)

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const Bytes bytes = fuzz::ToBytes(data, size);
  const auto value = SKEIN_JOIN(Decode, FORMAT)(bytes);
  if (value.ok()) {
    fuzz::Expect(SKEIN_JOIN(Encode, FORMAT)(*value) == bytes, "a value has one sequence of bytes");
  }
  return 0;
}
