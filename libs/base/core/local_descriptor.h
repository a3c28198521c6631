#pragma once

namespace skein {

// A local descriptor is RootSIFT as COLMAP stores it: kDescriptorDim values of type uint8, the
// vector's Euclidean norm is kDescriptorNorm up to rounding. Another descriptor needs changes in:
//  - services/features/sift.h: SiftExtractor calls the extractor; RootSift quantises.
//  - data/vlad_codebook.bin: scripts/train_codebook.sh learns it again, with another id.
//  - services/matching/kernel.h: ratio and distance limit of MatchOptions, CompactDescriptors. The
//    kernels for each instruction set are written for 128 values (static_assert in kernel_block.h).
//  - libs/base/formats/formats.cc: another version of the blob, so that the descriptors of an older
//    session are refused, not compared.
// The order of preemptive matching also needs a scale for each keypoint (Keypoint::scale_px).

// SIFT's 4 x 4 cells of 8 directions (Lowe 2004, section 6).
inline constexpr int kDescriptorDim = 128;

// COLMAP's factor: value = min(255, round(512 sqrt(L1-normalised value))).
inline constexpr int kDescriptorNorm = 512;

}  // namespace skein
