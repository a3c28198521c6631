#include "guide/guide_options.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <sstream>
#include <utility>

#include "core/file.h"
#include "core/option_check.h"

namespace skein {
namespace {

constexpr size_t kMaxCorners = 100'000;

Status CheckAltitude(const std::string& text) {
  return text.empty() ? Status::Ok() : ParseAltitude(text).status();
}
Status CheckNoGo(const std::string& path) {
  return path.empty() ? Status::Ok() : ReadNoGo(path).status();
}

Status AddPolygon(std::vector<GeodeticPosition>* polygon, int line, NoGoAreas* areas) {
  if (polygon->empty()) return Status::Ok();
  if (polygon->size() < 3) {
    return InvalidArgument("the polygon that ends before line " + std::to_string(line) +
                           " has less than three corners");
  }
  areas->push_back(std::exchange(*polygon, {}));
  return Status::Ok();
}

}  // namespace

Result<AltitudeRange> ParseAltitude(const std::string& text) {
  std::istringstream in(text);
  AltitudeRange range;
  char colon = 0;
  if (!(in >> range.min_m >> colon >> range.max_m) || colon != ':' || !(in >> std::ws).eof() ||
      !std::isfinite(range.min_m) || !std::isfinite(range.max_m) || range.min_m > range.max_m) {
    return InvalidArgument("altitude is " + text + ": give MIN:MAX in metres, e.g. 30:80");
  }
  return range;
}

Result<NoGoAreas> ParseNoGo(const std::string& text) {
  NoGoAreas areas;
  std::vector<GeodeticPosition> polygon;
  std::istringstream lines(text);
  std::string line;
  int number = 0;
  size_t num_corners = 0;
  while (std::getline(lines, line)) {
    ++number;
    const bool is_comment = line.find('#') != std::string::npos;
    std::istringstream in(line.substr(0, line.find('#')));
    if ((in >> std::ws).eof()) {
      if (is_comment) continue;
      const Status added = AddPolygon(&polygon, number, &areas);
      if (!added.ok()) return added;
      continue;
    }
    GeodeticPosition corner;
    const bool is_read = static_cast<bool>(in >> corner.latitude_deg >> corner.longitude_deg);
    if (!is_read || !(in >> std::ws).eof() || !IsPlausible(corner)) {
      return InvalidArgument("line " + std::to_string(number) +
                             ": give a latitude and a longitude in degrees, e.g. 48.1 11.5");
    }
    if (++num_corners > kMaxCorners) return InvalidArgument("more than 100,000 corners");
    polygon.push_back(corner);
  }
  const Status added = AddPolygon(&polygon, number + 1, &areas);
  if (!added.ok()) return added;
  if (areas.empty()) return InvalidArgument("it has no polygon");
  return areas;
}

Result<NoGoAreas> ReadNoGo(const std::string& path) {
  const Result<Bytes> bytes = ReadFile(path);
  if (!bytes.ok()) return bytes.status().Within("no_go");
  const Result<NoGoAreas> areas = ParseNoGo(std::string(bytes->begin(), bytes->end()));
  return areas.ok() ? areas : Result<NoGoAreas>(areas.status().Within("no_go: " + path));
}

Status GuideOptions::Check() const {
  return FirstError({InRange("target_gsd", target_gsd_mm, 0.0, 1e6), CheckAltitude(altitude),
                     CheckNoGo(no_go), InRange("work_share", work_share, 0.001, 1.0)});
}

void AddOptions(CLI::App& app, GuideOptions* options) {
  app.add_option("--target-gsd", options->target_gsd_mm,
                 "Millimetres of the surface that a pixel may cover, where GPS tells the scale; 0: "
                 "twice that of the median point");
  app.add_option("--altitude", options->altitude,
                 "MIN:MAX, metres, as GPS tells them, where agents can be; default: as high as the "
                 "agent's own photos, give or take a third of the distance");
  app.add_option("--no-go", options->no_go,
                 "File of areas to stay out of: a line \"LATITUDE LONGITUDE\" a corner, an empty "
                 "line between two areas");
  app.add_option("--work-share", options->work_share,
                 "Of the host's processor time, that it computes at most");
}

}  // namespace skein
