#include "photo/decoder_wire.h"

#include <cmath>
#include <optional>

namespace skein {
namespace {

// Changes with the messages: a decoder of another build is told at its start.
constexpr uint32_t kProtocol = 0x534b4404;  // "SKD", 4
constexpr size_t kMaxReason = 400;
constexpr size_t kMaxExifText = 256;

bool IsSane(const GpsPosition& gps) {
  return std::abs(gps.latitude_deg) <= 90 && std::abs(gps.longitude_deg) <= 180 &&
         std::abs(gps.altitude_m.value_or(0)) <= 2.0 * UINT32_MAX &&
         std::abs(gps.relative_altitude_m.value_or(0)) <= 2.0 * UINT32_MAX;
}

bool IsSane(const Exif& exif) {
  return exif.orientation >= 1 && exif.orientation <= 8 && exif.make.size() <= kMaxExifText &&
         exif.model.size() <= kMaxExifText &&
         (!exif.focal_px || (std::isfinite(*exif.focal_px) && *exif.focal_px > 0)) &&
         std::isfinite(exif.digital_zoom) && exif.digital_zoom >= 1 &&
         (!exif.gps || IsSane(*exif.gps));
}

bool IsReduction(int value) { return value == 1 || value == 2 || value == 4 || value == 8; }

void PutOptional(const std::optional<double>& value, ByteWriter* writer) {
  writer->Put(static_cast<uint8_t>(value.has_value()));
  writer->Put(value.value_or(0));
}

bool GetOptional(ByteReader* reader, std::optional<double>* value) {
  uint8_t is_set = 0;
  double number = 0;
  if (!reader->Get(&is_set) || !reader->Get(&number)) return false;
  *value = is_set != 0 ? std::optional(number) : std::nullopt;
  return true;
}

void PutExif(const Exif& exif, ByteWriter* writer) {
  writer->Put(static_cast<uint8_t>(exif.orientation));
  writer->PutString(exif.make.substr(0, kMaxExifText));
  writer->PutString(exif.model.substr(0, kMaxExifText));
  PutOptional(exif.focal_px, writer);
  writer->Put(static_cast<uint8_t>(exif.focal_is_guess));
  writer->Put(exif.digital_zoom);
  writer->Put(exif.capture_utime_us);
  writer->Put(static_cast<uint8_t>(exif.gps.has_value()));
  const GpsPosition gps = exif.gps.value_or(GpsPosition());
  writer->Put(gps.latitude_deg);
  writer->Put(gps.longitude_deg);
  PutOptional(gps.altitude_m, writer);
  PutOptional(gps.relative_altitude_m, writer);
}

bool GetExif(ByteReader* reader, Exif* exif) {
  uint8_t orientation = 0, is_guess = 0, has_gps = 0;
  GpsPosition gps;
  const bool read = reader->Get(&orientation) && reader->GetString(&exif->make) &&
                    reader->GetString(&exif->model) && GetOptional(reader, &exif->focal_px) &&
                    reader->Get(&is_guess) && reader->Get(&exif->digital_zoom) &&
                    reader->Get(&exif->capture_utime_us) && reader->Get(&has_gps) &&
                    reader->Get(&gps.latitude_deg) && reader->Get(&gps.longitude_deg) &&
                    GetOptional(reader, &gps.altitude_m) &&
                    GetOptional(reader, &gps.relative_altitude_m);
  exif->orientation = orientation;
  exif->focal_is_guess = is_guess != 0;
  if (has_gps != 0) exif->gps = gps;
  return read && IsSane(*exif);
}

bool GetProtocol(ByteReader* reader) {
  uint32_t protocol = 0;
  return reader->Get(&protocol) && protocol == kProtocol;
}

Status Nonsense() { return DataLoss("not a message of this build's decoder"); }

}  // namespace

Bytes EncodeDecoderRequest(const DecoderRequest& request) {
  ByteWriter writer;
  writer.Put(kProtocol);
  writer.Put(request.kind);
  writer.Put(request.photo_bytes);
  writer.Put(request.header.format);
  writer.Put(request.header.width_px);
  writer.Put(request.header.height_px);
  writer.Put(request.reduction);
  return writer.Take();
}

Result<DecoderRequest> ParseDecoderRequest(const void* data, size_t size) {
  ByteReader reader(data, size);
  DecoderRequest request;
  PhotoHeader& header = request.header;
  const bool read = GetProtocol(&reader) && reader.Get(&request.kind) &&
                    reader.Get(&request.photo_bytes) && reader.Get(&header.format) &&
                    reader.Get(&header.width_px) && reader.Get(&header.height_px) &&
                    reader.Get(&request.reduction);
  if (!read || reader.remaining() > 0 || !IsReduction(request.reduction)) return Nonsense();
  return request;
}

Bytes EncodeDecoderAnswer(const DecoderAnswer& answer) {
  ByteWriter writer;
  writer.Put(kProtocol);
  writer.Put(static_cast<uint8_t>(answer.status.code));
  writer.PutString(answer.status.text.substr(0, kMaxReason));
  PutExif(answer.exif, &writer);
  writer.Put(answer.address_space_bytes);
  return writer.Take();
}

Result<DecoderAnswer> ParseDecoderAnswer(const void* data, size_t size) {
  ByteReader reader(data, size);
  DecoderAnswer answer;
  uint8_t code = 0;
  const bool read = GetProtocol(&reader) && reader.Get(&code) &&
                    reader.GetString(&answer.status.text) && GetExif(&reader, &answer.exif) &&
                    reader.Get(&answer.address_space_bytes);
  const bool fits = read && reader.remaining() == 0 &&
                    code <= static_cast<uint8_t>(StatusCode::kInternal) &&
                    answer.status.text.size() <= kMaxReason;
  if (!fits) return Nonsense();
  answer.status.code = static_cast<StatusCode>(code);
  return answer;
}

}  // namespace skein
