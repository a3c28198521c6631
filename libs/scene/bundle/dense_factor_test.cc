#include "bundle/dense_factor.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <random>

#include "bundle/factor_kernels.h"
#include "testing/test_random.h"

namespace skein::dense_factor_test {

Eigen::MatrixXd RandomMatrix(int size, std::mt19937* random) {
  Eigen::MatrixXd J(size, size);
  for (double& value : J.reshaped()) value = Uniform(-1, 1, random);
  return J.transpose() * J + Eigen::MatrixXd::Identity(size, size);
}

Eigen::MatrixXd Upper(const Eigen::MatrixXd& S) { return S.triangularView<Eigen::Upper>(); }

class DenseFactor : public testing::TestWithParam<InstructionSet> {
 protected:
  void SetUp() override {
    if (!IsInstructionSetSupported(GetParam())) GTEST_SKIP() << "not supported by this processor";
  }
  std::mt19937 random_{1};
};

// Sizes below, at and beyond a panel, with whole tiles and without.
TEST_P(DenseFactor, IsEigensAndTheSameWithAnyNumberOfThreads) {
  for (const int size : {0, 1, 7, 192, 193, 390, 576, 603}) {
    const Eigen::MatrixXd S = RandomMatrix(size, &random_);
    Eigen::MatrixXd U = S, by_threads = S;
    ASSERT_TRUE(DecomposeDense(1, &U, GetParam())) << size;
    ASSERT_TRUE(DecomposeDense(3, &by_threads, GetParam())) << size;
    EXPECT_EQ(Upper(U), Upper(by_threads)) << size;
    const Eigen::MatrixXd expected = S.llt().matrixU();
    EXPECT_LE((Upper(U) - expected).norm(), 1e-12 * expected.norm()) << size;
    const Eigen::VectorXd b = RandomMatrix(size, &random_).rowwise().sum();
    const Eigen::VectorXd x = SolveDense(1, U, b);
    EXPECT_LE((S * x - b).norm(), 1e-9 * b.norm()) << size;
    EXPECT_EQ(SolveDense(3, U, b), x) << size;
  }
}

TEST_P(DenseFactor, RefusesWhatIsNotPositiveDefinite) {
  for (const int row : {0, 200, 389}) {
    Eigen::MatrixXd S = RandomMatrix(390, &random_);
    S(row, row) = -1;
    EXPECT_FALSE(DecomposeDense(2, &S, GetParam())) << row;
  }
}

TEST_P(DenseFactor, KernelAddsProductsOfBlocks) {
  using Block = Eigen::Matrix<double, 6, 3>;
  using Square = Eigen::Matrix<double, 6, 6>;
  const Block Y = RandomMatrix(6, &random_).leftCols<3>(),
              W = RandomMatrix(6, &random_).leftCols<3>();
  const Square before = RandomMatrix(6, &random_);
  Square C = before;
  FactorKernelOf(GetParam()).add_product(Y.data(), W.data(), C.data());
  const Square expected = before + Y * W.transpose();
  EXPECT_LE((C - expected).norm(), 1e-14 * expected.norm());
}

INSTANTIATE_TEST_SUITE_P(Versions, DenseFactor, testing::ValuesIn(kInstructionSets),
                         [](const auto& info) { return InstructionSetName(info.param); });

}  // namespace skein::dense_factor_test
