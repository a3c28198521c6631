#include "ledger/write_ahead_log.h"

#include <cstdint>
#include <cstring>

#include "core/bytes.h"
#include "core/file_below.h"

namespace skein {
namespace {

constexpr size_t kMaxLogBytes = size_t{4} << 30;
constexpr size_t kHeaderSize = 32;
constexpr size_t kFrameHeaderSize = 24;
constexpr uint32_t kMagic = 0x377f0682;  // its last bit: checksums of big-endian words

uint32_t BigEndian(const uint8_t* bytes) {
  return uint32_t{bytes[0]} << 24 | uint32_t{bytes[1]} << 16 | uint32_t{bytes[2]} << 8 | bytes[3];
}

class LogReader {
 public:
  explicit LogReader(const Bytes& log) : log_(log) {}

  std::string Damage() {
    if (log_.empty()) return "";
    if (!ReadHeader()) return "its header is damaged: what is in it is lost";
    size_t num_sound = 0;
    while (IsFrame(num_sound) && IsSound(num_sound)) ++num_sound;
    // Frames of an earlier generation have other salts.
    size_t num_lost = 0;
    for (size_t i = num_sound; IsFrame(i); ++i) num_lost += IsOfThisGeneration(i);
    if (num_lost == 0) return "";
    return std::to_string(num_lost) + " pages behind a damaged one are lost";
  }

 private:
  bool ReadHeader() {
    if (log_.size() < kHeaderSize) return false;
    const uint32_t magic = BigEndian(log_.data());
    if ((magic & ~1U) != kMagic) return false;
    big_endian_ = (magic & 1U) != 0;
    page_size_ = BigEndian(log_.data() + 8);
    if (page_size_ < 512 || page_size_ > 65536) return false;
    Add(log_.data(), 24);
    return IsSum(log_.data() + 24);
  }

  const uint8_t* Frame(size_t i) const {
    return log_.data() + kHeaderSize + i * (kFrameHeaderSize + page_size_);
  }
  bool IsFrame(size_t i) const {
    return kHeaderSize + (i + 1) * (kFrameHeaderSize + page_size_) <= log_.size();
  }
  bool IsOfThisGeneration(size_t i) const {
    return std::memcmp(Frame(i) + 8, log_.data() + 16, 8) == 0;
  }
  bool IsSound(size_t i) {
    Add(Frame(i), 8);
    Add(Frame(i) + kFrameHeaderSize, page_size_);
    return IsOfThisGeneration(i) && IsSum(Frame(i) + 16);
  }

  uint32_t Word(const uint8_t* bytes) const {
    if (big_endian_) return BigEndian(bytes);
    uint32_t word = 0;
    std::memcpy(&word, bytes, sizeof(word));
    return word;
  }
  void Add(const uint8_t* bytes, size_t size) {
    for (size_t i = 0; i < size; i += 8) {
      sums_[0] += Word(bytes + i) + sums_[1];
      sums_[1] += Word(bytes + i + 4) + sums_[0];
    }
  }
  bool IsSum(const uint8_t* bytes) const {
    return BigEndian(bytes) == sums_[0] && BigEndian(bytes + 4) == sums_[1];
  }

  const Bytes& log_;
  bool big_endian_ = false;
  size_t page_size_ = 0;
  uint32_t sums_[2] = {0, 0};
};

}  // namespace

std::string DamageOfWriteAheadLog(const std::filesystem::path& path) {
  const Result<Bytes> log = ReadFileBelow(path.parent_path(), path, kMaxLogBytes);
  if (log.code() == StatusCode::kNotFound) return "";
  return log.ok() ? LogReader(*log).Damage() : log.error();
}

}  // namespace skein
