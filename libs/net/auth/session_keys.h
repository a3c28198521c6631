// The keys of a session, in its folder. A reader of the root key can speak in every role.
//
//   keys/                       0700
//   keys/root.key               the root's seed
//   keys/home                   auth/home_mark.h: who made the root, and where
//   keys/ROLE-HASH.credential   one for each role and name that a process of this host has had
//   keys/counters               the highest counter of each signer that ingest has seen
//   keys/invited, keys/revoked  auth/revocations.h
//   keys/relay.pem              auth/relay_certificate.h
#pragma once

#include <string>
#include <vector>

#include "auth/message_seal.h"
#include "core/result.h"

namespace skein {

struct SessionAccess {
  SessionTrust trust;
  Credential credential;
  SignerCounters used;
};

// Makes the folder keys/, for the user alone, where it is missing. The folder stays after a power
// loss.
Status MakeKeysFolder(const std::string& dir);

// Whether a process of this host has had a credential of this name, in any role.
bool HasCredentialOf(const std::string& dir, const std::string& name);

// Makes what is missing. `dir` is the folder keys/. An error says which file and what to do;
// kFailedPrecondition: the root was not made by this user on this host (auth/home_mark.h).
Result<SessionAccess> OpenSessionKeys(const std::string& dir, const std::string& session_id,
                                      Role role, const std::string& name);

// A new credential, for an invitation. The credential is kept nowhere; its name is recorded. Fails
// for a name that may not be invited (auth/revocations.h).
Result<SessionAccess> IssueInvitation(const std::string& dir, const std::string& session_id,
                                      Role role, const std::string& name, int64_t expires_s);

// Whether this user made the root on this host; Ok where there is none.
Status CheckRootIsOwn(const std::string& dir);

// The root's signature of these bytes, which say what they are for. Makes the root where it is
// missing.
Result<Signature> SignAsRoot(const std::string& dir, const Bytes& bytes);

Status SaveCounters(const std::string& dir, const SignerCounters& counters);

// A damaged file of the folder keys/, named by its path in there.
struct KeysDamage {
  std::string file;
  // Without it nobody can tell who may do what: new keys must be made, and all invitations again.
  bool ends_all_keys = false;
  // The next start makes another of its kind, and nothing is lost.
  bool is_made_anew = false;
};
// Reads all of them; an empty folder, or none, is whole.
std::vector<KeysDamage> CheckSessionKeys(const std::string& dir, const std::string& session_id);

// A credential as bytes: seed, then certificate. The key must be the certificate's.
Bytes EncodeCredential(const Credential& credential);
Result<Credential> DecodeCredential(const Bytes& bytes);

}  // namespace skein
