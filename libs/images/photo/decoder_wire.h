// Messages between PhotoDecoder and its child, skein-decoder. The photo's bytes and its pixels lie
// in memory that both map; messages of a SOCK_SEQPACKET socket say what to do with them. Neither
// memory nor messages leave the host.
#pragma once

#include <cstdint>

#include "core/bytes.h"
#include "core/result.h"
#include "photo/exif.h"
#include "photo/photo_header.h"

namespace skein {

// The child's descriptors.
constexpr int kDecoderSocket = 3;
constexpr int kDecoderInput = 4;   // the photo
constexpr int kDecoderOutput = 5;  // the pixels: BGR, row major, uint8, without padding

constexpr size_t kMaxDecoderMessage = 8192;

struct DecoderRequest {
  enum class Kind : uint8_t { kCheck, kDecode };
  Kind kind = Kind::kCheck;
  uint64_t photo_bytes = 0;
  PhotoHeader header;     // as the parent reads it
  uint8_t reduction = 1;  // of kDecode: both sides are divided by 1, 2, 4 or 8
};

// Bytes of the pixels, for kDecode.
inline size_t DecodedBytes(const DecoderRequest& request) {
  return 3 * static_cast<size_t>(ReducedSide(request.header.width_px, request.reduction)) *
         static_cast<size_t>(ReducedSide(request.header.height_px, request.reduction));
}

struct DecoderAnswer {
  Status status;                     // why the photo cannot be decoded
  Exif exif;                         // of kCheck
  uint64_t address_space_bytes = 0;  // of the first answer, which no request asked for
};

// At most kMaxDecoderMessage bytes: texts are cut.
Bytes EncodeDecoderRequest(const DecoderRequest& request);
Bytes EncodeDecoderAnswer(const DecoderAnswer& answer);

// An error for anything that the other side would not send: also values that no photo has.
Result<DecoderRequest> ParseDecoderRequest(const void* data, size_t size);
Result<DecoderAnswer> ParseDecoderAnswer(const void* data, size_t size);

}  // namespace skein
