#include <iostream>

#include "optim/bundle_adjustment.h"

namespace colmap {

void PrintSolverSummary(const ceres::Solver::Summary& summary) {
  std::cout << summary.BriefReport() << std::endl;
}

}  // namespace colmap
