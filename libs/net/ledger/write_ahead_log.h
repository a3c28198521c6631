// SQLite's write-ahead log, only as far as its checksums go. SQLite reads the log up to the first
// damaged frame, and does not report the frames behind it. Source: SQLite, Database File Format,
// section 4 (The Write-Ahead Log).
#pragma once

#include <filesystem>
#include <string>

namespace skein {

// A line for a person where the log at `path` holds damaged frames of the present generation; ""
// if not, or if there is none. A power loss can leave such frames of a transaction that was not yet
// committed. Precondition: no process writes meanwhile.
std::string DamageOfWriteAheadLog(const std::filesystem::path& path);

}  // namespace skein
