#include "clients/export/unmirrored.h"

#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "blobs/blob_store.h"
#include "codecs/photo_encoding.h"
#include "core/file_below.h"
#include "core/folder.h"
#include "ledger/facts.h"
#include "ledger/ledger_record.h"
#include "photo/exif.h"
#include "photo/photo_decoder.h"

namespace skein {
namespace {

namespace fs = std::filesystem;

Result<std::vector<skein::image_t>> MirroredPhotos(const SessionPaths& paths) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  if (!ledger) return ledger.status();
  std::vector<skein::image_t> mirrored;
  Status failure;
  const Status read = (*ledger)->ForEach([&](const LedgerRecord& record) {
    const Result<Fact> fact = DecodeRecord(record);
    if (!fact.ok()) {
      failure = fact.status().Within(record.fact_id);
    } else if (const auto* image = std::get_if<skein::image_t>(&*fact)) {
      if (IsMirrored(image->orientation)) mirrored.push_back(*image);
    }
  });
  if (!read.ok()) return read;
  if (!failure.ok()) return failure;
  return mirrored;
}

Status WriteOne(const BlobStore& blobs, const skein::image_t& image, const fs::path& folder,
                PhotoDecoder* decoder) {
  const Result<Bytes> photo = blobs.Get(image.blob_id);
  if (!photo.ok()) return photo.status();
  const Result<DecodedPhoto> decoded = decoder->Decode(*photo);
  if (!decoded.ok()) return decoded.status();
  const fs::path file = folder / image.agent / image.name;
  Bytes encoded;
  if (!cv::imencode(file.extension().string(), decoded->image, encoded,
                    {cv::IMWRITE_JPEG_QUALITY, kJpegQuality})) {
    return Unavailable("OpenCV cannot encode " + file.string());
  }
  if (Status made = CreateFoldersBelow(folder, file.parent_path()); !made.ok()) return made;
  return WriteFileBelow(folder, file, encoded);
}

}  // namespace

Result<int> WriteUnmirrored(const SessionPaths& paths, const fs::path& folder) {
  const Result<std::vector<skein::image_t>> mirrored = MirroredPhotos(paths);
  if (!mirrored.ok()) return mirrored.status();
  if (mirrored->empty()) return 0;
  const Result<std::unique_ptr<PhotoDecoder>> decoder = PhotoDecoder::Start();
  if (!decoder.ok()) return decoder.status();
  if (Status made = CreateFolders(folder); !made.ok()) return made;
  const BlobStore blobs(paths.Blobs());
  for (const skein::image_t& image : *mirrored) {
    const Status written = WriteOne(blobs, image, folder, decoder->get());
    if (!written.ok()) return written.Within(image.agent + "/" + image.name);
  }
  return static_cast<int>(mirrored->size());
}

}  // namespace skein
