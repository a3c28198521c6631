// Names of photos, AGENT/NAME in Skein's models, as other programs can read them.
#pragma once

#include <base/reconstruction.h>

#include <filesystem>
#include <map>
#include <string>

#include "core/result.h"

namespace skein {

using WrittenNames = std::map<colmap::image_t, std::string>;  // of registered photos

// Blanks and tabs become '_'. Two names that become one are told apart as "a~2.jpg".
WrittenNames NamesWithoutBlanks(const colmap::Reconstruction& model);

// How many of the names NamesWithoutBlanks changes.
int NumNamesWithBlanks(const colmap::Reconstruction& model);

// The same for one folder: '/' becomes '_', too, and `extension` (".jpg") takes the place of the
// name's own.
WrittenNames FlatNames(const colmap::Reconstruction& model, const std::string& extension);

void RenameImages(const WrittenNames& names, colmap::Reconstruction* model);

// A line "NEW", tab, "OLD" for each.
Status WriteNames(const colmap::Reconstruction& model, const WrittenNames& names,
                  const std::filesystem::path& file);

}  // namespace skein
