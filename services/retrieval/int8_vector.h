#pragma once

// Vectors as one byte a value: a quarter of the memory that a search of the index has to fetch, and
// fetching bounds it from some ten thousand photos on. A vector is stored as value = scale * q with
// q in -127..127 and scale = max |value| / 127. A rounding error is at most scale / 2 a value, and
// of all values' errors only the component along the difference of two vectors moves their
// distance: for descriptors of unit length and a thousand values by some 0.1 %.
//
// Layout: float scale, int32 sum of q^2, int8 q[dim]. Distances are the same on every processor, as
// the sums are of integers.

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

// Of `dim` finite values.
Int8Vector ToInt8(const float* values, size_t dim);

// Squared Euclidean distance of two stored vectors of *dim values, in the form that hnswlib calls.
float Int8DistanceSq(const void* a, const void* b, const void* dim);

}  // namespace skein
