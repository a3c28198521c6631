// Ranges of the ledger as blobs.
#include "ledger/ledger_range.h"

#include "fuzz/fuzz.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(ledger_range) {
  const auto facts = DecodeLedgerRange(ToBytes(data, size));
  if (!facts.ok()) return;
  LedgerRangeWriter writer;
  for (const Fact& fact : *facts) {
    const Bytes bytes = EncodeFact(fact);
    BlobsOf(fact);
    HasValidTexts(fact);
    if (!writer.Add(FactKind(fact), bytes.data(), bytes.size())) return;
  }
  Expect(DecodeLedgerRange(writer.Take()).ok(), "a range that was read can be written");
}

}  // namespace skein::fuzz
