// Facts as the ledger stores them.
#pragma once

#include "core/result.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"

namespace skein {

LedgerRecord EncodeRecord(const Fact& fact);

// An error, which names the record, where its payload is not exactly one fact of its kind.
Result<Fact> DecodeRecord(const LedgerRecord& record);

}  // namespace skein
