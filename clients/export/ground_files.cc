#include "clients/export/ground_files.h"

#include "core/file.h"
#include "depth/hillshade.h"
#include "export/geotiff.h"

namespace skein {
namespace {

nlohmann::json ToJson(const Eigen::Isometry3d& level_from_model) {
  const Eigen::Matrix3d rotation = level_from_model.linear();
  const Eigen::Vector3d shift = level_from_model.translation();
  nlohmann::json rows = nlohmann::json::array();
  for (int i = 0; i < 3; ++i) rows.push_back({rotation(i, 0), rotation(i, 1), rotation(i, 2)});
  return {{"rotation", rows}, {"translation", {shift.x(), shift.y(), shift.z()}}};
}

}  // namespace

std::string Ground::Up() const {
  if (origin) return "GPS";
  return frame.ground_share > 0 ? "ground plane" : "cameras";
}

std::string Ground::HeightsAbove() const {
  if (origin) return origin->altitude_m ? "zero of the photos' altitudes" : "median camera";
  return frame.ground_share > 0 ? "ground plane" : "median point";
}

Ground MakeGround(const std::vector<ColouredMap>& maps,
                  const std::optional<GeodeticPosition>& origin, double cell) {
  Ground ground;
  ground.origin = origin;
  if (!origin) ground.frame = LevelFrameOf(maps);
  ground.grid = MakeGroundGrid(maps, ground.frame.level_from_model, cell);
  if (origin && !ground.grid.height.empty()) ground.grid.height += origin->altitude_m.value_or(0);
  return ground;
}

nlohmann::json ToJson(const Ground& ground) {
  const GroundGrid& grid = ground.grid;
  nlohmann::json json = {{"unit", ground.origin ? "m" : "model"},
                         {"up", ground.Up()},
                         {"heights_above", ground.HeightsAbove()},
                         {"ground_share", nullptr},
                         {"cell", grid.cell},
                         {"west", grid.west},
                         {"north", grid.north},
                         {"columns", grid.height.cols},
                         {"rows", grid.height.rows},
                         {"completeness", grid.Completeness()},
                         {"level_from_model", ToJson(ground.frame.level_from_model)}};
  if (!ground.origin) json["ground_share"] = ground.frame.ground_share;
  return json;
}

Status WriteGround(const Ground& ground, std::map<std::string, std::string> metadata,
                   const std::filesystem::path& folder) {
  const GroundGrid& grid = ground.grid;
  metadata["up"] = ground.Up();
  metadata["heights_above"] = ground.HeightsAbove();
  const GridPlace place{ground.origin, grid.west, grid.north, grid.cell};
  const auto write = [&](const cv::Mat& pixels, const std::string& name) {
    return WriteGeoTiff(pixels, place, metadata, folder / name);
  };
  Status status = write(grid.colour, "orthophoto.tif");
  if (status.ok()) status = write(grid.height, "elevation.tif");
  if (status.ok()) status = write(Hillshade(grid.height, grid.cell), "hillshade.tif");
  if (!status.ok()) return status;
  return WriteFileAtomic((folder / "orthophoto.json").string(), ToJson(ground).dump(1) + "\n");
}

}  // namespace skein
