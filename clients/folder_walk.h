// Separates a folder's files of its owner from those that a file manager, a NAS or a trash keeps
// there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace skein {

struct FolderWalk {
  // Regular files, also behind links, in no particular order. No file is hidden or below a folder
  // that is skipped.
  std::vector<std::filesystem::path> files;
  // Files and folders that are skipped by their names (IsSkippedName).
  std::vector<std::filesystem::path> skipped;
  // Links to folders that are walked anyway, or to one that holds the walk's own folder.
  std::vector<std::filesystem::path> repeated;
  // Links that lead to no file or folder, as when a disk is not mounted.
  std::vector<std::filesystem::path> dangling;
  // Folders that may not be read.
  std::vector<std::filesystem::path> unreadable;
};

// Hidden names (".thumbnails", ".Trash-1000", "._IMG.JPG") and, in any case, the names of folders
// for thumbnails and trash: "@eaDir" and "#recycle" (Synology), "$RECYCLE.BIN", "System Volume
// Information" and "Thumbs" (Windows), "__MACOSX" (archives of macOS).
bool IsSkippedName(const std::string& name);

// Walks `folder` and what is below it. A folder is known by its device and inode, and walked once:
// by its own path rather than by a link's, by the first of several links in the order of their
// paths. Links to files are followed. The name of `folder` itself may be a skipped one. A file that
// vanishes meanwhile is left out. Throws std::filesystem::filesystem_error if `folder` itself
// cannot be read.
FolderWalk WalkFolder(const std::filesystem::path& folder);

}  // namespace skein
