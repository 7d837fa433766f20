#include "fusion/combine/bordered_system.h"

#include <random>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

constexpr int kNodes = 6;
constexpr int kBorder = 3;
constexpr int kSize = kNodes * kNodeUnknowns + kBorder;

/// A random positive definite system, and the same as one dense matrix.
struct Twin {
  BorderedSystem system{kNodes, kBorder};
  Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(kSize, kSize);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(kSize);

  Twin() {
    std::mt19937 generator(5);
    std::normal_distribution<double> normal;
    const auto add = [&](int node, bool with_next) {
      // One equation with random coefficients on one node or two, and the border.
      Eigen::VectorXd row = Eigen::VectorXd::Zero(kSize);
      for (int j = 0; j < (with_next ? 2 : 1) * kNodeUnknowns; ++j) row(node * kNodeUnknowns + j) = normal(generator);
      for (int j = 0; j < kBorder; ++j) row(kNodes * kNodeUnknowns + j) = normal(generator);
      dense += row * row.transpose();
      right += row * normal(generator);
    };
    for (int node = 0; node < kNodes; ++node)
      for (int k = 0; k < 25; ++k) add(node, node + 1 < kNodes);
    for (int i = 0; i < kNodes; ++i) {
      const auto k = static_cast<std::size_t>(i);
      system.diagonal[k] = dense.block<kNodeUnknowns, kNodeUnknowns>(i * kNodeUnknowns, i * kNodeUnknowns);
      if (i + 1 < kNodes)
        system.upper[k] = dense.block<kNodeUnknowns, kNodeUnknowns>(i * kNodeUnknowns, (i + 1) * kNodeUnknowns);
      system.right[k] = right.segment<kNodeUnknowns>(i * kNodeUnknowns);
    }
    system.border = dense.bottomLeftCorner(kBorder, kNodes * kNodeUnknowns);
    system.corner = dense.bottomRightCorner<kBorder, kBorder>();
    system.border_right = right.tail<kBorder>();
  }
};

}  // namespace

TEST_CASE("bordered_system: draws spread as the whole covariance says, across nodes too") {
  Twin twin;
  REQUIRE(twin.system.solve());
  const Eigen::MatrixXd inverse = twin.dense.inverse();
  // One column of normal values for each unknown: their outer products add up to the covariance itself.
  const Eigen::MatrixXd draws = twin.system.deviations(Eigen::MatrixXd::Identity(kSize, kSize));
  const Eigen::MatrixXd spread = draws * draws.transpose();
  const Eigen::MatrixXd expected = inverse.topLeftCorner(kSize - kBorder, kSize - kBorder);
  CHECK((spread - expected).cwiseAbs().maxCoeff() < 1e-9 * expected.cwiseAbs().maxCoeff());
}

TEST_CASE("bordered_system: with the border held, the nodes are what the dense system makes of the rest") {
  Twin twin;
  const Eigen::VectorXd held = Eigen::VectorXd::Constant(kBorder, 0.3);
  for (int i = 0; i < kNodes; ++i)
    twin.system.right[static_cast<std::size_t>(i)] -=
        twin.system.border.middleCols<kNodeUnknowns>(i * kNodeUnknowns).transpose() * held;
  REQUIRE(twin.system.solve_nodes(held));
  constexpr int kInner = kSize - kBorder;
  const Eigen::VectorXd rest = twin.right.head(kInner) - twin.dense.topRightCorner(kInner, kBorder) * held;
  const Eigen::VectorXd expected = twin.dense.topLeftCorner(kInner, kInner).llt().solve(rest);
  for (int i = 0; i < kNodes; ++i)
    CHECK((twin.system.node_solution[static_cast<std::size_t>(i)] - expected.segment<kNodeUnknowns>(i * kNodeUnknowns))
              .norm() < 1e-8 * expected.norm());
  CHECK(twin.system.border_solution == held);
}

TEST_CASE("bordered_system: solution and covariances are those of the dense system") {
  Twin twin;
  REQUIRE(twin.system.solve());
  const Eigen::VectorXd solution = twin.dense.llt().solve(twin.right);
  const Eigen::MatrixXd inverse = twin.dense.inverse();
  std::vector<NodeMatrix> own, with_next;
  twin.system.node_covariances(own, with_next);
  twin.system.add_border_covariance(own);
  const double scale = inverse.cwiseAbs().maxCoeff();
  for (int i = 0; i < kNodes; ++i) {
    const auto k = static_cast<std::size_t>(i);
    CHECK((twin.system.node_solution[k] - solution.segment<kNodeUnknowns>(i * kNodeUnknowns)).norm() < 1e-8);
    const auto block = inverse.block<kNodeUnknowns, kNodeUnknowns>(i * kNodeUnknowns, i * kNodeUnknowns);
    CHECK((own[k] - block).cwiseAbs().maxCoeff() < 1e-8 * scale);
  }
  CHECK((twin.system.border_solution - solution.tail<kBorder>()).norm() < 1e-8);
  CHECK((twin.system.border_covariance() - inverse.bottomRightCorner<kBorder, kBorder>()).norm() < 1e-8 * scale);

  const Eigen::MatrixXd sums = Eigen::MatrixXd::Random(kNodes * kNodeUnknowns, 2);
  const Eigen::MatrixXd expected = inverse.topLeftCorner(kNodes * kNodeUnknowns, kNodes * kNodeUnknowns) * sums;
  CHECK((twin.system.covariance_with(sums) - expected).cwiseAbs().maxCoeff() < 1e-7 * scale);
}

TEST_CASE("bordered_system: covariance with the next node is that of the chain with the border held") {
  Twin twin;
  REQUIRE(twin.system.solve());
  constexpr int kChain = kNodes * kNodeUnknowns;
  const Eigen::MatrixXd inverse = twin.dense.topLeftCorner<kChain, kChain>().inverse();
  std::vector<NodeMatrix> own, with_next;
  twin.system.node_covariances(own, with_next);
  for (int i = 0; i + 1 < kNodes; ++i) {
    const auto block = inverse.block<kNodeUnknowns, kNodeUnknowns>(i * kNodeUnknowns, (i + 1) * kNodeUnknowns);
    CHECK((with_next[static_cast<std::size_t>(i)] - block).cwiseAbs().maxCoeff() < 1e-8);
  }
}

TEST_CASE("bordered_system: a matrix that is not positive definite is refused") {
  Twin twin;
  twin.system.diagonal[2](4, 4) = -1.0;
  CHECK_FALSE(twin.system.solve());
}

}  // namespace imprint
