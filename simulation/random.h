#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string_view>

namespace imprint {

/// A bijective mixing of 64 bits: neighbouring inputs give unrelated outputs.
inline std::uint64_t mix_bits(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// The seed of one purpose ("haze", "sparks"...) of one camera and observation. Every random choice has a stream of
/// its own, so that neither the order of rendering nor the number of jobs can change a frame.
inline std::uint64_t stream_seed(std::uint64_t scene_seed, std::string_view purpose, std::uint64_t a = 0,
                                 std::uint64_t b = 0) {
  std::uint64_t state = mix_bits(scene_seed + 0x9e3779b97f4a7c15ULL);
  for (const char letter : purpose) state = mix_bits(state ^ static_cast<unsigned char>(letter));
  return mix_bits(mix_bits(state ^ (a + 1)) + (b + 1) * 0x9e3779b97f4a7c15ULL);
}

/// Small generator (a Weyl sequence, mixed) whose numbers are the same on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15ULL;
    return mix_bits(state_);
  }
  /// In [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
  double uniform(double from, double to) { return from + (to - from) * uniform(); }
  /// In 0 .. count - 1.
  int index(int count) { return static_cast<int>(uniform() * count); }
  double angle_rad() { return uniform(0.0, 2.0 * std::numbers::pi); }
  /// Of mean 0 and variance 1 (Box and Muller).
  double normal() {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(angle_rad());
  }

 private:
  std::uint64_t state_;
};

}  // namespace imprint
