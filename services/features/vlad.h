#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "features/codebook.h"
#include "features/global_descriptor.h"

namespace skein {

// Vector of locally aggregated descriptors (Jegou et al. 2010) over RootSIFT. Residuals to the
// nearest cell's centre, each of unit length so that no descriptor outweighs another by its norm,
// are summed in each cell, weighted by scale: large structure survives a change of view, fine
// texture (grass, gravel) looks alike everywhere. Each sum is turned to the principal axes of its
// cell's residuals (Delhumeau et al. 2013), of which the first C are kept, damped by a power law
// and normalised (Arandjelovic and Zisserman 2013). K * C values of unit length together; zero if
// there are no features.
Eigen::VectorXf AggregateVlad(const Codebook& codebook, const LocalFeatures& features);

// The above less the mean of the training photos, normalised again. SIFT is turned to its own
// orientation, so the vector doesn't depend on which way up the photo is stored.
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
