#pragma once

#include <string>

namespace skein {

// Whether the text is a numeric address of this host alone: 127.0.0.0/8 (RFC 1122, 3.2.1.3) or ::1.
// "127.example.org" is a name, and whoever owns it says where it leads.
bool IsLoopbackAddress(const std::string& address);

}  // namespace skein
