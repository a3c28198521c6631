#include "store/power_loss.h"

#include <sys/stat.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "core/file.h"

namespace skein::store_test {

namespace fs = std::filesystem;

namespace {

constexpr size_t kSector = 512;

enum class Fate { kKept, kDropped, kTorn };

Fate Draw(std::mt19937_64* random) { return static_cast<Fate>((*random)() % 3); }

std::pair<std::string, std::string> Paths(const std::string& text) {
  const size_t zero = text.find('\0');
  if (zero == std::string::npos) throw std::runtime_error("a record lacks its second path");
  return {text.substr(0, zero), text.substr(zero + 1)};
}

std::string NameOf(const std::string& path) { return path.substr(path.rfind('/') + 1); }

}  // namespace

std::vector<LogRecord> ReadLog(const fs::path& log) {
  const Result<Bytes> bytes = ReadFile(log.string());
  if (!bytes.ok()) throw std::runtime_error(bytes.error());
  ByteReader reader(*bytes);
  std::vector<LogRecord> records;
  while (reader.remaining() > 0) {
    LogRecord record;
    int64_t text_size = 0, size = 0;
    const bool read = reader.Get(&record.kind) && reader.Get(&record.fd) &&
                      reader.Get(&record.offset) && reader.Get(&text_size) && reader.Get(&size) &&
                      text_size >= 0 && size >= 0 &&
                      static_cast<size_t>(text_size) <= reader.remaining();
    if (!read) throw std::runtime_error("a record is cut short");
    record.text.resize(static_cast<size_t>(text_size));
    reader.GetRaw(record.text.data(), record.text.size());
    if (static_cast<size_t>(size) > reader.remaining()) throw std::runtime_error("cut short");
    record.data.resize(static_cast<size_t>(size));
    reader.GetRaw(record.data.data(), record.data.size());
    records.push_back(std::move(record));
  }
  return records;
}

PowerLoss::PowerLoss(fs::path folder) : folder_(std::move(folder)) { Load(folder_); }

int PowerLoss::AddNode(bool is_folder) {
  nodes_.emplace_back();
  nodes_.back().is_folder = is_folder;
  return static_cast<int>(nodes_.size()) - 1;
}

int PowerLoss::Load(const fs::path& path) {
  if (!fs::is_directory(path)) {
    struct stat info {};
    if (::stat(path.c_str(), &info) != 0) throw std::runtime_error("stat " + path.string());
    const auto known = loaded_.find(info.st_ino);
    if (known != loaded_.end()) return known->second;
    const int node = loaded_[info.st_ino] = AddNode(false);
    nodes_[node].bytes = *ReadFile(path.string());
    return node;
  }
  const int node = AddNode(true);
  for (const auto& entry : fs::directory_iterator(path)) {
    const int child = Load(entry.path());
    nodes_[node].entries[entry.path().filename().string()] = child;
  }
  return node;
}

// By the entries as the process saw them.
int PowerLoss::Find(const std::string& path) const {
  if (path == folder_.string()) return 0;
  const int folder = FolderOf(path);
  if (folder < 0) return -1;
  std::map<std::string, int> entries = nodes_[folder].entries;
  for (const Change& change : nodes_[folder].changes) ApplyTo(&entries, change);
  const auto found = entries.find(NameOf(path));
  return found == entries.end() ? -1 : found->second;
}

int PowerLoss::FolderOf(const std::string& path) const {
  return Find(path.substr(0, path.rfind('/')));
}

void PowerLoss::AddEntry(const std::string& path, int node) {
  Change change;
  change.added = NameOf(path);
  change.node = node;
  nodes_.at(FolderOf(path)).changes.push_back(change);
}

void PowerLoss::RemoveEntry(const std::string& path) {
  Change change;
  change.removed = NameOf(path);
  nodes_.at(FolderOf(path)).changes.push_back(change);
}

// Within a folder at once.
void PowerLoss::Rename(const std::string& from, const std::string& to) {
  const int node = Find(from);
  if (FolderOf(from) != FolderOf(to)) {
    AddEntry(to, node);
    return RemoveEntry(from);
  }
  Change change;
  change.removed = NameOf(from);
  change.added = NameOf(to);
  change.node = node;
  nodes_.at(FolderOf(to)).changes.push_back(change);
}

void PowerLoss::ApplyTo(Bytes* bytes, const Change& change) {
  const auto end = static_cast<size_t>(change.offset) + change.data.size();
  if (change.is_size || bytes->size() < end) bytes->resize(end);
  std::copy(change.data.begin(), change.data.end(), bytes->begin() + change.offset);
}

void PowerLoss::ApplyTo(std::map<std::string, int>* entries, const Change& change) {
  entries->erase(change.removed);
  if (change.node >= 0) (*entries)[change.added] = change.node;
}

void PowerLoss::Sync(int number) {
  Node& node = nodes_.at(number);
  for (const Change& change : node.changes) {
    node.is_folder ? ApplyTo(&node.entries, change) : ApplyTo(&node.bytes, change);
  }
  node.changes.clear();
}

void PowerLoss::Apply(const LogRecord& record) {
  const auto change = [&](bool is_size) {
    Change change;
    change.is_size = is_size;
    change.offset = record.offset;
    change.data = record.data;
    return change;
  };
  switch (record.kind) {
    case 'o': {
      int node = Find(record.text);
      if (node < 0) AddEntry(record.text, node = AddNode(false));
      open_[record.fd] = node;
      if (record.offset == 1) {
        Change empty;
        empty.is_size = true;
        nodes_[node].changes.push_back(empty);
      }
      break;
    }
    case 'w':
      nodes_.at(open_.at(record.fd)).changes.push_back(change(false));
      break;
    case 't':
      nodes_.at(open_.at(record.fd)).changes.push_back(change(true));
      break;
    case 's':
      Sync(open_.at(record.fd));
      break;
    case 'a':
      for (size_t node = 0; node < nodes_.size(); ++node) Sync(static_cast<int>(node));
      break;
    case 'r':
      Rename(Paths(record.text).first, Paths(record.text).second);
      break;
    case 'l':
      AddEntry(Paths(record.text).second, Find(Paths(record.text).first));
      break;
    case 'u':
      RemoveEntry(record.text);
      break;
    case 'm':
      AddEntry(record.text, AddNode(true));
      break;
    case 'n':
      notes_.push_back(record.text);
      break;
    default:
      throw std::runtime_error("a record of no kind");
  }
}

Bytes PowerLoss::DrawBytes(const Node& node, std::mt19937_64* random) const {
  Bytes bytes = node.bytes;
  for (const Change& change : node.changes) {
    const Fate fate = Draw(random);
    if (fate == Fate::kKept) ApplyTo(&bytes, change);
    if (fate != Fate::kTorn) continue;
    for (size_t at = 0; at < change.data.size(); at += kSector) {
      if ((*random)() % 2 == 0) continue;
      Change sector;
      sector.offset = change.offset + static_cast<int64_t>(at);
      const auto begin = change.data.begin() + static_cast<ptrdiff_t>(at);
      sector.data.assign(
          begin, begin + static_cast<ptrdiff_t>(std::min(kSector, change.data.size() - at)));
      ApplyTo(&bytes, sector);
    }
  }
  return bytes;
}

// Two entries of one file are links to it.
void PowerLoss::WriteNode(int number, const fs::path& to, std::mt19937_64* random,
                          std::map<int, fs::path>* written) const {
  const Node& node = nodes_.at(number);
  if (!node.is_folder) {
    const auto known = written->find(number);
    if (known != written->end()) return fs::create_hard_link(known->second, to);
    const Bytes bytes = DrawBytes(node, random);
    std::ofstream(to, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    (*written)[number] = to;
    return;
  }
  fs::create_directories(to);
  std::map<std::string, int> entries = node.entries;
  const Fate fate = Draw(random);
  const size_t num_kept = fate == Fate::kKept      ? node.changes.size()
                          : fate == Fate::kDropped ? 0
                                                   : (*random)() % (node.changes.size() + 1);
  for (size_t i = 0; i < num_kept; ++i) ApplyTo(&entries, node.changes[i]);
  for (const auto& [name, child] : entries) WriteNode(child, to / name, random, written);
}

void PowerLoss::WriteState(uint64_t seed, const fs::path& to) const {
  std::mt19937_64 random(seed);
  std::map<int, fs::path> written;
  WriteNode(0, to, &random, &written);
}

}  // namespace skein::store_test
