#pragma once

namespace skein {

// Seeds the random numbers of the calling thread, from which every RANSAC of this library draws.
void SetRandomSeed(unsigned seed);

}  // namespace skein
