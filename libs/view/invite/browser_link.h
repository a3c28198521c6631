// The link by which an invited browser comes. The pass stands behind '#': no server, proxy or log
// sees it.
#pragma once

#include <string>

#include "auth/certificate.h"

namespace skein {

// `server`: "https://10.77.0.1:8471". An agent's page is the phone's.
inline std::string BrowserLink(const std::string& server, Role role, const std::string& pass) {
  return server + (role == Role::kAgent ? "/phone#" : "/#") + pass;
}

// "fd00::1" -> "[fd00::1]".
inline std::string HostInUrl(const std::string& host) {
  return host.find(':') == std::string::npos ? host : "[" + host + "]";
}

}  // namespace skein
