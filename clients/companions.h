// Depth maps and masks that lie beside photos in a folder, as many data sets hold them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace skein {

// Takes the companions out of `photos`, the photo files of a folder's walk, and returns them. A PNG
// or TIFF is a companion if its photo is among `photos`:
//  - STEM_depth, with - or . in place of _, also mask, seg and segmentation: its photo has the
//    stem or the whole name STEM, or the stem STEM_color or STEM_rgb.
//  - STEM in a folder depth, depths, depth_maps, mask, masks or segmentation: alike, but its photo
//    lies in another folder.
// The photo lies in the same folder, the folder above, or images, rgb, color or photos beside it.
// Suffixes and names of folders count in any case. No file is a companion by its name alone.
std::vector<std::filesystem::path> TakeCompanions(std::vector<std::filesystem::path>* photos);

// How a companion is told: "in masks", else "*_depth.png".
std::string KindOfCompanion(const std::filesystem::path& companion);

}  // namespace skein
