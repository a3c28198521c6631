#include "core/file_below.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "core/file.h"
#include "core/folder.h"
#include "core/hash.h"

namespace skein {

namespace fs = std::filesystem;

namespace {

Status LastError(const std::string& what, const fs::path& path) {
  return FileError(what, path.string(), errno);
}

constexpr size_t kHashPieceBytes = 1 << 20;
// A temporary name begins with so much of the file's. File systems take 255 bytes, and the rest
// tells it from others.
constexpr size_t kMaxStemBytes = 200;
constexpr char kSecondName[] = "a file with a second name";

std::string KindOf(mode_t mode) {
  if (S_ISLNK(mode)) return "a symbolic link";
  if (S_ISFIFO(mode)) return "a FIFO";
  if (S_ISSOCK(mode)) return "a socket";
  if (S_ISDIR(mode)) return "a folder";
  return "a device";
}

Status NotOpened(const fs::path& path, const std::string& what) {
  return InvalidArgument(path.string() + " is " + what + ", which is not opened there");
}

// The names below `root`; an error where `path` does not go down from there.
Result<std::vector<std::string>> NamesBelow(const fs::path& root, const fs::path& path) {
  std::vector<std::string> names;
  if (path == root) return names;
  for (const fs::path& part : path.lexically_relative(root)) {
    const std::string name = part.string();
    if (name == "." || name == "..") return NotOpened(path, "not below " + root.string());
    if (!name.empty()) names.push_back(name);
  }
  if (names.empty()) return NotOpened(path, "not below " + root.string());
  return names;
}

Result<FileDescriptor> OpenRoot(const fs::path& root) {
  FileDescriptor folder(
      ::open(root.empty() ? "." : root.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder.get() < 0) return LastError("cannot open", root);
  return folder;
}

// A folder in the folder `in`. `shown` is for messages.
Result<FileDescriptor> OpenFolderIn(const FileDescriptor& in, const std::string& name,
                                    const fs::path& shown) {
  FileDescriptor folder(
      ::openat(in.get(), name.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  if (folder.get() >= 0) return folder;
  const int failed = errno;
  struct stat info {};
  const bool is_there = ::fstatat(in.get(), name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0;
  if (is_there && S_ISREG(info.st_mode)) return NotOpened(shown, "a file, not a folder");
  if (is_there && !S_ISDIR(info.st_mode)) return NotOpened(shown, KindOf(info.st_mode));
  return FileError("cannot open", shown.string(), failed);
}

// Goes down `num_names` of the names. `make`: makes what is missing, with `mode`.
Result<FileDescriptor> OpenFolderBelow(const fs::path& root, const std::vector<std::string>& names,
                                       size_t num_names, bool make = false, mode_t mode = 0) {
  Result<FileDescriptor> folder = OpenRoot(root);
  fs::path shown = root;
  for (size_t i = 0; folder.ok() && i < num_names; ++i) {
    shown /= names[i];
    if (make && ::mkdirat(folder->get(), names[i].c_str(), mode) == 0) {
      if (::fsync(folder->get()) != 0) return LastError("cannot sync", shown.parent_path());
    } else if (make && errno != EEXIST) {
      return LastError("cannot create", shown);
    }
    folder = OpenFolderIn(*folder, names[i], shown);
  }
  return folder;
}

struct Place {
  FileDescriptor folder;
  std::string name;
};

Result<Place> PlaceOf(const fs::path& root, const fs::path& path) {
  const Result<std::vector<std::string>> names = NamesBelow(root, path);
  if (!names.ok()) return names.status();
  if (names->empty()) return NotOpened(path, "the folder itself");
  Result<FileDescriptor> folder = OpenFolderBelow(root, *names, names->size() - 1);
  if (!folder.ok()) return folder.status();
  return Place{*std::move(folder), names->back()};
}

// The name is checked before it is opened, as opening a device may have an effect, and the
// descriptor after, as the name may stand for another file then.
Result<FileDescriptor> OpenIn(int folder, const std::string& name, const fs::path& path, int flags,
                              mode_t mode) {
  struct stat info {};
  if (::fstatat(folder, name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISREG(info.st_mode)) {
    return NotOpened(path, KindOf(info.st_mode));
  }
  FileDescriptor file(
      ::openat(folder, name.c_str(), flags | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC, mode));
  if (file.get() < 0) return LastError("cannot open", path);
  if (::fstat(file.get(), &info) != 0) return LastError("cannot stat", path);
  if (!S_ISREG(info.st_mode)) return NotOpened(path, KindOf(info.st_mode));
  const bool is_written = (flags & O_ACCMODE) != O_RDONLY;
  if (is_written && info.st_nlink > 1) return NotOpened(path, kSecondName);
  return file;
}

Status WriteTemporary(int folder, const std::string& name, const fs::path& path, const void* data,
                      size_t size, mode_t mode) {
  const Result<FileDescriptor> file = OpenIn(folder, name, path, O_WRONLY | O_CREAT | O_EXCL, mode);
  if (!file.ok()) return file.status();
  const auto* next = static_cast<const uint8_t*>(data);
  for (size_t left = size; left > 0;) {
    const ssize_t written = ::write(file->get(), next, left);
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return LastError("cannot write", path);
    next += written;
    left -= static_cast<size_t>(written);
  }
  if (::fsync(file->get()) != 0) return LastError("cannot sync", path);
  struct stat info {};
  if (::fstat(file->get(), &info) != 0) return LastError("cannot stat", path);
  if (static_cast<size_t>(info.st_size) != size) {
    return Unavailable("short write to " + path.string());
  }
  return Status::Ok();
}

}  // namespace

FileDescriptor::~FileDescriptor() {
  if (fd_ >= 0) ::close(fd_);
}

Result<FileDescriptor> OpenFileBelow(const fs::path& root, const fs::path& path, int flags,
                                     mode_t mode) {
  const Result<Place> place = PlaceOf(root, path);
  if (!place.ok()) return place.status();
  return OpenIn(place->folder.get(), place->name, path, flags, mode);
}

Result<Bytes> ReadFileBelow(const fs::path& root, const fs::path& path, size_t max_bytes) {
  const Result<FileDescriptor> file = OpenFileBelow(root, path, O_RDONLY);
  if (!file.ok()) return file.status();
  return ReadDescriptor(file->get(), path.string(), max_bytes);
}

Result<std::string> HashFileBelow(const fs::path& root, const fs::path& path, size_t left_out) {
  const Result<FileDescriptor> file = OpenFileBelow(root, path, O_RDONLY);
  if (!file.ok()) return file.status();
  struct stat info {};
  if (::fstat(file->get(), &info) != 0) return LastError("cannot stat", path);
  auto left = static_cast<size_t>(info.st_size);
  if (left < left_out) return DataLoss("file is too short: " + path.string());
  left -= left_out;
  Hasher hasher;
  Bytes piece(std::min(left, kHashPieceBytes));
  while (left > 0) {
    const ssize_t got = ::read(file->get(), piece.data(), std::min(left, piece.size()));
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return LastError("cannot read", path);
    if (got == 0) return DataLoss("file shrank while it was read: " + path.string());
    hasher.Update(piece.data(), static_cast<size_t>(got));
    left -= static_cast<size_t>(got);
  }
  return hasher.Finish();
}

Status CheckFileBelow(const fs::path& root, const fs::path& path) {
  const Result<Place> place = PlaceOf(root, path);
  if (!place.ok()) return place.status();
  struct stat info {};
  if (::fstatat(place->folder.get(), place->name.c_str(), &info, AT_SYMLINK_NOFOLLOW) != 0) {
    return errno == ENOENT ? Status::Ok() : LastError("cannot stat", path);
  }
  if (!S_ISREG(info.st_mode)) return NotOpened(path, KindOf(info.st_mode));
  return info.st_nlink > 1 ? NotOpened(path, kSecondName) : Status::Ok();
}

bool IsFileBelow(const fs::path& root, const fs::path& path) {
  const Result<Place> place = PlaceOf(root, path);
  struct stat info {};
  return place.ok() &&
         ::fstatat(place->folder.get(), place->name.c_str(), &info, AT_SYMLINK_NOFOLLOW) == 0 &&
         S_ISREG(info.st_mode);
}

Status WriteFileBelow(const fs::path& root, const fs::path& path, const void* data, size_t size,
                      mode_t mode) {
  const Result<Place> place = PlaceOf(root, path);
  if (!place.ok()) return place.status();
  const int folder = place->folder.get();
  const std::string temporary = TemporaryName(place->name.substr(0, kMaxStemBytes));
  Status status =
      WriteTemporary(folder, temporary, path.parent_path() / temporary, data, size, mode);
  if (status && ::renameat(folder, temporary.c_str(), folder, place->name.c_str()) != 0) {
    status = LastError("cannot rename to", path);
  }
  if (!status) {
    ::unlinkat(folder, temporary.c_str(), 0);
    return status;
  }
  if (::fsync(folder) != 0) return LastError("cannot sync", path.parent_path());
  return Status::Ok();
}

Status WriteFileBelow(const fs::path& root, const fs::path& path, const Bytes& bytes) {
  return WriteFileBelow(root, path, bytes.data(), bytes.size());
}

Status CreateFoldersBelow(const fs::path& root, const fs::path& dir, mode_t mode) {
  const Result<std::vector<std::string>> names = NamesBelow(root, dir);
  if (!names.ok()) return names.status();
  return OpenFolderBelow(root, *names, names->size(), true, mode).status();
}

Status RenameBelow(const fs::path& root, const fs::path& from, const fs::path& to) {
  const Result<Place> source = PlaceOf(root, from);
  if (!source.ok()) return source.status();
  const Result<Place> target = PlaceOf(root, to);
  if (!target.ok()) return target.status();
  if (::renameat(source->folder.get(), source->name.c_str(), target->folder.get(),
                 target->name.c_str()) == 0) {
    return Status::Ok();
  }
  return LastError("cannot rename " + from.string() + " to", to);
}

Status CopyFilesBelow(const fs::path& root, const fs::path& from, const fs::path& to_root,
                      const fs::path& to, size_t max_bytes) {
  std::vector<fs::path> files = FilesUnder(from);
  if (IsFileBelow(root, from)) files = {from};
  for (const fs::path& file : files) {
    const fs::path target = file == from ? to : to / file.lexically_relative(from);
    const Result<Bytes> bytes = ReadFileBelow(root, file, max_bytes);
    if (!bytes.ok()) return bytes.status();
    if (Status made = CreateFoldersBelow(to_root, target.parent_path()); !made.ok()) return made;
    if (Status done = WriteFileBelow(to_root, target, *bytes); !done.ok()) return done;
  }
  return Status::Ok();
}

std::vector<OddEntry> OddEntriesUnder(const fs::path& root) {
  std::vector<OddEntry> odd;
  WalkFolder(
      root,
      [&](const fs::path& path, const struct stat& info) {
        if (S_ISREG(info.st_mode) || S_ISDIR(info.st_mode)) return;
        odd.push_back({path, KindOf(info.st_mode)});
      },
      [&](const fs::path& path, const std::string& why) {
        odd.push_back({path, "an entry that cannot be read (" + why + ")"});
      });
  std::sort(odd.begin(), odd.end(),
            [](const OddEntry& a, const OddEntry& b) { return a.path < b.path; });
  return odd;
}

}  // namespace skein
