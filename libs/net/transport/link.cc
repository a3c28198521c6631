#include "transport/link.h"

#include "transport/lcm_link.h"
#include "transport/tcpq_link.h"
#include "transport/udpm_link.h"

namespace skein {

std::unique_ptr<Link> MakeLink(const LcmUrl& url, PollLoop& loop, Link::OnMessage on_message) {
  if (url.goes_over_relay()) return std::make_unique<TcpqLink>(url, loop, std::move(on_message));
  if (url.provider == "udpm") return std::make_unique<UdpmLink>(url, loop, std::move(on_message));
  return std::make_unique<LcmLink>(url, loop, std::move(on_message));
}

}  // namespace skein
