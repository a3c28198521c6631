// Folders: their files, and syncing so that a power loss loses none. An entry of a folder, as a new
// file's or a new folder's, is only there after a power loss when the folder was synced.
#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/result.h"

namespace skein {

Status SyncFolder(const std::filesystem::path& dir);

// Creates the folder and those above it that are missing, and syncs the entry of each.
Status CreateFolders(const std::filesystem::path& dir);

// Everything on the file system of `path`: after many files, before they are called done.
Status SyncFileSystem(const std::filesystem::path& path);

// Calls `on_entry` for all below `folder`, at any depth, in no order, with what lstat(2) tells of
// it. Symbolic links are not followed, but for `folder` itself. One folder is open at a time: no
// depth uses up this process's descriptors. `on_unread`: a folder or an entry that is there and
// cannot be read, and why. Entries that vanish meanwhile are left out.
void WalkFolder(
    const std::filesystem::path& folder,
    const std::function<void(const std::filesystem::path&, const struct stat&)>& on_entry,
    const std::function<void(const std::filesystem::path&, const std::string&)>& on_unread);

// The regular files below `folder`, at any depth, sorted. Symbolic links are neither listed nor
// followed, `folder` itself included. A file that vanishes meanwhile is left out; a folder that is
// absent holds none.
std::vector<std::filesystem::path> FilesUnder(const std::filesystem::path& folder);

}  // namespace skein
