// LCM URLs.
#include "transport/lcm_url.h"

#include <stdexcept>

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  LcmUrl url;
  try {
    url = ParseLcmUrl(fuzz::ToText(data, size));
  } catch (const std::invalid_argument&) {
    return 0;
  }
  fuzz::Expect(ParseLcmUrl(url.ToString()).ToString() == url.ToString(),
               "what was read can be written");
  fuzz::Expect(url.Bulk().port <= 65535, "the next port is a port");
  return 0;
}
