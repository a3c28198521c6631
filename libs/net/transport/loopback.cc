#include "transport/loopback.h"

#include <arpa/inet.h>

namespace skein {

bool IsLoopbackAddress(const std::string& address) {
  constexpr uint32_t kNetwork = 127;
  in_addr parsed{};
  if (address == "::1") return true;
  return ::inet_pton(AF_INET, address.c_str(), &parsed) == 1 &&
         ntohl(parsed.s_addr) >> 24 == kNetwork;
}

}  // namespace skein
