#pragma once

// Vectors as one byte a value: value = scale * q, q in -127..127, scale = max |value| / 127. A
// search fetches a quarter of the memory, which bounds it from some ten thousand photos on.
//
// The rounding error is at most scale / 2 a value. Only its component along the difference of two
// vectors changes their distance: some 0.1 % for unit vectors of a thousand values.
//
// Layout: float scale, int32 sum of q^2, int8 q[dim]. Sums are integers, so distances are the same
// on every processor.

#include <cstddef>
#include <cstdint>
#include <vector>

namespace skein {

using Int8Vector = std::vector<char>;

// Sum of products of n values. The versions that this processor runs, fastest first; all give the
// same.
using Int8Dot = int32_t (*)(const int8_t* a, const int8_t* b, size_t n);
std::vector<Int8Dot> Int8Dots();

size_t Int8VectorSize(size_t dim);  // in bytes

// Encodes `dim` finite values.
Int8Vector ToInt8(const float* values, size_t dim);

// Squared Euclidean distance of two stored vectors of *dim values, in the form that hnswlib calls.
float Int8DistanceSq(const void* a, const void* b, const void* dim);

}  // namespace skein
