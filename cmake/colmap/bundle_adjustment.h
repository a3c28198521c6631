// Stands in for COLMAP's header of this name. estimators/pose.cc includes it for this function
// alone.
#pragma once

#include <ceres/ceres.h>

#include <iostream>
#include <string>

namespace colmap {

// 3.8 gives no header, 3.10 one.
inline void PrintSolverSummary(const ceres::Solver::Summary& summary,
                               const std::string& header = "") {
  std::cout << header << '\n' << summary.BriefReport() << std::endl;
}

}  // namespace colmap
