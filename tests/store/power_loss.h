// The states in which a power loss could leave a folder, made from what record_writes.c wrote down.
//
// What was synced is there. Of what was not: writes to a file are kept, dropped or torn into
// sectors, each for itself; changes of a folder's entries (files made, renamed, linked, removed)
// are kept up to one of them. A file's sync does not keep its entry, and a folder's not those of
// folders above it, as POSIX has it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "core/bytes.h"

namespace skein::store_test {

struct LogRecord {
  char kind = 0;
  int32_t fd = -1;
  int64_t offset = 0;
  std::string text;
  Bytes data;
};

// Throws std::runtime_error for what is no such log.
std::vector<LogRecord> ReadLog(const std::filesystem::path& log);

class PowerLoss {
 public:
  // `folder` is the one that was recorded; what is in it now was there, and synced, before.
  explicit PowerLoss(std::filesystem::path folder);

  void Apply(const LogRecord& record);
  // Notes so far.
  const std::vector<std::string>& notes() const { return notes_; }
  // Writes the state that a loss now leaves, drawn by the seed, to `to`.
  void WriteState(uint64_t seed, const std::filesystem::path& to) const;

 private:
  struct Change {  // of a file: bytes at offset, or its size; of a folder: an entry
    bool is_size = false;
    int64_t offset = 0;
    Bytes data;
    std::string added, removed;
    int node = -1;  // of `added`
  };
  struct Node {
    bool is_folder = false;
    Bytes bytes;                         // of a file, synced
    std::map<std::string, int> entries;  // of a folder, synced
    std::vector<Change> changes;         // since
  };

  int Load(const std::filesystem::path& path);
  int AddNode(bool is_folder);
  int Find(const std::string& path) const;  // -1: none
  int FolderOf(const std::string& path) const;
  void AddEntry(const std::string& path, int node);
  void RemoveEntry(const std::string& path);
  void Rename(const std::string& from, const std::string& to);
  static void ApplyTo(Bytes* bytes, const Change& change);
  static void ApplyTo(std::map<std::string, int>* entries, const Change& change);
  void Sync(int node);
  Bytes DrawBytes(const Node& node, std::mt19937_64* random) const;
  void WriteNode(int node, const std::filesystem::path& to, std::mt19937_64* random,
                 std::map<int, std::filesystem::path>* written) const;

  const std::filesystem::path folder_;
  std::vector<Node> nodes_;  // the first is the folder
  std::map<int32_t, int> open_;
  std::map<uint64_t, int> loaded_;  // by inode
  std::vector<std::string> notes_;
};

}  // namespace skein::store_test
