#include "ingest/disk_room.h"

#include <algorithm>
#include <limits>
#include <system_error>

namespace skein {
namespace {

constexpr int64_t kMegabyte = 1'000'000;

}  // namespace

DiskRoom::DiskRoom(std::filesystem::path dir, int64_t min_free_bytes)
    : dir_(std::filesystem::absolute(dir).lexically_normal()), min_free_bytes_(min_free_bytes) {
  Look();
}

// A file system that does not tell is taken to have room.
void DiskRoom::Look() {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(dir_, error);
  constexpr uintmax_t kMost = std::numeric_limits<int64_t>::max();
  free_bytes_ = static_cast<int64_t>(error ? kMost : std::min(space.available, kMost));
}

std::string DiskRoom::Describe() const {
  if (HasRoomFor(0)) return "";
  return "the disk is almost full: " + std::to_string(free_bytes_ / kMegabyte) + " MB are free, " +
         std::to_string(min_free_bytes_ / kMegabyte) + " MB are needed";
}

std::string DiskRoom::Problem() const {
  if (HasRoomFor(0)) return "";
  return Describe() + "\nMake room on that computer, on the disk that holds " + dir_.string() +
         ". Until then new photos wait where they were taken, nothing that was sent is lost, and "
         "all goes on by itself";
}

}  // namespace skein
