#include "clients/store/session_writer.h"

#include <algorithm>
#include <stdexcept>

#include "ledger/ledger_record.h"

namespace skein {

namespace fs = std::filesystem;

Status WriteLedger(const fs::path& path, const std::string& session_id, std::vector<Fact> facts,
                   const std::vector<LedgerNote>& notes) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::Open(path);
  if (!ledger.ok()) return ledger.status();
  std::vector<LedgerRecord> records;
  for (Fact& fact : facts) {
    fact_header_t& header = Header(fact);
    header.seq = static_cast<int64_t>(records.size()) + 1;
    header.session_id = session_id;
    header.computed_at_seq = std::min(header.computed_at_seq, header.seq - 1);
    records.push_back(EncodeRecord(fact));
  }
  return (*ledger)->Append(records, notes);
}

void Require(const Status& status) {
  if (!status.ok()) throw std::runtime_error(status.error());
}

void RemoveLedger(const fs::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", ".lock"}) fs::remove(path.string() + suffix);
}

}  // namespace skein
