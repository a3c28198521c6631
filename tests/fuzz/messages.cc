// LCM messages of every type, as Bus and the ledger decode them. The first byte is the type's
// number, the rest the message without its fingerprint.
#include <algorithm>
#include <vector>

#include "fuzz/fuzz.h"
#include "fuzz/message_types.h"
#include "transport/decode.h"

namespace skein::fuzz {
namespace {

template <class T>
Bytes EncodeMessage(const T& message) {
  Bytes bytes(message.getEncodedSize());
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

template <class T>
void DecodeAndEncodeMessage(const uint8_t* data, size_t size) {
  Bytes bytes = EncodeMessage(T());
  bytes.resize(8);
  bytes.insert(bytes.end(), data, data + size);
  T message;
  if (!DecodeMessage(bytes.data(), bytes.size(), &message)) return;
  const TypeLayout& layout = TypeLayout::Of(T::getTypeName());
  layout.HasValidTexts(data, size);
  const Bytes again = EncodeMessage(message);
  T second;
  Expect(DecodeMessage(again.data(), again.size(), &second), "what is encoded is decoded");
  Expect(EncodeMessage(second) == again, "and is the same");
}

bool HasAllTypes() {
  std::vector<std::string> names;
  for (size_t i = 0; i < kNumMessageTypes; ++i) {
    WithMessageType(i, [&](auto type) { names.push_back(decltype(type)::getTypeName()); });
  }
  std::vector<std::string> all = TypeLayout::AllNames();
  std::sort(names.begin(), names.end());
  std::sort(all.begin(), all.end());
  return names == all;
}

}  // namespace

SKEIN_FUZZ_TARGET(messages) {
  static const bool has_all_types = HasAllTypes();
  Expect(has_all_types, "all_types.h lists all types of lcmtypes/");
  if (size == 0) return;
  WithMessageType(data[0] % kNumMessageTypes,
                  [&](auto type) { DecodeAndEncodeMessage<decltype(type)>(data + 1, size - 1); });
}

}  // namespace skein::fuzz
