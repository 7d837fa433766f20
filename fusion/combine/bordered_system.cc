#include "fusion/combine/bordered_system.h"

namespace imprint {

BorderedSystem::BorderedSystem(int nodes, int border_count)
    : diagonal(static_cast<std::size_t>(nodes), NodeMatrix::Zero()),
      upper(static_cast<std::size_t>(nodes), NodeMatrix::Zero()),
      right(static_cast<std::size_t>(nodes), NodeVector::Zero()),
      border(Eigen::MatrixXd::Zero(nodes * kNodeUnknowns, border_count)),
      corner(Eigen::MatrixXd::Zero(border_count, border_count)),
      border_right(Eigen::VectorXd::Zero(border_count)) {}

void BorderedSystem::forward(Eigen::Ref<Eigen::MatrixXd> columns) const {
  for (int i = 0; i < nodes(); ++i) {
    const auto k = static_cast<std::size_t>(i);
    auto rows = columns.middleRows<kNodeUnknowns>(i * kNodeUnknowns);
    if (i > 0)
      rows.noalias() -= coupled_[k - 1].transpose() * columns.middleRows<kNodeUnknowns>((i - 1) * kNodeUnknowns);
    factor_[k].triangularView<Eigen::Lower>().solveInPlace(rows);
  }
}

void BorderedSystem::backward(Eigen::Ref<Eigen::MatrixXd> columns) const {
  for (int i = nodes() - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    auto rows = columns.middleRows<kNodeUnknowns>(i * kNodeUnknowns);
    if (i + 1 < nodes()) rows.noalias() -= coupled_[k] * columns.middleRows<kNodeUnknowns>((i + 1) * kNodeUnknowns);
    factor_[k].transpose().triangularView<Eigen::Upper>().solveInPlace(rows);
  }
}

bool BorderedSystem::solve() {
  const int n = nodes();
  factor_.resize(diagonal.size());
  coupled_.resize(diagonal.size());
  for (int i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    NodeMatrix pivot = diagonal[k];
    if (i > 0) pivot.noalias() -= coupled_[k - 1].transpose() * coupled_[k - 1];
    const Eigen::LLT<NodeMatrix> llt(pivot);
    if (llt.info() != Eigen::Success) return false;
    factor_[k] = llt.matrixL();
    if (i + 1 < n) coupled_[k] = factor_[k].triangularView<Eigen::Lower>().solve(upper[k]);
  }
  Eigen::MatrixXd state(n * kNodeUnknowns, 1);
  for (int i = 0; i < n; ++i) state.middleRows<kNodeUnknowns>(i * kNodeUnknowns) = right[static_cast<std::size_t>(i)];
  forward(state);
  if (border.cols() > 0) {
    border_effect_ = border;
    forward(border_effect_);
    Eigen::MatrixXd schur = corner;
    schur.selfadjointView<Eigen::Lower>().rankUpdate(border_effect_.transpose(), -1.0);
    schur_.compute(schur);
    if (schur_.info() != Eigen::Success) return false;
    border_solution = schur_.solve(border_right - border_effect_.transpose() * state.col(0));
    state -= border_effect_ * border_solution;
    backward(border_effect_);
  } else {
    border_solution.resize(0);
  }
  backward(state);
  if (!state.allFinite()) return false;
  node_solution.resize(diagonal.size());
  for (int i = 0; i < n; ++i)
    node_solution[static_cast<std::size_t>(i)] = state.middleRows<kNodeUnknowns>(i * kNodeUnknowns);
  return true;
}

void BorderedSystem::node_covariances(std::vector<NodeMatrix>& own, std::vector<NodeMatrix>& with_next) const {
  own.resize(diagonal.size());
  with_next.assign(diagonal.size(), NodeMatrix::Zero());
  for (int i = nodes() - 1; i >= 0; --i) {
    const auto k = static_cast<std::size_t>(i);
    const NodeMatrix inverse = factor_[k].triangularView<Eigen::Lower>().solve(NodeMatrix::Identity());
    own[k].noalias() = inverse.transpose() * inverse;
    if (i + 1 == nodes()) continue;
    const NodeMatrix gain = inverse.transpose() * coupled_[k];
    with_next[k].noalias() = -gain * own[k + 1];
    own[k].noalias() -= with_next[k] * gain.transpose();
  }
}

void BorderedSystem::add_border_covariance(std::vector<NodeMatrix>& own) const {
  if (border.cols() == 0) return;
  // own += W S^-1 W^T with S = L L^T: the columns of L^-1 W^T, node by node.
  const Eigen::MatrixXd half = schur_.matrixL().solve(border_effect_.transpose());
  for (int i = 0; i < nodes(); ++i) {
    const auto columns = half.middleCols<kNodeUnknowns>(i * kNodeUnknowns);
    own[static_cast<std::size_t>(i)].noalias() += columns.transpose() * columns;
  }
}

Eigen::MatrixXd BorderedSystem::covariance_with(const Eigen::MatrixXd& functionals) const {
  Eigen::MatrixXd columns = functionals;
  forward(columns);
  backward(columns);
  if (border.cols() > 0) columns += border_effect_ * schur_.solve(border_effect_.transpose() * functionals);
  return columns;
}

Eigen::MatrixXd BorderedSystem::deviations(const Eigen::MatrixXd& normal_values) const {
  Eigen::MatrixXd columns = normal_values.topRows(nodes() * kNodeUnknowns);
  backward(columns);
  if (border.cols() > 0) columns -= border_effect_ * schur_.matrixU().solve(normal_values.bottomRows(border.cols()));
  return columns;
}

Eigen::MatrixXd BorderedSystem::border_covariance() const {
  return border.cols() == 0 ? Eigen::MatrixXd(0, 0)
                            : Eigen::MatrixXd(schur_.solve(Eigen::MatrixXd::Identity(border.cols(), border.cols())));
}

}  // namespace imprint
