#include "surface/surface_nets.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <utility>

#include "core/threads.h"

namespace skein {
namespace {

constexpr int kCorners = 8;  // corner c of a cell: voxel (c & 1, c >> 1 & 1, c >> 2 & 1)
constexpr int kAxes = 3;

Eigen::Vector3f CornerOf(int c) {
  return {static_cast<float>(c & 1), static_cast<float>(c >> 1 & 1),
          static_cast<float>(c >> 2 & 1)};
}

// A cell with known corners.
class Cell {
 public:
  explicit Cell(const std::array<const Voxel*, kCorners>& voxels) : voxels_(voxels) {
    for (int c = 0; c < kCorners; ++c) {
      distances_[c] = voxels_[c]->Distance();
      if (distances_[c] < 0) solid_ |= 1 << c;
    }
  }

  // Bit c: corner c lies behind the surface.
  int solid() const { return solid_; }
  bool HasSurface() const { return solid_ != 0 && solid_ != (1 << kCorners) - 1; }

  // Mean of the surface's crossings of the edges, from corner 0, in voxels.
  Eigen::Vector3f Crossing() const {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (int axis = 0; axis < kAxes; ++axis) {
      for (int a = 0; a < kCorners; ++a) {
        const int b = a | 1 << axis;
        if (a == b || (solid_ >> a & 1) == (solid_ >> b & 1)) continue;
        sum += CornerOf(a);
        sum[axis] += distances_[a] / (distances_[a] - distances_[b]);
        ++count;
      }
    }
    return sum / static_cast<float>(count);
  }

  // Gradient of the trilinear interpolation at a position in the cell, of length 1.
  Eigen::Vector3f Normal(const Eigen::Vector3f& at) const {
    Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
    for (int c = 0; c < kCorners; ++c) {
      for (int axis = 0; axis < kAxes; ++axis) {
        const float share = ShareOf(c, (axis + 1) % kAxes, at) * ShareOf(c, (axis + 2) % kAxes, at);
        gradient[axis] += (c >> axis & 1) != 0 ? share * distances_[c] : -share * distances_[c];
      }
    }
    const float length = gradient.norm();
    if (!(length > 0)) return Eigen::Vector3f::UnitZ();  // a saddle: any is as good
    return gradient / length;
  }

  std::array<uint8_t, 3> Colour() const {
    int64_t weight = 0;
    std::array<int64_t, 3> sum{};
    for (const Voxel* voxel : voxels_) {
      weight += voxel->weight;
      for (int c = 0; c < 3; ++c) sum[c] += voxel->colour[2 - c];
    }
    std::array<uint8_t, 3> colour{};
    for (int c = 0; c < 3; ++c) colour[c] = static_cast<uint8_t>((sum[c] + weight / 2) / weight);
    return colour;
  }

 private:
  // Weight of corner c in the linear interpolation along an axis.
  static float ShareOf(int c, int axis, const Eigen::Vector3f& at) {
    return (c >> axis & 1) != 0 ? at[axis] : 1 - at[axis];
  }

  const std::array<const Voxel*, kCorners> voxels_;
  std::array<float, kCorners> distances_{};
  int solid_ = 0;
};

// A block's cells: cell (x, y, z) has voxel (x, y, z) as its corner 0.
struct BlockNet {
  struct CellVertex {
    int16_t cell;
    uint8_t solid;
  };

  std::array<int16_t, kBlockVoxels> vertex_of;  // -1: the cell has none
  std::vector<CellVertex> cells;                // of each vertex
  std::vector<MeshVertex> vertices;
  std::vector<uint32_t> indices;  // of the mesh
  uint32_t first = 0;             // the mesh's index of the first vertex
};

class NetMaker {
 public:
  // Triangles are made of the first `num_own` blocks; the others give vertices to them.
  NetMaker(const SurfaceVolume& volume, std::vector<BlockIndex> blocks, size_t num_own)
      : volume_(volume), blocks_(std::move(blocks)), num_own_(num_own), nets_(blocks_.size()) {
    for (size_t i = 0; i < blocks_.size(); ++i) net_of_[blocks_[i]] = &nets_[i];
  }

  SurfaceMesh Make() {
    SetOrigin();
    ForEachNet(nets_.size(), [this](size_t i) { AddVertices(blocks_[i], &nets_[i]); });
    uint32_t count = 0;
    for (BlockNet& net : nets_) {
      net.first = count;
      count += static_cast<uint32_t>(net.vertices.size());
    }
    mesh_.vertices.reserve(count);
    ForEachNet(num_own_, [this](size_t i) { AddTriangles(blocks_[i], &nets_[i]); });
    for (BlockNet& net : nets_) Append(&net);
    return std::move(mesh_);
  }

 private:
  template <typename Function>
  void ForEachNet(size_t count, const Function& function) const {
    ForEachOnThreads(volume_.num_threads(), count, function);
  }

  Eigen::Vector3d PositionOf(const BlockIndex& i) const {
    return kBlockSide * volume_.voxel() * Eigen::Vector3d(i.x, i.y, i.z);
  }

  // The middle of all blocks.
  void SetOrigin() {
    if (blocks_.empty()) return;
    Eigen::Vector3d low = PositionOf(blocks_[0]), high = low;
    for (const BlockIndex& block : blocks_) {
      low = low.cwiseMin(PositionOf(block));
      high = high.cwiseMax(PositionOf(block));
    }
    mesh_.origin = (low + high) / 2;
  }

  // ---- Vertices ----

  void AddVertices(const BlockIndex& index, BlockNet* net) const {
    net->vertex_of.fill(-1);
    std::array<const Block*, kCorners> blocks{};  // from which a cell's corners come
    for (int c = 0; c < kCorners; ++c) {
      blocks[c] = volume_.Find(index.Plus(c & 1, c >> 1 & 1, c >> 2 & 1));
    }
    const Eigen::Vector3d corner = PositionOf(index) - mesh_.origin;
    for (int z = 0; z < kBlockSide; ++z) {
      for (int y = 0; y < kBlockSide; ++y) {
        for (int x = 0; x < kBlockSide; ++x) {
          AddVertex(blocks, Eigen::Vector3i(x, y, z), corner, net);
        }
      }
    }
  }

  void AddVertex(const std::array<const Block*, kCorners>& blocks, const Eigen::Vector3i& at,
                 const Eigen::Vector3d& block_corner, BlockNet* net) const {
    std::array<const Voxel*, kCorners> voxels{};
    for (int c = 0; c < kCorners; ++c) {
      voxels[c] = VoxelAt(blocks, at.x() + (c & 1), at.y() + (c >> 1 & 1), at.z() + (c >> 2 & 1));
      if (voxels[c] == nullptr || voxels[c]->weight < kLeastWeight) return;
    }
    const Cell cell(voxels);
    if (!cell.HasSurface()) return;
    const Eigen::Vector3f crossing = cell.Crossing();
    const Eigen::Vector3d position =
        block_corner + volume_.voxel() * (at.cast<double>() + crossing.cast<double>());
    const int number = VoxelOf(at.x(), at.y(), at.z());
    net->vertex_of[number] = static_cast<int16_t>(net->vertices.size());
    net->cells.push_back({static_cast<int16_t>(number), static_cast<uint8_t>(cell.solid())});
    net->vertices.push_back({position.cast<float>(), cell.Normal(crossing), cell.Colour()});
  }

  static const Voxel* VoxelAt(const std::array<const Block*, kCorners>& blocks, int x, int y,
                              int z) {
    const int which = x / kBlockSide | y / kBlockSide << 1 | z / kBlockSide << 2;
    if (blocks[which] == nullptr) return nullptr;
    return &(*blocks[which])[VoxelOf(x % kBlockSide, y % kBlockSide, z % kBlockSide)];
  }

  // ---- Triangles ----

  // The edges that leave corner 0 of each cell: each edge once.
  void AddTriangles(const BlockIndex& index, BlockNet* net) const {
    std::array<const BlockNet*, kCorners> nets{};  // of the blocks below, by axis
    for (int c = 0; c < kCorners; ++c) {
      const auto found = net_of_.find(index.Plus(-(c & 1), -(c >> 1 & 1), -(c >> 2 & 1)));
      nets[c] = found == net_of_.end() ? nullptr : found->second;
    }
    for (const BlockNet::CellVertex& cell : net->cells) {
      const bool is_solid = (cell.solid & 1) != 0;
      for (int axis = 0; axis < kAxes; ++axis) {
        const bool is_next_solid = (cell.solid >> (1 << axis) & 1) != 0;
        if (is_solid == is_next_solid) continue;
        AddQuad(nets, cell.cell, axis, is_next_solid, net);
      }
    }
  }

  // Around the edge along `axis` from corner 0 of the cell.
  void AddQuad(const std::array<const BlockNet*, kCorners>& nets, int cell, int axis, bool reverse,
               BlockNet* net) const {
    const int second = 1 << (axis + 1) % kAxes, third = 1 << (axis + 2) % kAxes;
    const int around[] = {0, second, second | third, third};  // axes along which a cell lies below
    std::array<const MeshVertex*, 4> vertices{};
    std::array<uint32_t, 4> quad{};
    for (int i = 0; i < 4; ++i) {
      vertices[i] = VertexOf(nets, cell, around[i], &quad[i]);
      if (vertices[i] == nullptr) return;
    }
    if (reverse) {
      std::swap(quad[1], quad[3]);
      std::swap(vertices[1], vertices[3]);
    }
    const auto length = [&](int a, int b) {
      return (vertices[a]->position - vertices[b]->position).squaredNorm();
    };
    // Along the shorter diagonal.
    const int turn = length(0, 2) <= length(1, 3) ? 0 : 1;
    for (const int i : {0, 1, 2, 0, 2, 3}) net->indices.push_back(quad[(i + turn) % 4]);
  }

  // The vertex of the cell before `cell` along the axes of which `below` has bits, with its index
  // in the mesh.
  static const MeshVertex* VertexOf(const std::array<const BlockNet*, kCorners>& nets, int cell,
                                    int below, uint32_t* index) {
    int at[] = {cell % kBlockSide, cell / kBlockSide % kBlockSide, cell / kBlockSide / kBlockSide};
    int which = 0;
    for (int axis = 0; axis < kAxes; ++axis) {
      if ((below >> axis & 1) == 0) continue;
      if (at[axis] == 0) which |= 1 << axis;
      at[axis] = (at[axis] + kBlockSide - 1) % kBlockSide;
    }
    if (nets[which] == nullptr) return nullptr;
    const int vertex = nets[which]->vertex_of[VoxelOf(at[0], at[1], at[2])];
    if (vertex < 0) return nullptr;
    *index = nets[which]->first + static_cast<uint32_t>(vertex);
    return &nets[which]->vertices[vertex];
  }

  void Append(BlockNet* net) {
    mesh_.vertices.insert(mesh_.vertices.end(), net->vertices.begin(), net->vertices.end());
    mesh_.indices.insert(mesh_.indices.end(), net->indices.begin(), net->indices.end());
    *net = BlockNet();
  }

  const SurfaceVolume& volume_;
  const std::vector<BlockIndex> blocks_;
  const size_t num_own_;
  std::vector<BlockNet> nets_;  // of each block
  std::unordered_map<BlockIndex, const BlockNet*, BlockHash> net_of_;
  SurfaceMesh mesh_;
};

// Blocks of the volume in the cube of side^3 blocks from `first` on; is_border: those that touch
// the cube from below, along any axis.
void AddBlocks(const SurfaceVolume& volume, const BlockIndex& first, int side, bool is_border,
               std::vector<BlockIndex>* blocks) {
  for (int z = -1; z < side; ++z) {
    for (int y = -1; y < side; ++y) {
      for (int x = -1; x < side; ++x) {
        const BlockIndex block = first.Plus(x, y, z);
        const bool is_below = x < 0 || y < 0 || z < 0;
        if (is_below == is_border && volume.Find(block) != nullptr) blocks->push_back(block);
      }
    }
  }
}

// Vertices that no triangle has go.
void DropUnused(SurfaceMesh* mesh) {
  constexpr uint32_t kUnused = UINT32_MAX;
  std::vector<uint32_t> place(mesh->vertices.size(), kUnused);
  std::vector<MeshVertex> used;
  for (uint32_t& index : mesh->indices) {
    if (place[index] == kUnused) {
      place[index] = static_cast<uint32_t>(used.size());
      used.push_back(mesh->vertices[index]);
    }
    index = place[index];
  }
  mesh->vertices = std::move(used);
}

}  // namespace

SurfaceMesh MeshOf(const SurfaceVolume& volume) {
  std::vector<BlockIndex> blocks = volume.Blocks();
  const size_t num_blocks = blocks.size();
  return NetMaker(volume, std::move(blocks), num_blocks).Make();
}

SurfaceMesh MeshOfCube(const SurfaceVolume& volume, const BlockIndex& first, int side) {
  std::vector<BlockIndex> blocks;
  AddBlocks(volume, first, side, false, &blocks);
  const size_t num_own = blocks.size();
  AddBlocks(volume, first, side, true, &blocks);
  SurfaceMesh mesh = NetMaker(volume, std::move(blocks), num_own).Make();
  DropUnused(&mesh);
  return mesh;
}

}  // namespace skein
