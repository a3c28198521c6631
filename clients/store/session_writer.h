// Writes parts of a session folder, for repair and clone.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"
#include "ledger/session_folder.h"

namespace skein {

// A new ledger of these facts, in that order, numbered from 1, under that session's id.
Status WriteLedger(const std::filesystem::path& path, const std::string& session_id,
                   std::vector<Fact> facts, const std::vector<LedgerNote>& notes);

// Removes the files of a ledger.
void RemoveLedger(const std::filesystem::path& path);

// Stores the photo as a blob and as a link to it, images/AGENT/NAME.
Status LinkPhoto(const SessionPaths& paths, const image_t& image, const Bytes& bytes);

}  // namespace skein
