// Fields of an LCM URL that Skein reads.
#pragma once

#include <string>

namespace skein {

struct LcmUrl {
  std::string provider;  // udpm, tcpq, tcpqs (tcpq through TLS) or memq
  std::string host;      // multicast group, or the relay's host; empty for memq
  int port = 0;          // 0 for memq
  int ttl = 0;           // udpm only; 0 stays on this host
  std::string pin;       // tcpqs only; of the relay's certificate (auth/relay_certificate.h)

  // Everything, with a receive buffer of 4 MiB unless the URL gave one.
  std::string ToString() const;
  // The same for bulk data: next port. A memq URL is its own.
  LcmUrl Bulk() const;
  bool goes_over_relay() const { return provider == "tcpq" || provider == "tcpqs"; }
  // Whether a datagram may travel beyond this host, where IP fragments multiply loss.
  bool leaves_host_by_datagram() const { return provider == "udpm" && ttl > 0; }

  // Whether messages come from other hosts or go there.
  bool leaves_host() const;

  int recv_buf_size = 4 << 20;  // udpm only
};

// Throws std::invalid_argument, with what to write instead, for what Skein cannot use.
// Empty: udpm://239.255.76.67:7667?ttl=0.
LcmUrl ParseLcmUrl(const std::string& url);

}  // namespace skein
