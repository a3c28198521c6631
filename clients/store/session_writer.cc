#include "clients/store/session_writer.h"

#include <algorithm>
#include <system_error>

#include "blobs/blob_store.h"

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
    records.push_back(
        {header.seq, header.fact_id, FactKindName(fact), header.utime_us, EncodeFact(fact)});
  }
  return (*ledger)->Append(records, notes);
}

void RemoveLedger(const fs::path& path) {
  for (const char* suffix : {"", "-wal", "-shm", ".lock"}) fs::remove(path.string() + suffix);
}

Status LinkPhoto(const SessionPaths& paths, const image_t& image, const Bytes& bytes) {
  BlobStore store(paths.Blobs());
  const Result<std::string> blob = store.Put(bytes);
  if (!blob.ok()) return blob.status();
  const fs::path file = paths.Image(image.agent, image.name);
  std::error_code error;
  fs::create_directories(file.parent_path(), error);
  if (!error) fs::remove(file, error);
  if (!error) fs::create_hard_link(store.Path(*blob), file, error);
  if (error) error.clear(), fs::copy_file(store.Path(*blob), file, error);
  return error ? Unavailable("cannot write " + file.string() + ": " + error.message())
               : Status::Ok();
}

}  // namespace skein
