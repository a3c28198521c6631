// Files of the folder keys/, for their owner alone. `path` is SESSION/keys/NAME: below SESSION no
// symbolic link is followed (core/file_below.h).
#pragma once

#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

// Replaces the whole file; only its owner may read it.
Status WriteSecretFile(const std::string& path, const void* data, size_t size);
// kNotFound: there is no such file. kInvalidArgument: it has more than 16 MiB.
Result<Bytes> ReadSecretFile(const std::string& path);

// The same with identifier, content, and the SHA-256 of both, so that a damaged file is never taken
// for a sound one.
Status WriteKeysFile(const std::string& path, const std::string& identifier, const Bytes& content);

// The content. NotFound: there is no such file. DataLoss: it is damaged, or of another kind.
Result<Bytes> ReadKeysFile(const std::string& path, const std::string& identifier);

}  // namespace skein
