#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace skein {

// Whether the disk takes another photo. Features, matches and models of the photos that are there
// need room, too: so intake stops before the disk is full, and goes on when there is room again.
class DiskRoom {
 public:
  // `dir` lies on the file system that is watched; a person is told its absolute path.
  DiskRoom(std::filesystem::path dir, int64_t min_free_bytes);

  // Looks at the disk; about once a second.
  void Look();
  bool HasRoomFor(int64_t num_bytes) const { return free_bytes_ - num_bytes >= min_free_bytes_; }
  // For a person; "" while there is room.
  std::string Describe() const;
  // The same as heartbeat_t.problem, with what to do; "" while there is room.
  std::string Problem() const;

 private:
  const std::filesystem::path dir_;
  const int64_t min_free_bytes_;
  int64_t free_bytes_ = 0;
};

}  // namespace skein
