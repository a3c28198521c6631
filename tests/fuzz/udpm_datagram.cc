// Datagrams of udpm.
#include "fuzz/fuzz.h"
#include "transport/udpm_link.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto datagram = ParseLcmDatagram(data, size);
  if (!datagram) return 0;
  uint32_t number = 0;
  for (size_t i = 4; i < 8; ++i) number = number << 8 | data[i];
  const Bytes again = MakeLcmDatagram(number, datagram->channel, datagram->message.data(),
                                      datagram->message.size());
  fuzz::Expect(again == fuzz::ToBytes(data, size), "a datagram has one form");
  return 0;
}
