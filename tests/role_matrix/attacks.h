#pragma once

#include "auth/session_keys.h"
#include "ledger/session_folder.h"
#include "role_matrix/trial.h"

namespace skein {

// What a hostile peer can do with messages and certificates of others and of its own; prints a
// table. Whether all went as it must.
bool RunAttacks(Trial* trial, const Session& session, const SessionTrust& trust);

}  // namespace skein
