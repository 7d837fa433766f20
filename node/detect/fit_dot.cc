#include "node/detect/fit_dot.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace imprint {
namespace {

constexpr int parameters = 10;  // centre 2, shape 3, log blur, black, contrast, shading 2
using Vector = Eigen::Matrix<double, parameters, 1>;
using Matrix = Eigen::Matrix<double, parameters, parameters>;

constexpr double min_blur_px = 0.25;      // below the 0.29 px of a pixel's own width
constexpr double min_window_radii = 1.5;  // half-way between the dot and a ring that begins at 2
constexpr double max_window_radii = 1.9;  // in dots of few px, to have ground enough
constexpr double residual_scale = 0.12;   // share of the contrast beyond which a grey value is not the dot's

struct Sample {
  Eigen::Vector2d p;  // from the guessed centre
  double grey;
  double weight;
};

struct Dot {
  Eigen::Vector2d center;  // from the guessed centre
  Eigen::Matrix2d shape;
  double blur;
  double black;
  double contrast;
  Eigen::Vector2d shading;  // per px

  [[nodiscard]] Dot stepped(const Vector& s) const {
    Dot next = *this;
    next.center += s.segment<2>(0);
    // Multiplicative in the ellipse's own frame: the shape stays positive definite.
    Eigen::Matrix2d change;
    change << s[2], s[3], s[3], s[4];
    const Eigen::Matrix2d root = frame_of({Eigen::Vector2d::Zero(), shape.inverse()});
    next.shape = root * (Eigen::Matrix2d::Identity() + change + 0.5 * change * change) * root;
    next.blur = std::max(min_blur_px, blur * std::exp(std::clamp(s[5], -0.7, 0.7)));
    next.black += s[6];
    next.contrast += s[7];
    next.shading += s.segment<2>(8);
    return next;
  }
};

/// Grey value of the model at a place and its derivatives by the parameters of `Dot::stepped`.
class DotModel {
 public:
  explicit DotModel(const Dot& dot) : dot_(dot), root_(frame_of({Eigen::Vector2d::Zero(), dot.shape.inverse()})) {}

  double at(const Eigen::Vector2d& p, Vector* gradient) const {
    const Eigen::Vector2d q = p - dot_.center;
    const Eigen::Vector2d in_frame = root_ * q;
    const double radius = std::max(in_frame.norm(), 1e-6);
    const Eigen::Vector2d radius_gradient = dot_.shape * q / radius;
    const double slope = std::max(radius_gradient.norm(), 1e-9);
    // First order in the distance to the ellipse, and in the curvature: blur draws a round edge inwards.
    const Eigen::Vector2d normal = radius_gradient / slope;
    const Eigen::Vector2d tangent(-normal.y(), normal.x());
    const double curvature = tangent.dot(dot_.shape * tangent) / slope;
    const double spread = dot_.blur * std::sqrt(1.0 + 0.5 * curvature * curvature * dot_.blur * dot_.blur);
    const double z = -((radius - 1.0) / slope + 0.5 * curvature * dot_.blur * dot_.blur) / spread;
    constexpr double far = 4.5;  // blurs from the edge: flat to 3e-6 of the contrast
    const double cover = z > far ? 1.0 : z < -far ? 0.0 : 0.5 * std::erfc(-z * std::numbers::sqrt2 / 2.0);
    const double shade = 1.0 + dot_.shading.dot(q);
    if (gradient != nullptr) {
      const double density = std::abs(z) > far ? 0.0 : std::exp(-0.5 * z * z) / std::sqrt(2.0 * std::numbers::pi);
      const double by_z = dot_.contrast * shade * density;
      const double by_radius = -by_z / (slope * spread);
      Vector& g = *gradient;
      g.segment<2>(0) = -by_radius * radius_gradient - dot_.contrast * cover * dot_.shading;
      g[2] = by_radius * 0.5 * in_frame.x() * in_frame.x() / radius;
      g[3] = by_radius * in_frame.x() * in_frame.y() / radius;
      g[4] = by_radius * 0.5 * in_frame.y() * in_frame.y() / radius;
      g[5] = -by_z * z;
      g[6] = 1.0;
      g[7] = shade * cover;
      g.segment<2>(8) = dot_.contrast * cover * q;
    }
    return dot_.black + dot_.contrast * shade * cover;
  }

 private:
  const Dot& dot_;
  Eigen::Matrix2d root_;
};

/// Grey values in the window; in large dots only every second or fourth row and column of what is far from the edge.
std::vector<Sample> samples_of(const GreyImage& image, const Ellipse& guess) {
  const double semi_minor = axes_of(guess).semi_minor_px;
  const double window_radii = std::clamp(1.0 + 2.0 / semi_minor, min_window_radii, max_window_radii);
  const Eigen::Matrix2d covariance = guess.shape.inverse();
  const double half_width = window_radii * std::sqrt(covariance(0, 0));
  const double half_height = window_radii * std::sqrt(covariance(1, 1));
  const int left = std::max(0, static_cast<int>(std::ceil(guess.center.x() - half_width)));
  const int right = std::min(image.width() - 1, static_cast<int>(std::floor(guess.center.x() + half_width)));
  const int top = std::max(0, static_cast<int>(std::ceil(guess.center.y() - half_height)));
  const int bottom = std::min(image.height() - 1, static_cast<int>(std::floor(guess.center.y() + half_height)));
  const int stride = semi_minor > 40.0 ? 4 : semi_minor > 16.0 ? 2 : 1;
  const double edge_band = std::max(0.2, 5.0 / semi_minor);
  std::vector<Sample> samples;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d p(x, y);
      const double radius = guess.radius_of(p);
      if (radius > window_radii) continue;
      const bool near_edge = std::abs(radius - 1.0) < edge_band;
      if (!near_edge && (x % stride != 0 || y % stride != 0)) continue;
      // The window fades out over a px: a sharp border would move in steps with the pixel grid.
      const double fade = std::clamp((window_radii - radius) * semi_minor, 0.0, 1.0);
      samples.push_back({p - guess.center, image.pixel(x, y), fade});
    }
  }
  return samples;
}

/// Draws the shading towards what is known of it: information (in squared grey levels) and the value itself.
struct ShadingHold {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d shading = Eigen::Vector2d::Zero();
};

struct NormalEquations {
  Matrix matrix = Matrix::Zero();
  Vector right = Vector::Zero();
  double cost = 0.0;
  double weight = 0.0;
};

/// Weights fall as 1 / (1 + (r/scale)^2)^2 of the residual (Geman-McClure); the cost is its own.
NormalEquations normal_equations(const std::vector<Sample>& samples, const Dot& dot, double scale,
                                 const ShadingHold& hold, FitFreedom freedom) {
  NormalEquations equations;
  const DotModel model(dot);
  Vector gradient;
  for (const Sample& sample : samples) {
    const double residual = sample.grey - model.at(sample.p, &gradient);
    const double ratio = residual * residual / (scale * scale);
    const double weight = sample.weight / ((1.0 + ratio) * (1.0 + ratio));
    equations.matrix.noalias() += (weight * gradient) * gradient.transpose();
    equations.right += (weight * residual) * gradient;
    equations.cost += sample.weight * residual * residual / (1.0 + ratio);
    equations.weight += weight;
  }
  const Eigen::Vector2d off = dot.shading - hold.shading;
  equations.matrix.bottomRightCorner<2, 2>() += hold.information;
  equations.right.tail<2>() -= hold.information * off;
  equations.cost += off.dot(hold.information * off);
  if (freedom == FitFreedom::place) {
    const double firm = 1e6 * (1.0 + equations.matrix.diagonal().maxCoeff());
    equations.matrix.diagonal().segment<4>(2).array() += firm;
    equations.matrix.diagonal().tail<2>().array() += firm;
  }
  return equations;
}

/// Levenberg-Marquardt from `dot`; false when it leads nowhere.
bool adjust(const std::vector<Sample>& samples, double scale, const ShadingHold& hold, int max_steps,
            FitFreedom freedom, Dot& dot, NormalEquations& equations) {
  double damping = 1e-3;
  equations = normal_equations(samples, dot, scale, hold, freedom);
  for (int i = 0; i < max_steps; ++i) {
    Matrix damped = equations.matrix;
    damped.diagonal() *= 1.0 + damping;
    damped.diagonal().array() += 1e-12;
    const Vector step = damped.ldlt().solve(equations.right);
    if (!step.allFinite()) return false;
    const bool too_far = step.segment<3>(2).cwiseAbs().maxCoeff() > 0.7;
    const Dot next = dot.stepped(too_far ? Vector(step * 0.5) : step);
    if (!(next.shape.determinant() > 0.0)) return false;
    const NormalEquations there = normal_equations(samples, next, scale, hold, freedom);
    const bool better = there.cost <= equations.cost;
    if (better) {
      dot = next;
      equations = there;
      damping *= 0.2;
    } else {
      damping *= 8.0;
    }
    const double moved_px = step.head<2>().norm();
    if ((better && moved_px < 3e-4) || (!better && damping > 1e4)) return true;
  }
  return true;
}

}  // namespace

namespace {

/// In a dot of few px a shading looks like a shift of the centre: there it is held, more so the more is known of it.
ShadingHold hold_shading(const Dot& dot, const ShadingPrior& prior, double noise) {
  const Ellipse ellipse{Eigen::Vector2d::Zero(), dot.shape};
  const Eigen::Matrix2d frame = frame_of(ellipse);
  ShadingHold hold;
  hold.shading = frame.inverse() * prior.slope;
  const double small_radii = 5.0 / axes_of(ellipse).semi_minor_px;
  hold.information = 4.0 * dot.contrast * dot.contrast * std::pow(small_radii, 6.0) * Eigen::Matrix2d::Identity();
  hold.information += noise * noise / (prior.sigma * prior.sigma) * frame.transpose() * frame;
  return hold;
}

FittedDot rescaled(const FittedDot& dot, double scale, const Eigen::Vector2d& center) {
  FittedDot full = dot;
  full.ellipse = dot.ellipse.scaled(scale, center);
  full.blur_px *= scale;
  full.sigma_px *= scale;
  full.shading /= scale;
  return full;
}

}  // namespace

FittedDot from_level(const FittedDot& dot, int level) {
  return rescaled(dot, ImagePyramid::scale(level), ImagePyramid::from_level(dot.ellipse.center, level));
}

FittedDot to_level(const FittedDot& dot, int level) {
  return rescaled(dot, 1.0 / ImagePyramid::scale(level), ImagePyramid::to_level(dot.ellipse.center, level));
}

std::optional<FittedDot> fit_dot(const GreyImage& image, const DotGuess& start, const LightAt& other_light,
                                 FitFreedom freedom) {
  const Ellipse& guess = start.ellipse;
  std::vector<Sample> samples = samples_of(image, guess);
  if (other_light) {
    for (Sample& sample : samples) sample.grey -= other_light(guess.center + sample.p);
  }
  if (samples.size() < parameters + 4) return std::nullopt;
  Dot dot{Eigen::Vector2d::Zero(), guess.shape, start.blur_px, start.black, start.contrast, Eigen::Vector2d::Zero()};
  NormalEquations equations;
  // Twice: with a wide scale, then with the noise known.
  double noise = 0.5 * residual_scale * dot.contrast;
  if (!adjust(samples, residual_scale * 3.0 * dot.contrast, hold_shading(dot, start.shading, noise), 4, freedom, dot,
              equations) ||
      !(dot.contrast > 0.0))
    return std::nullopt;
  noise = std::sqrt(equations.cost / std::max(1.0, equations.weight));
  const double scale = std::max(residual_scale * dot.contrast, 5.0 * noise);
  if (!adjust(samples, scale, hold_shading(dot, start.shading, noise), 10, freedom, dot, equations) ||
      !(dot.contrast > 0.0))
    return std::nullopt;

  FittedDot fitted;
  fitted.ellipse = {guess.center + dot.center, dot.shape};
  const EllipseAxes axes = axes_of(fitted.ellipse);
  if (guess.radius_of(fitted.ellipse.center) > 0.5 || axes.semi_minor_px < 0.5 * axes_of(guess).semi_minor_px ||
      axes.semi_major_px > 2.0 * axes_of(guess).semi_major_px) {
    return std::nullopt;
  }
  const double effective = equations.weight - parameters;
  if (effective < parameters) return std::nullopt;
  noise = std::sqrt(equations.cost / effective);
  const Matrix covariance = equations.matrix.ldlt().solve(Matrix::Identity()) * (noise * noise);
  fitted.blur_px = dot.blur;
  fitted.black = dot.black;
  fitted.contrast = dot.contrast;
  fitted.residual = noise;
  fitted.sigma_px = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  if (!std::isfinite(fitted.sigma_px)) return std::nullopt;
  constexpr double significant = 4.0;  // standard deviations: the ring magnifies a wrong shading
  if (dot.shading.norm() > significant * std::sqrt(covariance(8, 8) + covariance(9, 9))) fitted.shading = dot.shading;
  return fitted;
}

}  // namespace imprint
