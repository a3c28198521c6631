// Names of photos, AGENT/NAME in Skein's models, as other programs can read them.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"
#include "sfm/reconstruction.h"

namespace skein {

using WrittenNames = std::map<ImageId, std::string>;  // of registered photos

// Blanks and tabs become '_'. Two names that become one are told apart as "a~2.jpg".
WrittenNames NamesWithoutBlanks(const Reconstruction& model);

// How many of the names NamesWithoutBlanks changes.
int NumNamesWithBlanks(const Reconstruction& model);

// The same for one folder: '/' becomes '_', too, and `extension` (".jpg") takes the place of the
// name's own. A long name is cut, as AGENT_NAME may have more bytes than a file's name.
WrittenNames FlatNames(const Reconstruction& model, const std::string& extension);

void RenameImages(const WrittenNames& names, Reconstruction* model);

// A line "NEW", tab, "OLD" for each.
Status WriteNames(const Reconstruction& model, const WrittenNames& names,
                  const std::filesystem::path& file);

}  // namespace skein
