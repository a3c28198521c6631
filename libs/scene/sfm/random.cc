#include "sfm/random.h"

#include "sfm/colmap_api.h"

namespace skein {

void SetRandomSeed(unsigned seed) { colmap::SetPRNGSeed(seed); }

}  // namespace skein
