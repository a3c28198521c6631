#pragma once

// The inner loops of SIFT, one source (sift_kernels_body.h) compiled for each instruction set. The
// portable version is NEON on AArch64: its vectors are of 16 bytes.
//
// A row is a pointer to its column 0. Rows that are written or read by vectors are aligned and have
// kRowPadding floats of room behind their width.

#include <cstdint>

#include "core/instruction_set.h"

namespace skein {

constexpr int kOctaveLayers = 3;                    // Lowe 2004, section 3.2
constexpr int kGaussianLevels = kOctaveLayers + 3;  // of an octave
constexpr int kDogLevels = kOctaveLayers + 2;
constexpr double kOctaveSigma = 1.6;         // pixels, of an octave's first level (Lowe 2004, 3.3)
constexpr double kContrastThreshold = 0.02;  // of an octave's three differences together, 0..1:
                                             // as COLMAP's peak threshold 0.02 / kOctaveLayers
constexpr double kEdgeThreshold = 10;        // ratio of principal curvatures; COLMAP's
constexpr int kBlockRows = 4;                // rows that are blurred at a time
constexpr int kRowPadding = 64;
constexpr int kMaxBlurRadius = 16;

// A pixel of a level that is kept for orientations and descriptors: grey value times kLevelUnit.
using LevelPixel = uint16_t;
constexpr float kLevelUnit = 256;

// One block of rows of the next level: a Gaussian blur, vertical first, columns reflected.
struct BlurRows {
  const float* rows[kBlockRows + 2 * kMaxBlurRadius];  // 2 * radius + 4 input rows, top first
  const float* weights;                                // 2 * radius + 1
  int radius;                                          // 2..kMaxBlurRadius
  int width;
  float* scratch;                 // kBlockRows x (width + 3 * kRowPadding)
  float* out[kBlockRows];         // blurred rows
  float* difference[kBlockRows];  // out - the input row at its place
};

// One block of rows of the doubled image, blurred. Output pixel 2i lies at input pixel i.
struct DoubleRows {
  const float* rows[2 + 2 * kMaxBlurRadius];  // 2 * radius + 3 input rows for two pairs of rows
  const float* even;                          // 2 * radius + 2 weights, of input i - radius ...
  const float* odd;                           // ... i + radius + 1
  int radius;
  int width;       // of the input
  float* scratch;  // (kBlockRows + 2) x (width + 3 * kRowPadding)
  float* out[kBlockRows];
};

// Rows y - 1, y and y + 1 of each difference of Gaussians.
struct ExtremaRow {
  const float* rows[kDogLevels][3];
  int first, last;  // columns searched; `first` > 0
  float threshold;
  float* scratch;  // 2 * kOctaveLayers x (last + 3 * kRowPadding)
};

struct FoundExtremum {
  int32_t column;
  int32_t layer;  // 1..kOctaveLayers
};

// A level and a keypoint in it, pixel centres at integers.
struct KeypointPatch {
  const LevelPixel* pixels;
  int stride, width, height;  // pixels; width and height at least 4
  float x, y;
  float sigma;  // of the keypoint, pixels of the level
  float angle_rad;
};

constexpr int kOrientationBins = 36;

struct SiftKernels {
  void (*blur)(const BlurRows& task);
  void (*double_size)(const DoubleRows& task);
  // At most one extremum for each pixel and layer; `found` has room for them.
  int (*find_extrema)(const ExtremaRow& task, FoundExtremum* found);
  // Grey values -> pixels of a kept level.
  void (*keep)(const float* row, int width, LevelPixel* out);
  // Gradients around the keypoint by direction, clockwise from +x.
  void (*orientations)(const KeypointPatch& patch, float* histogram);
  // 4 x 4 x 8 gradients, not normalised.
  void (*describe)(const KeypointPatch& patch, float* descriptor);
};

const SiftKernels& KernelsOf(InstructionSet version);

SiftKernels PortableSiftKernels();
// x86-64 only.
SiftKernels Avx2SiftKernels();
SiftKernels Avx512SiftKernels();

}  // namespace skein
