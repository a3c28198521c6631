// Folders: their files, and syncing so that a power loss loses none. An entry of a folder, as a new
// file's or a new folder's, is only there after a power loss when the folder was synced.
#pragma once

#include <filesystem>
#include <vector>

#include "core/result.h"

namespace skein {

Status SyncFolder(const std::filesystem::path& dir);

// Creates the folder and those above it that are missing, and syncs the entry of each.
Status CreateFolders(const std::filesystem::path& dir);

// Everything on the file system of `path`: after many files, before they are called done.
Status SyncFileSystem(const std::filesystem::path& path);

// The regular files below `folder`, at any depth, sorted. Symbolic links are neither listed nor
// followed, `folder` itself included. A file that vanishes meanwhile is left out; a folder that is
// absent holds none.
std::vector<std::filesystem::path> FilesUnder(const std::filesystem::path& folder);

}  // namespace skein
