#pragma once

#include <cstdint>
#include <string>

#include "ledger/session_folder.h"
#include "transport/invitation.h"

namespace skein {

// `skein invite`: a credential of the session, as a link and a QR code.
int RunInvite(int argc, char** argv);

// Seconds since 1970 UTC, `duration` from now: a number of s, m, h or d, as "12h"; "": 0, never.
// Throws std::invalid_argument, with the name of the option, for any other text.
int64_t ExpiryOf(const std::string& duration);

// An address of the live view on this host, "http://127.0.0.1:8470", without slashes at its end.
// Throws std::invalid_argument for any other: a pass would leave this host in the clear.
std::string OwnViewOf(std::string view);

// A new invitation to the session at `url`. Throws std::runtime_error where no credential can be
// made.
Invitation MakeInvitation(const Session& session, LcmUrl url, Role role, const std::string& name,
                          int64_t expires_s);

}  // namespace skein
