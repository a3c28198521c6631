#include "session/read_session.h"

#include "ledger/ledger_record.h"

namespace skein {

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

std::map<std::string, GeodeticPosition> PositionsOf(const SessionState& state) {
  std::map<std::string, GeodeticPosition> positions;
  for (const auto& [id, photo] : state.photos()) {
    const image_t& image = photo.image;
    if (!image.has_gps) continue;
    positions[image.agent + "/" + image.name] = {image.latitude_deg, image.longitude_deg,
                                                 image.altitude_m};
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
