#pragma once

// The inner loops of depth maps, one source (sweep_kernels_body.h) compiled for each instruction
// set. All arithmetic is of integers, so every version gives identical results. The portable
// version is NEON on AArch64.
//
// A row is a pointer to its column 0, with kSweepMargin readable bytes before it and behind its
// width.

#include <cstdint>

#include "core/instruction_set.h"

namespace skein {

constexpr int kSweepMargin = 128;  // bytes
constexpr int kSweepBlock = 8;     // columns that read one window of a warped row
constexpr int kSweepWindow = 16;   // bytes of that window
constexpr int kWeightUnit = 64;    // weights of linear interpolation
constexpr int kMaxSweepViews = 3;  // neighbours of a photo
constexpr int kCensusRadius = 3;   // rows and columns around the middle
constexpr int kCensusRows = 2 * kCensusRadius + 1;
constexpr int kCensusBits = 24;       // of a window: comparisons with its middle
constexpr int kSweepLanes = 32;       // the number of steps is a multiple of it
constexpr int kMaxFamilySteps = 128;  // of planes of one slope
constexpr int kMaxSweepSteps = kMaxFamilySteps + 3 * kSweepLanes;
constexpr int kMaxPathCost = 250;  // of a pixel, a step and a path, its penalties included

// A row of a neighbour as a plane shows it: linear between `above` and `below`, then between
// columns.
struct WarpTask {
  const uint8_t *above, *below;  // rows of the neighbour, from its column 0
  int below_weight;              // of kWeightUnit
  int source_width;
  const int32_t* window;  // of each block of kSweepBlock columns: its window's first, ascending
  const uint8_t* pairs;   // of each column: two bytes of its window, to interpolate between
  const int8_t* weights;  // of each column: of these two, their sum is kWeightUnit
  int width;              // a multiple of kSweepBlock
  uint8_t* scratch;       // source_width + 2 * kSweepMargin bytes
  uint8_t* out;           // `width` bytes
};

// Costs of a row by one plane: Hamming distances of census transforms (Zabih and Woodfill 1994).
struct CensusTask {
  const uint8_t* reference[kCensusRows];
  const uint8_t* views[kMaxSweepViews][kCensusRows];
  int first[kMaxSweepViews], last[kMaxSweepViews];  // columns [first, last) that a view shows
  int num_views;
  int threshold;   // grey levels by which a bit's pixel is above the middle
  int truncation;  // a view's cost is at most that of the best view plus this
  int width;
  uint8_t* scratch;  // num_views x (width + kSweepMargin)
  uint8_t* out;      // width + kSweepMargin bytes: sum over the views
};

// One row of semi-global matching (Hirschmueller 2008, equation 13): four paths, one along the row,
// three from the row before. Arrays of costs are [column][step], with one column before the first
// and one behind the last.
struct PathTask {
  const uint8_t* cost;         // of the row, width x steps
  const uint8_t* grey;         // of the row
  const uint8_t* grey_before;  // of the row before, null at the first
  int width, steps;
  int direction;                 // 1: columns ascend, -1: they descend
  int small_penalty;             // of a change by one step
  const uint8_t* large_penalty;  // of a larger one: by the absolute difference of grey, 256
  // Costs of the three paths of the row before and of this row: (width + 2) x (steps + 64), from
  // the column before the first. Their minima: width + 2.
  const uint8_t* before[3];
  const uint8_t* before_min[3];
  uint8_t* now[3];
  uint8_t* now_min[3];
  uint8_t* scratch;            // 2 x (steps + 64)
  const uint16_t* sum_before;  // width x steps, of the other direction; null: none yet
  uint16_t* sum;               // width x steps: that and the four paths
};

// The step of least cost in a column.
struct StepChoice {
  uint8_t step;
  uint16_t before, least, after;  // sums of step - 1, step and step + 1; 0xffff: beyond the end
  uint16_t second;                // the least sum more than two steps away
  uint16_t mean;                  // of the costs (not the sums) over the steps, times 16
  uint8_t cost;                   // at step
};

struct ChoiceTask {
  const uint16_t* sum;  // of each column `steps`, `stride` apart
  const uint8_t* cost;  // the same
  int width, steps, stride;
  StepChoice* out;  // width
};

// Bytes of `steps` rows, [step][column], as [column][step].
struct TransposeTask {
  const uint8_t* const* rows;  // `steps` rows
  int width, steps;
  uint8_t* out;  // (width rounded up to 16) x steps
};

struct SweepKernels {
  // Rows of several neighbours: all are interpolated between rows before one is between columns, as
  // a load across two fresh stores waits for both.
  void (*warp)(const WarpTask* tasks, int count);
  void (*census)(const CensusTask&);
  void (*paths)(const PathTask&);
  void (*choose)(const ChoiceTask&);
  void (*transpose)(const TransposeTask&);
};

// Throws std::invalid_argument for a version that is not supported here.
const SweepKernels& SweepKernelsOf(InstructionSet version);

SweepKernels PortableSweepKernels();
SweepKernels Avx2SweepKernels();
SweepKernels Avx512SweepKernels();

}  // namespace skein
