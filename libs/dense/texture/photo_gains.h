// Gains that make the colours of photos agree: automatic exposure and white balance change them.
#pragma once

#include <array>
#include <vector>

#include "texture/triangle_photos.h"

namespace skein {

using ColourGain = std::array<double, 3>;  // blue, green, red

// Gains by which the colours of each photo are to be multiplied. With them the logarithms of a
// triangle's colours in two photos differ least, in the sum of squares over pairs of a triangle's
// views: the gain compensation of Brown and Lowe (2007), with their prior of gains near 1, for
// colours. Triangles that are nearly black or white in a view do not count.
std::vector<ColourGain> PhotoGains(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps,
                                   const std::vector<TriangleViews>& views);

}  // namespace skein
