#include "ledger/ledger_range.h"

#include <cstring>
#include <utility>

namespace skein {
namespace {

constexpr char kRangeIdentifier[4] = {'S', 'K', 'L', 'R'};
constexpr uint32_t kRangeVersion = 2;

Result<std::vector<Fact>> Damaged(const std::string& what) {
  return DataLoss("ledger range: " + what);
}

bool ReadHead(ByteReader* reader, uint32_t* num_facts) {
  char identifier[4];
  uint32_t version = 0;
  return reader->GetRaw(identifier, sizeof(identifier)) && reader->Get(&version) &&
         std::memcmp(identifier, kRangeIdentifier, sizeof(identifier)) == 0 &&
         version == kRangeVersion && reader->Get(num_facts);
}

Result<Fact> ReadFact(ByteReader* reader) {
  uint8_t kind = 0;
  uint32_t size = 0;
  if (!reader->Get(&kind) || !reader->Get(&size) || size > reader->remaining()) {
    return DataLoss("truncated");
  }
  Result<Fact> fact = DecodeFact(kind, reader->data(), size);
  reader->Skip(size);
  return fact;
}

}  // namespace

bool LedgerRangeWriter::Add(int kind, const void* data, size_t size) {
  const bool full = num_facts_ >= kMaxRangeFacts || facts_.size() + size + 5 > kMaxRangeBytes;
  if (full && num_facts_ > 0) return false;
  facts_.Put(static_cast<uint8_t>(kind));
  facts_.Put(static_cast<uint32_t>(size));
  facts_.PutRaw(data, size);
  ++num_facts_;
  return true;
}

Bytes LedgerRangeWriter::Take() {
  ByteWriter writer;
  writer.PutRaw(kRangeIdentifier, sizeof(kRangeIdentifier));
  writer.Put(kRangeVersion);
  writer.Put(static_cast<uint32_t>(std::exchange(num_facts_, 0)));
  const Bytes facts = facts_.Take();
  writer.PutRaw(facts.data(), facts.size());
  return writer.Take();
}

Result<std::vector<Fact>> DecodeLedgerRange(const Bytes& bytes) {
  ByteReader reader(bytes);
  uint32_t num_facts = 0;
  if (!ReadHead(&reader, &num_facts)) return Damaged("not one, or of another version");
  std::vector<Fact> facts;
  for (uint32_t i = 0; i < num_facts; ++i) {
    Result<Fact> fact = ReadFact(&reader);
    if (!fact) return Damaged(fact.error());
    if (i > 0 && Header(*fact).seq != Header(facts.back()).seq + 1) return Damaged("gap");
    facts.push_back(std::move(*fact));
  }
  if (reader.remaining() != 0) return Damaged("bytes left over");
  return facts;
}

}  // namespace skein
