// A range of the ledger as a blob: what ledger_range_t refers to.
//
// Little endian: "SKLR", uint32 version (2), uint32 number of facts. Then each fact in the order of
// seq: uint8 kind (index in Fact), uint32 size, the fact as LCM encodes it.
#pragma once

#include <vector>

#include "core/bytes.h"
#include "core/result.h"
#include "ledger/facts.h"

namespace skein {

inline constexpr int kMaxRangeFacts = 2000;
inline constexpr size_t kMaxRangeBytes = 4 << 20;

// Collects committed facts until a range is full.
class LedgerRangeWriter {
 public:
  // Appends one fact, encoded. False, and nothing is appended, when the range is full; the first
  // fact always fits.
  bool Add(int kind, const void* data, size_t size);
  int num_facts() const { return num_facts_; }
  // The blob. The writer is empty then.
  Bytes Take();

 private:
  ByteWriter facts_;
  int num_facts_ = 0;
};

// The facts in order. An error if any byte is wrong or the seq have a gap.
Result<std::vector<Fact>> DecodeLedgerRange(const Bytes& bytes);

}  // namespace skein
