#include "auth/home_mark.h"

#include <openssl/crypto.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/rand.h>
#include <pwd.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "auth/keys_file.h"
#include "auth/openssl_handles.h"
#include "core/file.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

constexpr char kSecretIdentifier[] = "skhome01";
constexpr char kMarkIdentifier[] = "skmark01";
constexpr size_t kSecretBytes = 32;
// Longer than a public key: no note is taken for the root of a session.
constexpr char kNoteDomain[] = "skein-note-in-a-session-folder-1";
static_assert(sizeof(kNoteDomain) > sizeof(PublicKey));

std::string MarkPath(const std::string& keys_dir) { return keys_dir + "/home"; }

// Absolute; "" if this user has no home.
fs::path StateFolder() {
  const char* state = std::getenv("XDG_STATE_HOME");
  if (state != nullptr && state[0] == '/') return fs::path(state) / "skein";
  const char* home = std::getenv("HOME");
  const passwd* user = home == nullptr || home[0] != '/' ? ::getpwuid(::getuid()) : nullptr;
  if (user != nullptr) home = user->pw_dir;
  if (home == nullptr || home[0] != '/') return {};
  return fs::path(home) / ".local/state/skein";
}

Result<Bytes> MakeSecret(const std::string& path) {
  Bytes secret(kSecretBytes);
  Need(::RAND_bytes(secret.data(), kSecretBytes) == 1);
  if (Status status = WriteKeysFile(path, kSecretIdentifier, secret); !status) return status;
  return secret;
}

Result<Bytes> OpenSecret() {
  const fs::path folder = StateFolder();
  const std::string advice = "set XDG_STATE_HOME to a folder of yours that can be written";
  if (folder.empty()) return Unavailable("this user has no home folder; " + advice);
  if (Status made = CreateFolders(folder); !made) return made.Within(advice);
  const FolderLock lock(folder.string());
  const std::string path = folder / "home.key";
  Result<Bytes> secret = ReadKeysFile(path, kSecretIdentifier);
  if (secret.code() == StatusCode::kNotFound) secret = MakeSecret(path);
  if (!secret.ok()) return secret.status().Within(advice);
  if (secret->size() != kSecretBytes) return DataLoss(path + " is damaged; delete it");
  return secret;
}

Bytes Hmac(const Bytes& secret, const uint8_t* data, size_t size) {
  Bytes mark(EVP_MAX_MD_SIZE);
  unsigned mark_size = 0;
  Need(::HMAC(::EVP_sha256(), secret.data(), static_cast<int>(secret.size()), data, size,
              mark.data(), &mark_size) != nullptr);
  mark.resize(mark_size);
  return mark;
}

Bytes MarkOf(const Bytes& secret, const PublicKey& root) {
  return Hmac(secret, root.data(), root.size());
}

}  // namespace

Status MarkKeysAsOwn(const std::string& keys_dir, const PublicKey& root) {
  const Result<Bytes> secret = OpenSecret();
  if (!secret.ok()) return secret.status();
  return WriteKeysFile(MarkPath(keys_dir), kMarkIdentifier, MarkOf(*secret, root));
}

Status CheckKeysAreOwn(const std::string& keys_dir, const PublicKey& root) {
  const Result<Bytes> secret = OpenSecret();
  if (!secret.ok()) return secret.status();
  const Bytes own = MarkOf(*secret, root);
  const Result<Bytes> found = ReadKeysFile(MarkPath(keys_dir), kMarkIdentifier);
  const bool is_own = found.ok() && found->size() == own.size() &&
                      ::CRYPTO_memcmp(found->data(), own.data(), own.size()) == 0;
  if (is_own) return Status::Ok();
  return FailedPrecondition(
      keys_dir +
      " was not made by this user on this host: who made it can speak in every role. `skein clone` "
      "copies the session without its keys; `skein launch --adopt` makes new ones here, and all "
      "invitations end");
}

Status CheckMark(const std::string& keys_dir) {
  const Result<Bytes> mark = ReadKeysFile(MarkPath(keys_dir), kMarkIdentifier);
  return mark.code() == StatusCode::kNotFound ? Status::Ok() : mark.status();
}

Result<std::string> HomeMarkOf(const std::string& purpose, const std::string& text) {
  const Result<Bytes> secret = OpenSecret();
  if (!secret.ok()) return secret.status();
  ByteWriter out;
  out.PutRaw(kNoteDomain, sizeof(kNoteDomain));
  out.PutRaw(purpose.c_str(), purpose.size() + 1);
  out.PutRaw(text.data(), text.size());
  const Bytes mark = Hmac(*secret, out.bytes().data(), out.size());
  return ToHex(mark.data(), mark.size());
}

}  // namespace skein
