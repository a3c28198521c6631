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

// A new ledger of these facts, in that order, numbered from 1, under that session's id.
Status WriteLedger(const std::filesystem::path& path, const std::string& session_id,
                   std::vector<Fact> facts, const std::vector<LedgerNote>& notes);

// Throws std::runtime_error where the status is an error.
void Require(const Status& status);

// Removes the files of a ledger.
void RemoveLedger(const std::filesystem::path& path);

}  // namespace skein
