#pragma once

#include <Eigen/Core>

#include "core/instruction_set.h"

namespace skein {

// Cholesky: replaces the upper triangle of S by U, with U' U = S; values below the diagonal are
// lost. Right-looking, by panels. Threads share out the columns; U does not depend on their number.
// Holds 3 kB a row besides. False if S is not positive definite.
bool DecomposeDense(int num_threads, Eigen::MatrixXd* S,
                    InstructionSet version = FastestInstructionSet());

// Solves U' U x = b. x does not depend on the number of threads.
Eigen::VectorXd SolveDense(int num_threads, const Eigen::MatrixXd& U, Eigen::VectorXd b);

}  // namespace skein
