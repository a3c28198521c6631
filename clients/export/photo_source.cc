#include "clients/export/photo_source.h"

#include <map>
#include <memory>
#include <utility>

#include "blobs/blob_store.h"
#include "core/file.h"
#include "ledger/ledger_store.h"
#include "photo/photo_decoder.h"
#include "photo/photo_name.h"
#include "session/read_session.h"

namespace skein {
namespace {

using DecoderPtr = std::shared_ptr<PhotoDecoder>;

Result<DecoderPtr> StartDecoder() {
  Result<std::unique_ptr<PhotoDecoder>> decoder = PhotoDecoder::Start();
  if (!decoder.ok()) return decoder.status();
  return DecoderPtr(*std::move(decoder));
}

Result<cv::Mat3b> Decode(PhotoDecoder* decoder, const std::string& name,
                         const Result<Bytes>& photo) {
  if (!photo.ok()) return photo.status().Within(name);
  const Result<DecodedPhoto> decoded = decoder->Decode(*photo);
  if (!decoded.ok()) return decoded.status().Within(name);
  return cv::Mat3b(decoded->image);
}

std::string SizeText(cv::Size size) {
  return std::to_string(size.width) + " x " + std::to_string(size.height);
}

}  // namespace

Result<cv::Mat3b> ReadPhoto(const PhotoSource& photos, const std::string& name,
                            const Camera& camera) {
  Result<cv::Mat3b> photo = photos(name);
  const cv::Size size(static_cast<int>(camera.Width()), static_cast<int>(camera.Height()));
  if (!photo.ok() || photo->size() == size) return photo;
  return InvalidArgument("photo " + name + " has " + SizeText(photo->size()) +
                         " pixels, its camera in the model " + SizeText(size));
}

Result<PhotoSource> PhotosOfSession(const SessionPaths& paths) {
  const Result<std::unique_ptr<Ledger>> ledger = Ledger::OpenReadOnly(paths.Ledger());
  if (!ledger.ok()) return ledger.status();
  const Result<SessionState> state = ReadSession(**ledger);
  if (!state.ok()) return state.status();
  std::map<std::string, std::string> blob_ids;
  for (const auto& [id, photo] : state->photos()) {
    blob_ids[photo.image.agent + "/" + photo.image.name] = photo.image.blob_id;
  }
  const Result<DecoderPtr> decoder = StartDecoder();
  if (!decoder.ok()) return decoder.status();
  return PhotoSource([blobs = BlobStore(paths.Blobs()), ids = std::move(blob_ids),
                      decoder = *decoder](const std::string& name) -> Result<cv::Mat3b> {
    const auto id = ids.find(name);
    if (id == ids.end()) return NotFound("the session has no photo " + Printable(name));
    return Decode(decoder.get(), name, blobs.Get(id->second));
  });
}

Result<PhotoSource> PhotosOfFolder(const std::filesystem::path& folder) {
  const Result<DecoderPtr> decoder = StartDecoder();
  if (!decoder.ok()) return decoder.status();
  return PhotoSource([folder, decoder = *decoder](const std::string& name) -> Result<cv::Mat3b> {
    if (Status status = CheckPhotoName(name); !status.ok()) return status.Within(Printable(name));
    return Decode(decoder.get(), name, ReadFile((folder / name).string()));
  });
}

}  // namespace skein
