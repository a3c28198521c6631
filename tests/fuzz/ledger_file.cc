// A file as ledger.db: opened, surveyed as `skein check` does it, and read.
#include "fuzz/fuzz.h"
#include "ledger/facts.h"
#include "ledger/ledger_store.h"

using namespace skein;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const fuzz::ScratchFolder folder;
  const auto path = folder.Write("ledger.db", data, size);
  for (const char* side : {"-wal", "-shm", ".lock"}) {
    std::filesystem::remove(path.string() + side);
  }
  const LedgerSurvey survey = Ledger::Survey(path);
  for (const LedgerRecord& record : survey.records) {
    DecodeFact(FactKindFromName(record.kind), record.payload.data(), record.payload.size()).ok();
  }
  const auto ledger = Ledger::OpenReadOnly(path);
  if (!ledger.ok()) return 0;
  size_t num_read = 0;
  const Status read = (*ledger)->ForEach([&](const LedgerRecord&) { ++num_read; });
  (*ledger)->Notes("camera").ok();
  if (survey.IsWhole()) {
    fuzz::Expect(read.ok() && num_read == survey.records.size(), "what is whole can be read");
  }
  return 0;
}
