#pragma once

namespace skein {

// Values of a local descriptor: SIFT's 4 x 4 cells of 8 directions (Lowe 2004, section 6).
inline constexpr int kDescriptorDim = 128;

}  // namespace skein
