#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "features/global_descriptor.h"
#include "vocabulary/codebook.h"

namespace skein {

// Vector of locally aggregated descriptors (Jegou et al. 2010) over RootSIFT.
//  - Residuals to the nearest cell's centre have unit length, so no descriptor outweighs another by
//    its norm.
//  - Each cell sums its residuals, weighted by scale: large structure survives a change of view,
//    fine texture (grass, gravel) is similar everywhere.
//  - Each sum is projected to the first C principal axes of its cell's residuals (Delhumeau et al.
//    2013).
//  - The projection is damped by a power law and normalised (Arandjelovic and Zisserman 2013).
// The result has K * C values and unit length; zero without features.
Eigen::VectorXf AggregateVlad(const Codebook& codebook, const LocalFeatures& features);

// The vector minus the mean of the training photos, normalised again. SIFT is rotated to its own
// orientation, so the vector is independent of which way up the photo is stored.
class VladModel : public GlobalDescriptorModel {
 public:
  explicit VladModel(Codebook codebook);

  const std::string& id() const override { return codebook_.id; }
  int dim() const override { return static_cast<int>(codebook_.photo_mean.size()); }
  std::vector<float> Describe(const DescribedPhoto& photo) override;
  // Empty without features.
  std::vector<float> DescribeFeatures(const LocalFeatures& features) const;

 private:
  Codebook codebook_;
};

}  // namespace skein
