// A root key that is the same in every run, so that the signatures of the seeds hold.
#pragma once

#include "auth/certificate.h"
#include "auth/signing_key.h"

namespace skein::fuzz {

struct TestKeys {
  SigningKey root{SigningKey::Seed{1}};
  SessionTrust trust{"0123456789abcdef", root.public_key()};
  Credential credential =
      IssueCredential(root, trust.session_id, Role::kAgent, "alice", 0);  // one that never expires
};

}  // namespace skein::fuzz
