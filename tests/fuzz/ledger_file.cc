// A file as ledger.db: opened, surveyed as `skein check` does it, and read.
#include "fuzz/fuzz.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"

namespace skein::fuzz {

SKEIN_FUZZ_TARGET(ledger_file) {
  static const ScratchFolder folder;
  const auto path = folder.Write("ledger.db", data, size);
  for (const char* side : {"-wal", "-shm", ".lock"}) {
    std::filesystem::remove(path.string() + side);
  }
  const LedgerSurvey survey = Ledger::Survey(path);
  for (const LedgerRecord& record : survey.records) {
    DecodeFact(FactKindFromName(record.kind), record.payload.data(), record.payload.size()).ok();
  }
  const auto ledger = Ledger::OpenReadOnly(path);
  if (!ledger.ok()) return;
  size_t num_read = 0;
  const Status read = (*ledger)->ForEach([&](const LedgerRecord&) { ++num_read; });
  (*ledger)->Notes("camera").ok();
  if (survey.IsWhole()) {
    Expect(read.ok() && num_read == survey.records.size(), "what is whole can be read");
  }
}

}  // namespace skein::fuzz
