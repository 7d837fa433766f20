#pragma once

#include <vector>

#include <Eigen/Dense>

namespace imprint {

/// Unknowns of one node: y, y', z, z', radius and the support function's harmonics 2 to 6 (cosine, sine).
inline constexpr int kNodeUnknowns = 15;
using NodeMatrix = Eigen::Matrix<double, kNodeUnknowns, kNodeUnknowns>;
using NodeVector = Eigen::Matrix<double, kNodeUnknowns, 1>;

/// Normal equations of a chain of nodes, each coupled with the next, and of a border of unknowns that touch all:
/// solved by block Cholesky in a time that grows with the number of nodes only.
class BorderedSystem {
 public:
  BorderedSystem(int nodes, int border);

  // The normal matrix and its right side, to be filled by adding.
  std::vector<NodeMatrix> diagonal;  ///< (i, i), lower half used
  std::vector<NodeMatrix> upper;     ///< (i, i + 1)
  std::vector<NodeVector> right;
  Eigen::MatrixXd border;  ///< (node unknowns, border)
  Eigen::MatrixXd corner;  ///< (border, border)
  Eigen::VectorXd border_right;

  /// Factors and solves; false when the matrix is not positive definite.
  [[nodiscard]] bool solve();
  // After solve().
  std::vector<NodeVector> node_solution;
  Eigen::VectorXd border_solution;

  /// Covariances of every node with itself and with the next (the border held fixed): what variance estimates need.
  void node_covariances(std::vector<NodeMatrix>& own, std::vector<NodeMatrix>& with_next) const;
  /// What the border's uncertainty adds to `own` of every node.
  void add_border_covariance(std::vector<NodeMatrix>& own) const;
  /// Inverse times `functionals` (node unknowns by columns): covariance of every unknown with those sums.
  [[nodiscard]] Eigen::MatrixXd covariance_with(const Eigen::MatrixXd& functionals) const;
  /// How far the nodes may lie from the solution: draws from the whole covariance, one a column of standard normal
  /// values (node unknowns, then border, by draws). Out come (node unknowns by draws).
  [[nodiscard]] Eigen::MatrixXd deviations(const Eigen::MatrixXd& normal_values) const;
  /// Covariance of the border's unknowns.
  [[nodiscard]] Eigen::MatrixXd border_covariance() const;

  [[nodiscard]] int nodes() const { return static_cast<int>(diagonal.size()); }

 private:
  void forward(Eigen::Ref<Eigen::MatrixXd> columns) const;
  void backward(Eigen::Ref<Eigen::MatrixXd> columns) const;

  std::vector<NodeMatrix> factor_;   // L of each pivot block
  std::vector<NodeMatrix> coupled_;  // L^-1 (i, i + 1)
  Eigen::MatrixXd border_effect_;    // inverse of the chain times border
  // Of anything, so that a system can be moved before it is solved: an empty one has a state that is no value.
  Eigen::LLT<Eigen::MatrixXd> schur_{Eigen::MatrixXd::Identity(1, 1)};
};

}  // namespace imprint
