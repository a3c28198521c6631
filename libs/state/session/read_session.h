#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>

#include "core/result.h"
#include "formats/texture_fields.h"
#include "geometry/model_georeference.h"
#include "ledger/ledger_store.h"
#include "session/session_state.h"

namespace skein {

// The state of the whole ledger. Error: a fact cannot be read.
Result<SessionState> ReadSession(const Ledger& ledger);

// Position at which the photo was taken, as its file says; nullopt if it says none.
std::optional<GeodeticPosition> PositionOf(const image_t& image);

// The positions that photos carry, of photos up to `last_seq` in the ledger. If only the altitude
// above the take-off is known, the altitude is that plus the altitude of the take-off: the median
// over the agent's photos that carry both.
PhotoPositions PositionsOf(const SessionState& state,
                           int64_t last_seq = std::numeric_limits<int64_t>::max());

// Texture fields by image id, for photos with features.
std::map<int64_t, TextureFields> TexturesOf(const SessionState& state);

}  // namespace skein
