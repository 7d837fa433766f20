#pragma once

#include <array>

namespace imprint {

inline constexpr int kDistortionTerms = 7;

/// The distorted point (u + du, v + dv) of an ideal one, both in units of half the shorter image side: [B] equation 2
/// with the contract's mending. `terms`: A1, A2, A3, B1, B2, C1, C2. For any number type, so that adjustments can take
/// derivatives of it.
template <class T>
std::array<T, 2> distort_balanced(const T* terms, double r0, const T& u, const T& v) {
  const double q = r0 * r0;
  const T r2 = u * u + v * v;
  const T radial = terms[0] * (r2 - q) + terms[1] * (r2 * r2 - q * q) + terms[2] * (r2 * r2 * r2 - q * q * q);
  const T &b1 = terms[3], &b2 = terms[4];
  return {u + u * radial + b1 * (r2 + 2.0 * u * u) + 2.0 * b2 * u * v + terms[5] * u + terms[6] * v,
          v + v * radial + b2 * (r2 + 2.0 * v * v) + 2.0 * b1 * u * v};
}

}  // namespace imprint
