// Ranges of the ledger as blobs.
#include "ledger/ledger_range.h"

#include "fuzz/fuzz.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const auto facts = DecodeLedgerRange(fuzz::ToBytes(data, size));
  if (!facts.ok()) return 0;
  LedgerRangeWriter writer;
  for (const Fact& fact : *facts) {
    const Bytes bytes = EncodeFact(fact);
    BlobsOf(fact);
    HasValidTexts(fact);
    if (!writer.Add(FactKind(fact), bytes.data(), bytes.size())) return 0;
  }
  fuzz::Expect(DecodeLedgerRange(writer.Take()).ok(), "a range that was read can be written");
  return 0;
}
