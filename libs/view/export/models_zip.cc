#include "export/models_zip.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "export/georeferenced.h"
#include "export/model_writer.h"
#include "export/temporary_folder.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

class ZipFile {
 public:
  explicit ZipFile(const fs::path& path) : path_(path), archive_(archive_write_new()) {}
  ~ZipFile() { archive_write_free(archive_); }
  ZipFile(const ZipFile&) = delete;
  ZipFile& operator=(const ZipFile&) = delete;

  Status Open() {
    const bool open = archive_write_set_format_zip(archive_) == ARCHIVE_OK &&
                      archive_write_open_filename(archive_, path_.c_str()) == ARCHIVE_OK;
    return open ? Status::Ok() : Failure();
  }

  Status Add(const fs::path& file, const std::string& name) {
    std::ifstream in(file, std::ios::binary);
    if (!in) return Unavailable("cannot read " + file.string());
    const std::unique_ptr<archive_entry, decltype(&archive_entry_free)> entry(archive_entry_new(),
                                                                              &archive_entry_free);
    archive_entry_set_pathname(entry.get(), name.c_str());
    archive_entry_set_size(entry.get(), static_cast<int64_t>(fs::file_size(file)));
    archive_entry_set_filetype(entry.get(), AE_IFREG);
    archive_entry_set_perm(entry.get(), 0644);
    if (archive_write_header(archive_, entry.get()) != ARCHIVE_OK) return Failure();
    std::vector<char> part(1 << 16);
    while (in.read(part.data(), static_cast<std::streamsize>(part.size())), in.gcount() > 0) {
      const auto size = static_cast<size_t>(in.gcount());
      if (archive_write_data(archive_, part.data(), size) != static_cast<la_ssize_t>(size)) {
        return Failure();
      }
    }
    return Status::Ok();
  }

  Status Close() { return archive_write_close(archive_) == ARCHIVE_OK ? Status::Ok() : Failure(); }

 private:
  Status Failure() const {
    const char* reason = archive_error_string(archive_);
    return Unavailable("cannot write " + path_.string() + ": " +
                       (reason == nullptr ? "unknown" : reason));
  }

  const fs::path path_;
  archive* const archive_;
};

}  // namespace

Status WriteModelsZip(const std::vector<ExportModel>& models, const std::string& format,
                      const fs::path& file) {
  ZipFile zip(file);
  Status status = zip.Open();
  for (size_t i = 0; status.ok() && i < models.size(); ++i) {
    const TemporaryFolder folder;
    status = WriteModel(*models[i].reconstruction, format, folder.path());
    if (status.ok()) status = WriteGeoreference(models[i], folder.path());
    std::vector<fs::path> written;
    for (const auto& entry : fs::directory_iterator(folder.path())) written.push_back(entry.path());
    std::sort(written.begin(), written.end());
    for (const fs::path& part : written) {
      if (status.ok()) status = zip.Add(part, std::to_string(i) + "/" + part.filename().string());
    }
  }
  return status.ok() ? zip.Close() : status;
}

}  // namespace skein
