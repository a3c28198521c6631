#pragma once

#include <string>
#include <vector>

#include "features/codebook.h"
#include "features/global_descriptor.h"

namespace skein {

struct VladOptions {
  int max_features = 8192;  // the first ones of the photo: the strongest
  float power = 0.4f;       // x -> sign(x) |x|^power
};

// Vector of locally aggregated descriptors (Jegou et al. 2010) over RootSIFT: residuals to the
// nearest cell's centre, each of unit length so that no descriptor outweighs another, are summed in
// each cell, turned to the principal axes of that cell's residuals (Delhumeau et al. 2013), of
// which the first C are kept, damped by a power law, normalised cell by cell (Arandjelovic and
// Zisserman 2013) and over all. K * C values.
//
// SIFT is turned to its own orientation, so the vector doesn't depend on which way up the photo is
// stored. All that is learned is learned on local descriptors, of which a few photos have enough.
class VladModel : public GlobalDescriptorModel {
 public:
  VladModel(Codebook codebook, const VladOptions& options);

  const std::string& id() const override { return codebook_.id; }
  int dim() const override { return codebook_.num_cells() * codebook_.cell_dim(); }
  std::vector<float> Describe(const DescribedPhoto& photo) override;

  // N x 128 uint8; empty if n is 0.
  std::vector<float> DescribeDescriptors(const uint8_t* descriptors, size_t n) const;

 private:
  Codebook codebook_;
  VladOptions options_;
};

}  // namespace skein
