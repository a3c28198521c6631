#include "codecs/decode_check.h"

// jpeglib.h needs FILE and size_t.
#include <jerror.h>
#include <jpeglib.h>
#include <zlib.h>

#include <csetjmp>
#include <cstring>

#include "codecs/image_decoding.h"

namespace skein {
namespace {

struct JpegErrors {
  jpeg_error_mgr manager;  // first: libjpeg hands out a pointer to it
  std::jmp_buf leave;
  char text[JMSG_LENGTH_MAX] = "";
};

bool IsHarmless(int code) {
  return code == JWRN_EXTRANEOUS_DATA || code == JWRN_ADOBE_XFORM || code == JWRN_JFIF_MAJOR;
}

[[noreturn]] void LeaveWithText(j_common_ptr info) {
  auto* errors = reinterpret_cast<JpegErrors*>(info->err);
  info->err->format_message(info, errors->text);
  std::longjmp(errors->leave, 1);
}

void LeaveOnDamage(j_common_ptr info, int level) {
  if (level < 0 && !IsHarmless(info->err->msg_code)) LeaveWithText(info);
}

// Up to the size of the image. Holds nothing with a destructor, as ReadRows: libjpeg leaves by
// longjmp.
bool ReadJpegHeader(ByteView bytes, jpeg_decompress_struct* info, JpegErrors* errors) {
  if (setjmp(errors->leave) != 0) return false;
  jpeg_mem_src(info, bytes.data(), bytes.size());
  jpeg_read_header(info, TRUE);
  return true;
}

// Decodes at an eighth of the size: every coefficient is read, most of the transform is saved.
// `row` has room for one at full size.
bool ReadRows(jpeg_decompress_struct* info, JpegErrors* errors, JSAMPROW row) {
  if (setjmp(errors->leave) != 0) return false;
  info->scale_num = 1;
  info->scale_denom = 8;
  info->out_color_space = info->jpeg_color_space;
  jpeg_start_decompress(info);
  while (info->output_scanline < info->output_height) jpeg_read_scanlines(info, &row, 1);
  jpeg_finish_decompress(info);
  return true;
}

Status ReadWholeJpeg(ByteView bytes, const PhotoHeader& header, jpeg_decompress_struct* info,
                     JpegErrors* errors) {
  const auto damaged = [&] { return DataLoss(std::string("damaged JPEG: ") + errors->text); };
  if (!ReadJpegHeader(bytes, info, errors)) return damaged();
  if (info->image_width != header.width_px || info->image_height != header.height_px) {
    return DataLoss("damaged JPEG: it tells two sizes of the image");
  }
  std::vector<JSAMPLE> row(static_cast<size_t>(info->image_width) * MAX_COMPONENTS);
  return ReadRows(info, errors, row.data()) ? Status::Ok() : damaged();
}

Status CheckJpeg(ByteView bytes, const PhotoHeader& header) {
  JpegErrors errors;
  jpeg_decompress_struct info;
  std::memset(&info, 0, sizeof(info));
  info.err = jpeg_std_error(&errors.manager);
  errors.manager.error_exit = LeaveWithText;
  errors.manager.emit_message = LeaveOnDamage;
  jpeg_create_decompress(&info);
  const Status whole = ReadWholeJpeg(bytes, header, &info, &errors);
  jpeg_destroy_decompress(&info);
  return whole;
}

Status CheckPngChunks(ByteView bytes) {
  const auto u32 = [&](size_t at) {
    return uint32_t{bytes[at]} << 24 | uint32_t{bytes[at + 1]} << 16 |
           uint32_t{bytes[at + 2]} << 8 | bytes[at + 3];
  };
  for (size_t at = 8; at + 12 <= bytes.size();) {
    const size_t length = u32(at);
    if (length > bytes.size() - at - 12) break;
    const uLong crc = crc32(0, bytes.data() + at + 4, static_cast<uInt>(length + 4));
    if (crc != u32(at + 8 + length)) return DataLoss("damaged PNG: wrong checksum");
    if (std::memcmp(bytes.data() + at + 4, "IEND", 4) == 0) return Status::Ok();
    at += 12 + length;
  }
  return DataLoss("damaged PNG: cut short");
}

}  // namespace

Status CheckDecodes(ByteView bytes, const PhotoHeader& header) {
  if (header.format == PhotoFormat::kJpeg) return CheckJpeg(bytes, header);
  if (header.format == PhotoFormat::kPng) {
    if (Status status = CheckPngChunks(bytes); !status.ok()) return status;
  }
  return DecodePhotoOf(header, bytes).status();
}

}  // namespace skein
