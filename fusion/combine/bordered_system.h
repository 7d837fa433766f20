#pragma once

#include <vector>

#include <Eigen/Dense>

namespace imprint {

/// Normal equations of a chain of nodes of `kUnknowns` unknowns each, each coupled with the next, and of a border of
/// unknowns that touch all: solved by block Cholesky in a time that grows with the number of nodes only.
/// Instantiated in bordered_system.cc for the sizes in use.
template <int kUnknowns>
class BorderedChain {
 public:
  using Matrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;
  using Vector = Eigen::Matrix<double, kUnknowns, 1>;

  BorderedChain(int nodes, int border);
  /// Back to all zero, to be filled anew.
  void clear();

  // The normal matrix and its right side, to be filled by adding.
  std::vector<Matrix> diagonal;  ///< (i, i), lower half used
  std::vector<Matrix> upper;     ///< (i, i + 1)
  std::vector<Vector> right;
  Eigen::MatrixXd border;  ///< (border, node unknowns): what one node has with the border lies together
  Eigen::MatrixXd corner;  ///< (border, border)
  Eigen::VectorXd border_right;

  /// Factors and solves; false when the matrix is not positive definite.
  [[nodiscard]] bool solve();
  /// The nodes alone, which takes a fraction of the time: for `right` without what the border's unknowns make of it
  /// when held at `border_held`; border and corner have no say. Of what comes after, only the solution and
  /// `node_covariances` are then there.
  [[nodiscard]] bool solve_nodes(const Eigen::VectorXd& border_held);
  // After solve().
  std::vector<Vector> node_solution;
  Eigen::VectorXd border_solution;

  /// Covariances of every node with itself and with the next (the border held fixed): what variance estimates need.
  void node_covariances(std::vector<Matrix>& own, std::vector<Matrix>& with_next) const;
  /// What the border's uncertainty adds to `own` of every node.
  void add_border_covariance(std::vector<Matrix>& own) const;
  /// Inverse times `functionals` (node unknowns by columns): covariance of every unknown with those sums.
  [[nodiscard]] Eigen::MatrixXd covariance_with(const Eigen::MatrixXd& functionals) const;
  /// How far the nodes may lie from the solution: draws from the whole covariance, one a column of standard normal
  /// values (node unknowns, then border, by draws). Out come (node unknowns by draws).
  [[nodiscard]] Eigen::MatrixXd deviations(const Eigen::MatrixXd& normal_values) const;
  /// Covariance of the border's unknowns.
  [[nodiscard]] Eigen::MatrixXd border_covariance() const;

  [[nodiscard]] int nodes() const { return static_cast<int>(diagonal.size()); }
  [[nodiscard]] int border_size() const { return static_cast<int>(border_right.size()); }

 private:
  [[nodiscard]] bool factor();
  // One a row, as `border` stands.
  void forward(Eigen::MatrixXd& rows) const;
  void backward(Eigen::MatrixXd& rows) const;
  // One alone, node by node.
  void forward(std::vector<Vector>& state) const;
  [[nodiscard]] bool backward(std::vector<Vector>& state) const;

  std::vector<Matrix> inverse_;  // of L of each pivot block
  std::vector<Matrix> coupled_;  // L^-1 (i, i + 1)
  Eigen::MatrixXd halfway_;      // border after `forward`
  // Of anything, so that a system can be moved before it is solved: an empty one has a state that is no value.
  Eigen::LLT<Eigen::MatrixXd> schur_{Eigen::MatrixXd::Identity(1, 1)};
};

/// Unknowns of one node of a round forging: y, y', z, z', radius and the support function's harmonics 2 to 6 (cosine,
/// sine).
inline constexpr int kNodeUnknowns = 15;
using BorderedSystem = BorderedChain<kNodeUnknowns>;
using NodeMatrix = BorderedSystem::Matrix;
using NodeVector = BorderedSystem::Vector;

}  // namespace imprint
