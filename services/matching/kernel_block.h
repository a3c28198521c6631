#pragma once

// Interface between kernel.cc and its files for each instruction set. These files are compiled with
// -m flags: they include no inline code that the linker could use in other files.
//
// A block is up to 256 rows against up to 256 vectors of columns. One int32 holds a distance and
// its place, so min and max alone keep best and second best:
//
//   row direction     (|b|^2 - 2ab) << 8 | vector of the column, one value a lane
//   column direction  (d^2 << 8) + row + vector of the column
//
// Both fit: d^2 < 2^18, and |b|^2 - 2ab >= -|a|^2.

#include <cstdint>

#include "core/local_descriptor.h"

namespace skein {

// Loops, tiles and strides of every version are written for this length.
static_assert(kDescriptorDim == 128);

constexpr int kBlockRows = 256;
constexpr int kBlockVectors = 256;
constexpr int32_t kNoKey = INT32_MAX;

// |b|^2 of the columns that fill up the last panel: farther than any real one.
constexpr int32_t kPaddingNormSq = (1 << 23) - 1;

struct BlockTask {
  const uint8_t* rows;         // num_rows x 128
  const uint8_t* columns;      // num_panels x 128 / group x panel_columns x group
  const int32_t* row_keys;     // num_rows: |a|^2 << 8 | row
  const int32_t* column_keys;  // a column: |b|^2 << 8 | vector
  int32_t* row_best;           // num_rows x lanes
  int32_t* row_second;         // num_rows x lanes
  int32_t* column_best;        // a column
  int32_t* column_second;      // a column
  int num_rows;
  int num_panels;
};

struct KernelFormat {
  int lanes;          // columns in a vector
  int panel_columns;  // columns in a panel, a multiple of lanes
  int group;          // dimensions of one column that lie together in a panel
  void (*process)(const BlockTask& task);
};

// One descriptor a against some rows of `descriptors`: dots[k] = a . row indices[k].
struct DotTask {
  const uint8_t* a;            // 128
  const uint8_t* descriptors;  // rows of 128
  const uint32_t* indices;     // count
  int count;
  int32_t* dots;  // count
};

constexpr int kPortablePanelColumns = 1;
void ProcessBlockPortable(const BlockTask& task);
void ProcessDotsPortable(const DotTask& task);

// x86-64 only.
constexpr int kAvx2PanelColumns = 16;
void ProcessBlockAvx2(const BlockTask& task);
void ProcessDotsAvx2(const DotTask& task);

constexpr int kAvx512PanelColumns = 64;
void ProcessBlockAvx512Vnni(const BlockTask& task);
void ProcessDotsAvx512Vnni(const DotTask& task);

constexpr int kAmxTileRows = 16;  // rows are read in such groups: the last one is filled up
void ProcessBlockAmx(const BlockTask& task);

// AArch64 only.
constexpr int kNeonPanelColumns = 16;
void ProcessBlockNeon(const BlockTask& task);
void ProcessDotsNeon(const DotTask& task);
void ProcessBlockNeonDot(const BlockTask& task);
void ProcessDotsNeonDot(const DotTask& task);

}  // namespace skein
