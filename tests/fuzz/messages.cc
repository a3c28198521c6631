// LCM messages of every type, as Bus and the ledger decode them. The first byte is the type's
// number, the rest the message without its fingerprint.
#include <algorithm>
#include <vector>

#include "fuzz/fuzz.h"
#include "fuzz/message_types.h"
#include "transport/decode.h"

namespace {

using namespace skein;

template <class T>
Bytes Encode(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class T>
void Decode(const uint8_t* data, size_t size) {
  Bytes bytes = Encode(T());
  bytes.resize(8);
  bytes.insert(bytes.end(), data, data + size);
  T message;
  if (!DecodeMessage(bytes.data(), bytes.size(), &message)) return;
  const TypeLayout& layout = TypeLayout::Of(T::getTypeName());
  layout.HasValidTexts(data, size);
  const Bytes again = Encode(message);
  T second;
  fuzz::Expect(DecodeMessage(again.data(), again.size(), &second), "what is encoded is decoded");
  fuzz::Expect(Encode(second) == again, "and is the same");
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  std::vector<std::string> names;
  for (size_t i = 0; i < fuzz::kNumMessageTypes; ++i) {
    fuzz::WithMessageType(i, [&](auto type) { names.push_back(decltype(type)::getTypeName()); });
  }
  std::vector<std::string> all = TypeLayout::AllNames();
  std::sort(names.begin(), names.end());
  std::sort(all.begin(), all.end());
  fuzz::Expect(names == all, "all_types.h lists all types of lcmtypes/");
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  fuzz::WithMessageType(data[0] % fuzz::kNumMessageTypes,
                        [&](auto type) { Decode<decltype(type)>(data + 1, size - 1); });
  return 0;
}
