#include "session/read_session.h"

#include <string>
#include <vector>

#include "core/statistics.h"
#include "ledger/ledger_record.h"

namespace skein {

namespace {

// Of each agent the median, so that a few absurd altitudes don't matter.
std::map<std::string, double> TakeOffAltitudes(const SessionState& state, int64_t last_seq) {
  std::map<std::string, std::vector<double>> all;
  for (const auto& [id, photo] : state.photos()) {
    const image_t& image = photo.image;
    if (image.header.seq > last_seq || !image.has_gps || !image.has_altitude ||
        !image.has_relative_altitude)
      continue;
    all[image.agent].push_back(image.altitude_m - image.relative_altitude_m);
  }
  std::map<std::string, double> medians;
  for (const auto& [agent, altitudes] : all) medians[agent] = percentile(altitudes, 50);
  return medians;
}

}  // namespace

Result<SessionState> ReadSession(const Ledger& ledger) {
  SessionState state;
  Status failure;
  const Status read = ledger.ForEach([&](const LedgerRecord& record) {
    if (!failure.ok()) return;
    const Result<Fact> fact = DecodeRecord(record);
    if (fact.ok()) {
      state.Apply(*fact);
    } else {
      failure = fact.status();
    }
  });
  if (!read.ok()) return read;
  if (!failure.ok()) return failure;
  return state;
}

std::optional<GeodeticPosition> PositionOf(const image_t& image) {
  if (!image.has_gps) return std::nullopt;
  GeodeticPosition position{image.latitude_deg, image.longitude_deg, {}};
  if (image.has_altitude) position.altitude_m = image.altitude_m;
  return position;
}

PhotoPositions PositionsOf(const SessionState& state, int64_t last_seq) {
  const std::map<std::string, double> take_offs = TakeOffAltitudes(state, last_seq);
  PhotoPositions positions;
  for (const auto& [id, photo] : state.photos()) {
    const image_t& image = photo.image;
    if (image.header.seq > last_seq) continue;
    std::optional<GeodeticPosition> position = PositionOf(image);
    if (!position) continue;
    const auto take_off = take_offs.find(image.agent);
    if (!position->altitude_m && image.has_relative_altitude && take_off != take_offs.end()) {
      position->altitude_m = take_off->second + image.relative_altitude_m;
    }
    positions[image.agent + "/" + image.name] = *position;
  }
  return positions;
}

std::map<int64_t, TextureFields> TexturesOf(const SessionState& state) {
  std::map<int64_t, TextureFields> textures;
  for (const auto& [id, photo] : state.photos()) {
    if (const auto texture = TextureOf(photo)) textures.emplace(id, *texture);
  }
  return textures;
}

}  // namespace skein
