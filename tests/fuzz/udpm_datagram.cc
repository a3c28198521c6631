// Datagrams of udpm.
#include "fuzz/fuzz.h"
#include "transport/udpm_link.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(udpm_datagram) {
  const auto datagram = ParseLcmDatagram(data, size);
  if (!datagram) return;
  uint32_t number = 0;
  for (size_t i = 4; i < 8; ++i) number = number << 8 | data[i];
  const Bytes again = MakeLcmDatagram(number, datagram->channel, datagram->message.data(),
                                      datagram->message.size());
  Expect(again == ToBytes(data, size), "a datagram has one form");
}

}  // namespace skein::fuzz
