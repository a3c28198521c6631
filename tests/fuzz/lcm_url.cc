// LCM URLs.
#include "transport/lcm_url.h"

#include <stdexcept>

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(lcm_url) {
  LcmUrl url;
  try {
    url = ParseLcmUrl(ToText(data, size));
  } catch (const std::invalid_argument&) {
    return;
  }
  Expect(ParseLcmUrl(url.ToString()).ToString() == url.ToString(), "what was read can be written");
  Expect(url.Bulk().port <= 65535, "the next port is a port");
}

}  // namespace skein::fuzz
