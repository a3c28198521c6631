// Stands in for COLMAP 3.8's header of this name, which includes PBA (GPL-3).
// estimators/pose.cc is the only file compiled here that wants it, for this one function.
#pragma once

#include <ceres/ceres.h>

namespace colmap {

void PrintSolverSummary(const ceres::Solver::Summary& summary);

}  // namespace colmap
