// Mark of session keys that were made on this host, by this user. A folder that was sent brings
// keys with it, and who made them can speak in every role. The mark of own keys is
// SESSION/keys/home: the HMAC-SHA256 of the root's public key under a secret of this user, which
// lies outside of every session folder: $XDG_STATE_HOME/skein/home.key, by default
// ~/.local/state/skein/home.key, 0600. The secret is made when it is first needed. A session may be
// moved or restored on its host.
#pragma once

#include <string>

#include "auth/signing_key.h"
#include "core/result.h"

namespace skein {

// `keys_dir` is the folder keys/, which exists. Makes the user's secret where it is missing.
Status MarkKeysAsOwn(const std::string& keys_dir, const PublicKey& root);

// kFailedPrecondition: the mark is missing or another user's or host's; the text says what to do.
Status CheckKeysAreOwn(const std::string& keys_dir, const PublicKey& root);

// Whether the mark, if there is one, is whole, whoever made it.
Status CheckMark(const std::string& keys_dir);

// Mark of a note that this user's processes leave in a session folder, as 64 lower-case hexadecimal
// digits: the HMAC-SHA256 of `purpose` and `text` under the secret. `purpose` says which note it
// is: the mark of one note fits no other. Fails where the secret cannot be read or made.
Result<std::string> HomeMarkOf(const std::string& purpose, const std::string& text);

}  // namespace skein
