#include "auth/session_keys.h"

#include <sys/stat.h>

#include <algorithm>
#include <filesystem>

#include "auth/home_mark.h"
#include "auth/keys_file.h"
#include "auth/relay_certificate.h"
#include "auth/revocations.h"
#include "auth/web_certificate.h"
#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"
#include "core/log.h"

namespace skein {
namespace {

constexpr char kRootIdentifier[8] = {'s', 'k', 'r', 'o', 'o', 't', '0', '1'};
constexpr char kCountersIdentifier[] = "skcoun02";
constexpr char kCredentialSuffix[] = ".credential";

std::string RootPath(const std::string& dir) { return dir + "/root.key"; }
std::string CountersPath(const std::string& dir) { return dir + "/counters"; }
std::string CredentialPath(const std::string& dir, Role role, const std::string& name) {
  return dir + "/" + RoleName(role) + "-" + HashBytes(name.data(), name.size()).substr(0, 16) +
         kCredentialSuffix;
}

bool Exists(const std::string& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0;
}

Result<SigningKey> CreateRoot(const std::string& dir) {
  const SigningKey root = SigningKey::Generate();
  // First: a root without its mark is nobody's.
  if (Status status = MarkKeysAsOwn(dir, root.public_key()); !status) return status;
  ByteWriter out;
  out.PutRaw(kRootIdentifier, sizeof(kRootIdentifier));
  out.PutRaw(root.seed().data(), root.seed().size());
  out.PutRaw(root.public_key().data(), root.public_key().size());
  if (Status status = WriteSecretFile(RootPath(dir), out.bytes().data(), out.size()); !status) {
    return status;
  }
  return root;
}

Result<SigningKey> ReadRoot(const std::string& dir) {
  const Result<Bytes> bytes = ReadSecretFile(RootPath(dir));
  if (!bytes.ok()) {
    return bytes.status().Within("the session's keys belong to who made it; take an invitation");
  }
  ByteReader in(*bytes);
  char identifier[sizeof(kRootIdentifier)];
  SigningKey::Seed seed;
  PublicKey public_key;  // tells a damaged seed, which would be another root
  if (!in.GetRaw(identifier, sizeof(identifier)) || !in.GetRaw(seed.data(), seed.size()) ||
      !in.GetRaw(public_key.data(), public_key.size()) || in.remaining() > 0 ||
      !std::equal(identifier, std::end(identifier), kRootIdentifier) ||
      SigningKey(seed).public_key() != public_key) {
    return DataLoss(RootPath(dir) + " is damaged; restore it, or delete the folder " + dir +
                    " for new keys: invitations end with the old ones");
  }
  return SigningKey(seed);
}

// The folder's lock is held.
Result<SigningKey> OpenRoot(const std::string& dir) {
  if (!Exists(RootPath(dir))) return CreateRoot(dir);
  Result<SigningKey> root = ReadRoot(dir);
  if (!root.ok()) return root;
  if (Status own = CheckKeysAreOwn(dir, root->public_key()); !own) return own;
  return root;
}

bool Holds(const Credential& credential, const SessionTrust& trust, Role role,
           const std::string& name) {
  const Certificate& certificate = credential.certificate;
  return certificate.role == role && certificate.name == name && certificate.expires_s == 0 &&
         IsGenuine(certificate, trust);
}

// One that does not hold, of a root that was replaced or damaged, is made again. On a full disk it
// is kept nowhere.
Credential OpenCredential(const std::string& dir, const SigningKey& root, const SessionTrust& trust,
                          Role role, const std::string& name) {
  const std::string path = CredentialPath(dir, role, name);
  if (const Result<Bytes> bytes = ReadSecretFile(path); bytes.ok()) {
    const Result<Credential> credential = DecodeCredential(*bytes);
    if (credential.ok() && Holds(*credential, trust, role, name)) return *credential;
  }
  const Credential credential = IssueCredential(root, trust.session_id, role, name, 0);
  const Bytes bytes = EncodeCredential(credential);
  if (Status status = WriteSecretFile(path, bytes.data(), bytes.size()); !status) {
    LogWarn("the next start takes another key: {}", status.error());
  }
  return credential;
}

Result<SignerCounters> ReadCounters(const std::string& dir) {
  const Result<Bytes> bytes = ReadKeysFile(CountersPath(dir), kCountersIdentifier);
  if (bytes.code() == StatusCode::kNotFound) return SignerCounters{};
  if (!bytes.ok()) return bytes.status();
  SignerCounters counters;
  ByteReader in(*bytes);
  PublicKey key;
  uint64_t counter = 0;
  while (in.GetRaw(key.data(), key.size()) && in.Get(&counter)) counters[key] = counter;
  return counters;
}

// Without the file, what it guards against is open until the next is written.
SignerCounters CountersOrNone(const std::string& dir) {
  const Result<SignerCounters> counters = ReadCounters(dir);
  if (counters.ok()) return *counters;
  LogWarn("a message may be taken twice: {}", counters.error());
  return {};
}

bool IsSoundCredential(const std::string& path, const SessionTrust& trust) {
  const Result<Bytes> bytes = ReadSecretFile(path);
  const Result<Credential> credential = bytes.ok() ? DecodeCredential(*bytes) : bytes.status();
  return credential.ok() && IsGenuine(credential->certificate, trust);
}

}  // namespace

Status MakeKeysFolder(const std::string& dir) {
  return CreateFoldersBelow(std::filesystem::path(dir).parent_path(), dir, 0700);
}

bool HasCredentialOf(const std::string& dir, const std::string& name) {
  constexpr Role kRoles[] = {Role::kIngest,   Role::kWorker, Role::kAgent,
                             Role::kOperator, Role::kViewer, Role::kWeb};
  return std::any_of(std::begin(kRoles), std::end(kRoles),
                     [&](Role role) { return Exists(CredentialPath(dir, role, name)); });
}

Result<SessionAccess> OpenSessionKeys(const std::string& dir, const std::string& session_id,
                                      Role role, const std::string& name) {
  if (Status status = MakeKeysFolder(dir); !status) return status;
  const FolderLock lock(dir);
  const Result<SigningKey> root = OpenRoot(dir);
  if (!root.ok()) return root.status();
  if (const auto revoked = ReadRevokedNames(dir); !revoked.ok()) return revoked.status();
  const SessionTrust trust{session_id, root->public_key()};
  return SessionAccess{trust, OpenCredential(dir, *root, trust, role, name), CountersOrNone(dir)};
}

Result<SessionAccess> IssueInvitation(const std::string& dir, const std::string& session_id,
                                      Role role, const std::string& name, int64_t expires_s) {
  if (Status status = RecordInvitation(dir, name); !status) return status;
  const FolderLock lock(dir);
  const Result<SigningKey> root = OpenRoot(dir);
  if (!root.ok()) return root.status();
  return SessionAccess{{session_id, root->public_key()},
                       IssueCredential(*root, session_id, role, name, expires_s),
                       {}};
}

Status CheckRootIsOwn(const std::string& dir) {
  if (!Exists(RootPath(dir))) return Status::Ok();
  const FolderLock lock(dir);
  return OpenRoot(dir).status();
}

Result<Signature> SignAsRoot(const std::string& dir, const Bytes& bytes) {
  if (Status status = MakeKeysFolder(dir); !status) return status;
  const FolderLock lock(dir);
  const Result<SigningKey> root = OpenRoot(dir);
  if (!root.ok()) return root.status();
  return root->Sign(bytes);
}

Status SaveCounters(const std::string& dir, const SignerCounters& counters) {
  ByteWriter out;
  for (const auto& [key, counter] : counters) {
    out.PutRaw(key.data(), key.size());
    out.Put(counter);
  }
  return WriteKeysFile(CountersPath(dir), kCountersIdentifier, out.Take());
}

std::vector<KeysDamage> CheckSessionKeys(const std::string& dir, const std::string& session_id) {
  std::vector<KeysDamage> damage;
  if (!Exists(RootPath(dir))) return damage;
  const FolderLock lock(dir);
  const Result<SigningKey> root = ReadRoot(dir);
  if (!root.ok()) damage.push_back({"root.key", true, false});
  if (!CheckMark(dir).ok()) damage.push_back({"home", true, false});
  if (!ReadRevokedNames(dir).ok()) damage.push_back({"revoked", true, false});
  if (!ReadInvitedNames(dir).ok()) damage.push_back({"invited", false, true});
  if (!ReadCounters(dir).ok()) damage.push_back({"counters", false, true});
  if (ReadRelayPin(dir).code() == StatusCode::kDataLoss) damage.push_back({"relay.pem"});
  if (CheckWebCertificate(dir).code == StatusCode::kDataLoss) damage.push_back({"web.pem"});
  for (const std::filesystem::path& file : FilesUnder(dir)) {
    if (file.extension() != kCredentialSuffix || !root.ok()) continue;
    if (!IsSoundCredential(file, {session_id, root->public_key()})) {
      damage.push_back({file.filename().string(), false, true});
    }
  }
  return damage;
}

Bytes EncodeCredential(const Credential& credential) {
  ByteWriter out;
  out.PutRaw(credential.key.seed().data(), credential.key.seed().size());
  AppendCertificate(credential.certificate, &out);
  return out.Take();
}

Result<Credential> DecodeCredential(const Bytes& bytes) {
  ByteReader in(bytes);
  SigningKey::Seed seed;
  Certificate certificate;
  if (!in.GetRaw(seed.data(), seed.size()) || !ReadCertificate(&in, &certificate) ||
      in.remaining() > 0) {
    return DataLoss("the credential is damaged");
  }
  const SigningKey key(seed);
  if (key.public_key() != certificate.public_key) return DataLoss("the credential is damaged");
  return Credential{key, certificate};
}

}  // namespace skein
