#include "fusion/combine/bordered_system.h"

#include <algorithm>
#include <cmath>

namespace imprint {
namespace {

/// Inverse of L of `pivot` = L L^T (lower half used, lost); false when `pivot` is not positive definite. Of a size
/// known beforehand, column by column, this takes a third of the time of the general decomposition.
template <int kSize>
bool invert_factor(Eigen::Matrix<double, kSize, kSize>& pivot, Eigen::Matrix<double, kSize, kSize>& inverse) {
  using Rows = Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>;
  Rows rows = Rows::Identity();
  for (int j = 0; j < kSize; ++j) {
    if (!(pivot(j, j) > 0.0)) return false;
    const double scale = 1.0 / std::sqrt(pivot(j, j));
    const Eigen::Matrix<double, kSize, 1> column = scale * pivot.col(j);
    rows.row(j) *= scale;
    for (int i = j + 1; i < kSize; ++i) {
      pivot.col(i) -= column(i) * column;
      rows.row(i) -= column(i) * rows.row(j);
    }
  }
  inverse = rows;
  return true;
}

}  // namespace

template <int kUnknowns>
BorderedChain<kUnknowns>::BorderedChain(int nodes, int border_count)
    : diagonal(static_cast<std::size_t>(nodes), Matrix::Zero()),
      upper(static_cast<std::size_t>(nodes), Matrix::Zero()),
      right(static_cast<std::size_t>(nodes), Vector::Zero()),
      border(Eigen::MatrixXd::Zero(border_count, nodes * kUnknowns)),
      corner(Eigen::MatrixXd::Zero(border_count, border_count)),
      border_right(Eigen::VectorXd::Zero(border_count)) {}

template <int kUnknowns>
void BorderedChain<kUnknowns>::clear() {
  for (auto* blocks : {&diagonal, &upper}) std::fill(blocks->begin(), blocks->end(), Matrix::Zero());
  std::fill(right.begin(), right.end(), Vector::Zero());
  border.setZero();
  corner.setZero();
  border_right.setZero();
}

template <int kUnknowns>
void BorderedChain<kUnknowns>::forward(Eigen::MatrixXd& rows) const {
  Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> block(rows.rows(), kUnknowns);
  for (int i = 0; i < nodes(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    block = rows.middleCols<kUnknowns>(i * kUnknowns);
    if (i > 0) block.noalias() -= rows.middleCols<kUnknowns>((i - 1) * kUnknowns) * coupled_[k - 1];
    rows.middleCols<kUnknowns>(i * kUnknowns).noalias() = block * inverse_[k].transpose();
  }
}

template <int kUnknowns>
void BorderedChain<kUnknowns>::backward(Eigen::MatrixXd& rows) const {
  Eigen::Matrix<double, Eigen::Dynamic, kUnknowns> block(rows.rows(), kUnknowns);
  for (int i = nodes() - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    block = rows.middleCols<kUnknowns>(i * kUnknowns);
    if (i + 1 < nodes()) block.noalias() -= rows.middleCols<kUnknowns>((i + 1) * kUnknowns) * coupled_[k].transpose();
    rows.middleCols<kUnknowns>(i * kUnknowns).noalias() = block * inverse_[k];
  }
}

template <int kUnknowns>
bool BorderedChain<kUnknowns>::factor() {
  inverse_.resize(diagonal.size());
  coupled_.resize(diagonal.size());
  for (std::size_t k = 0; k < diagonal.size(); ++k) {
    Matrix pivot = diagonal[k];
    if (k > 0) pivot.noalias() -= coupled_[k - 1].transpose() * coupled_[k - 1];
    if (!invert_factor<kUnknowns>(pivot, inverse_[k])) return false;
    if (k + 1 < diagonal.size()) coupled_[k].noalias() = inverse_[k] * upper[k];
  }
  return true;
}

template <int kUnknowns>
void BorderedChain<kUnknowns>::forward(std::vector<Vector>& state) const {
  for (std::size_t k = 0; k < state.size(); ++k) {
    Vector value = state[k];
    if (k > 0) value.noalias() -= coupled_[k - 1].transpose() * state[k - 1];
    state[k].noalias() = inverse_[k] * value;
  }
}

template <int kUnknowns>
bool BorderedChain<kUnknowns>::backward(std::vector<Vector>& state) const {
  bool finite = true;
  for (std::size_t k = state.size(); k-- > 0;) {
    Vector value = state[k];
    if (k + 1 < state.size()) value.noalias() -= coupled_[k] * state[k + 1];
    state[k].noalias() = inverse_[k].transpose() * value;
    finite = finite && state[k].allFinite();
  }
  return finite;
}

template <int kUnknowns>
bool BorderedChain<kUnknowns>::solve_nodes(const Eigen::VectorXd& border_held) {
  if (!factor()) return false;
  node_solution = right;
  forward(node_solution);
  border_solution = border_held;
  return backward(node_solution);
}

template <int kUnknowns>
bool BorderedChain<kUnknowns>::solve() {
  if (border_size() == 0) return solve_nodes(border_right);
  if (!factor()) return false;
  node_solution = right;
  forward(node_solution);
  halfway_ = border;
  forward(halfway_);
  Eigen::MatrixXd schur = corner;
  schur.selfadjointView<Eigen::Lower>().rankUpdate(halfway_, -1.0);
  schur_.compute(schur);
  if (schur_.info() != Eigen::Success) return false;
  Eigen::VectorXd rest = border_right;
  for (int i = 0; i < nodes(); ++i)
    rest.noalias() -= halfway_.middleCols<kUnknowns>(i * kUnknowns) * node_solution[static_cast<std::size_t>(i)];
  border_solution = schur_.solve(rest);
  for (int i = 0; i < nodes(); ++i)
    node_solution[static_cast<std::size_t>(i)].noalias() -=
        halfway_.middleCols<kUnknowns>(i * kUnknowns).transpose() * border_solution;
  return backward(node_solution);
}

template <int kUnknowns>
void BorderedChain<kUnknowns>::node_covariances(std::vector<Matrix>& own, std::vector<Matrix>& with_next) const {
  own.resize(diagonal.size());
  with_next.assign(diagonal.size(), Matrix::Zero());
  for (std::size_t k = diagonal.size(); k-- > 0;) {
    own[k].noalias() = inverse_[k].transpose() * inverse_[k];
    if (k + 1 == diagonal.size()) continue;
    const Matrix gain = inverse_[k].transpose() * coupled_[k];
    with_next[k].noalias() = -gain * own[k + 1];
    own[k].noalias() -= with_next[k] * gain.transpose();
  }
}

template <int kUnknowns>
void BorderedChain<kUnknowns>::add_border_covariance(std::vector<Matrix>& own) const {
  if (border_size() == 0) return;
  // own += W S^-1 W^T with W = inverse of the chain times border and S = L L^T: the columns of L^-1 W^T, node by node.
  Eigen::MatrixXd half = schur_.matrixL().solve(halfway_);
  backward(half);
  for (int i = 0; i < nodes(); ++i) {
    const auto columns = half.middleCols<kUnknowns>(i * kUnknowns);
    own[static_cast<std::size_t>(i)].noalias() += columns.transpose() * columns;
  }
}

template <int kUnknowns>
Eigen::MatrixXd BorderedChain<kUnknowns>::covariance_with(const Eigen::MatrixXd& functionals) const {
  Eigen::MatrixXd rows = functionals.transpose();
  forward(rows);
  if (border_size() > 0) rows += schur_.solve(halfway_ * rows.transpose()).transpose() * halfway_;
  backward(rows);
  return rows.transpose();
}

template <int kUnknowns>
Eigen::MatrixXd BorderedChain<kUnknowns>::deviations(const Eigen::MatrixXd& normal_values) const {
  Eigen::MatrixXd rows = normal_values.topRows(nodes() * kUnknowns).transpose();
  if (border_size() > 0) rows -= schur_.matrixU().solve(normal_values.bottomRows(border_size())).transpose() * halfway_;
  backward(rows);
  return rows.transpose();
}

template <int kUnknowns>
Eigen::MatrixXd BorderedChain<kUnknowns>::border_covariance() const {
  if (border_size() == 0) return Eigen::MatrixXd(0, 0);
  return schur_.solve(Eigen::MatrixXd::Identity(border_size(), border_size()));
}

template class BorderedChain<kNodeUnknowns>;
// Forgings of 4, 8 and 12 faces: two coordinates a corner, and the corners' radius.
template class BorderedChain<9>;
template class BorderedChain<17>;
template class BorderedChain<25>;

}  // namespace imprint
