// Writes parts of a session folder, for repair and clone.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"
#include "ledger/session_folder.h"

namespace skein {

// Writes a new ledger at `path`: the facts in the given order, with seq 1, 2, ... and `session_id`.
Status WriteLedger(const std::filesystem::path& path, const std::string& session_id,
                   std::vector<Fact> facts, const std::vector<LedgerNote>& notes);

// Throws std::runtime_error where the status is an error.
void Require(const Status& status);

// Removes a ledger with its -wal, -shm and .lock files.
void RemoveLedger(const std::filesystem::path& path);

}  // namespace skein
