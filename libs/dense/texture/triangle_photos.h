// The photo that each triangle of a mesh takes its texture from.
//
// As Waechter et al., Let there be color! (2014): a labelling of the triangles with least energy.
// Its data term prefers the photo that shows a triangle best, its smoothness term few seams.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "depth/coloured_map.h"
#include "surface/surface_mesh.h"

namespace skein {

// The photos that show a triangle best, best first.
struct TriangleViews {
  static constexpr int kMost = 6;
  std::array<int32_t, kMost> photo{};
  std::array<float, kMost> score{};  // ViewScore of the corner that has the least
  int count = 0;
};

// The views of each triangle. Photo i is that of map i. A photo shows a triangle if it shows all
// three corners (PixelThatShows) from the front.
std::vector<TriangleViews> ViewsOf(const SurfaceMesh& mesh, const std::vector<ColouredMap>& maps,
                                   int num_threads);

// Three neighbours of each triangle t, at 3 t: neighbour k shares its corners k and k + 1. -1:
// none.
std::vector<int32_t> NeighboursOf(const SurfaceMesh& mesh);

// The photo of each triangle, of its views; -1 without a view.
std::vector<int32_t> ChoosePhotos(const std::vector<TriangleViews>& views,
                                  const std::vector<int32_t>& neighbours);

}  // namespace skein
