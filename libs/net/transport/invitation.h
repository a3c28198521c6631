// Link with everything that a new member needs: address of the session, its root key, a credential.
//
//   skein://HOST:PORT/PROVIDER/SESSION/ROLE/NAME/CODE      PROVIDER: tcpq, tcpqs, or udpm-TTL
//
// CODE is base64url of the root's public key (32 bytes), then the credential (seed, certificate),
// then, for tcpqs, the pin of the relay's certificate (16 bytes).
// Whoever has the link has the credential.
#pragma once

#include <string>

#include "auth/certificate.h"
#include "core/result.h"
#include "transport/lcm_url.h"

namespace skein {

struct Invitation {
  LcmUrl url;
  SessionTrust trust;
  Credential credential;
};

// Whether the name may stand in a link: 1 to 24 letters, digits, '-' or '_'.
bool IsInvitedName(const std::string& name);

// The URL is of tcpq, udpm, or tcpqs with a pin.
std::string ToLink(const Invitation& invitation);

// An error says what is wrong. "@FILE": the link stands in that file, where no list of processes
// shows it.
Result<Invitation> ReadInvitation(const std::string& link);

}  // namespace skein
