#include "ledger/ledger_record.h"

namespace skein {

LedgerRecord EncodeRecord(const Fact& fact) {
  const fact_header_t& header = Header(fact);
  return {header.seq, header.fact_id, FactKindName(fact), header.utime_us, EncodeFact(fact)};
}

Result<Fact> DecodeRecord(const LedgerRecord& record) {
  Result<Fact> fact =
      DecodeFact(FactKindFromName(record.kind), record.payload.data(), record.payload.size());
  if (fact.ok()) return fact;
  return fact.status().Within("ledger: fact " + std::to_string(record.seq) +
                              " cannot be read (written by another version of Skein?)");
}

}  // namespace skein
