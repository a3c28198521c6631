// A file of the folder keys/, for its owner alone: identifier, content, and the SHA-256 of both, so
// that a damaged one is never taken for a sound one.
#pragma once

#include <string>

#include "core/bytes.h"
#include "core/result.h"

namespace skein {

Status WriteKeysFile(const std::string& path, const std::string& identifier, const Bytes& content);

// The content. NotFound: there is no such file. DataLoss: it is damaged, or of another kind.
Result<Bytes> ReadKeysFile(const std::string& path, const std::string& identifier);

}  // namespace skein
