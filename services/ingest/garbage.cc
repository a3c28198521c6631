#include "ingest/garbage.h"

#include <chrono>
#include <set>
#include <system_error>
#include <variant>

#include "blobs/blob_store.h"
#include "core/attempt.h"
#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"
#include "core/log.h"
#include "session/needed_blobs.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

// A file may go so long after it was written.
constexpr std::chrono::minutes kMinGarbageAge{10};

}  // namespace

std::vector<fs::path> FilesWrittenBefore(const fs::path& dir, fs::file_time_type before) {
  std::vector<fs::path> files;
  for (const fs::path& file : FilesUnder(dir)) {
    std::error_code vanished;
    const bool is_old = fs::last_write_time(file, vanished) < before;
    if (is_old && !vanished) files.push_back(file);
  }
  return files;
}

GarbageCollector::GarbageCollector(Node& node, LedgerWriter& writer, SessionPaths paths,
                                   double period_s)
    : writer_(writer),
      paths_(std::move(paths)),
      period_s_(period_s),
      next_s_(node.loop().now_s() + period_s),
      worker_(node.loop()) {
  writer.AddObserver([this](const Fact& fact) {
    const auto* model = std::get_if<submap_model_t>(&fact);
    if (model != nullptr && IsBlobId(model->model_blob)) models_[model->model_blob] = false;
  });
}

void GarbageCollector::Tick(double now_s) {
  if (now_s < next_s_) return;
  next_s_ = now_s + period_s_;
  worker_.Run(
      [paths = paths_] {
        const auto before = fs::file_time_type::clock::now() - kMinGarbageAge;
        return Attempt([&] { return FilesWrittenBefore(paths.Blobs(), before); });
      },
      [this](const Result<std::vector<fs::path>>& old_files) {
        if (old_files.ok()) return Remove(*old_files);
        LogWarn("files that nothing needs stay: {}", old_files.error());
      });
}

void GarbageCollector::AddSuperseded(const std::set<std::string>& needed,
                                     std::vector<fs::path>* files) {
  const BlobStore store(paths_.Blobs());
  for (auto model = models_.begin(); model != models_.end();) {
    const bool is_needed = needed.count(model->first) > 0;
    if (!is_needed && model->second) {
      files->push_back(store.Path(model->first));
      model = models_.erase(model);
    } else {
      model->second = !is_needed;
      ++model;
    }
  }
}

// On the loop's thread, where facts are committed: none comes in between.
void GarbageCollector::Remove(std::vector<fs::path> files) {
  if (writer_.state().finishing() || writer_.has_staged()) return;
  const std::set<std::string> needed = NeededBlobs(writer_.state());
  AddSuperseded(needed, &files);
  uintmax_t num_bytes = 0;
  int num_removed = 0;
  for (const fs::path& file : files) {
    const std::string name = file.filename().string();
    const bool is_garbage = IsBlobId(name) ? needed.count(name) == 0 : IsTemporaryName(name);
    if (!is_garbage) continue;
    std::error_code error;
    const uintmax_t size = fs::file_size(file, error);
    if (error || !fs::remove(file, error)) continue;
    num_bytes += size;
    ++num_removed;
  }
  if (num_removed == 0) return;
  LogInfo("removed {} files that nothing needs, {:.1f} MB", num_removed,
          static_cast<double>(num_bytes) * 1e-6);
}

}  // namespace skein
