#pragma once

#include <Eigen/Core>

namespace imprint {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Rotation matrix R(omega, phi, kappa) of [B] equation 4; angles in rad.
Eigen::Matrix3d rotation_from_omega_phi_kappa(const Eigen::Vector3d& omega_phi_kappa_rad);

/// The angles of [B] equation 4 that give `R`, in rad: omega, kappa in (-pi, pi], phi in [-pi/2, pi/2].
Eigen::Vector3d omega_phi_kappa_from_rotation(const Eigen::Matrix3d& R);

/// Rotation by |w| rad about w (Rodrigues); exact for small angles too.
Eigen::Matrix3d rotation_from_vector(const Eigen::Vector3d& w_rad);

/// [w]x, the matrix for which [w]x v = w x v.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& w);

}  // namespace imprint
