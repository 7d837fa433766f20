// Halls, natural textures, photographs; and the camera that sees all of it.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "tests/paper/targets/clutter_frames.h"
#include "tests/paper/targets/target_sheet.h"

namespace imprint::paper {
namespace {

cv::Scalar grey(double level) { return cv::Scalar::all(level); }

/// Noise whose amplitude falls with frequency to the power `slope`: 1 is what natural scenes have. Mean 0, sigma 1.
cv::Mat natural_noise(int width, int height, double slope, cv::RNG& random) {
  cv::Mat sum = cv::Mat::zeros(height, width, CV_32F);
  for (int cell = 1; cell < std::min(width, height) / 2; cell *= 2) {
    cv::Mat coarse(height / cell + 3, width / cell + 3, CV_32F);
    random.fill(coarse, cv::RNG::NORMAL, 0.0, std::pow(static_cast<double>(cell), slope - 1.0));
    cv::Mat fine;
    cv::resize(coarse, fine, {}, cell, cell, cell == 1 ? cv::INTER_NEAREST : cv::INTER_CUBIC);
    sum += fine(cv::Rect(0, 0, width, height));
  }
  cv::Scalar mean;
  cv::Scalar deviation;
  cv::meanStdDev(sum, mean, deviation);
  return (sum - mean[0]) / deviation[0];
}

cv::Point anywhere(const cv::Mat& canvas, cv::RNG& random) {
  return {random.uniform(0, canvas.cols), random.uniform(0, canvas.rows)};
}

/// Adds light that falls off round a place, as lamps and glowing metal do in haze.
void add_glow(cv::Mat& canvas, const cv::Point& place, int reach, double strength) {
  const cv::Rect square =
      cv::Rect(place.x - reach, place.y - reach, 2 * reach, 2 * reach) & cv::Rect(0, 0, canvas.cols, canvas.rows);
  for (int y = square.y; y < square.y + square.height; ++y) {
    for (int x = square.x; x < square.x + square.width; ++x) {
      const double r = std::hypot(x - place.x, y - place.y) / reach;
      if (r < 1.0) canvas.at<float>(y, x) += static_cast<float>(strength * std::pow(1.0 - r, 2.0));
    }
  }
}

/// A girder of two chords with diagonals and rivets.
void draw_girder(cv::Mat& canvas, cv::RNG& random) {
  const cv::Point2d from = anywhere(canvas, random);
  const double angle = random.uniform(0, 2) == 0 ? 0.0 : random.uniform(0.0, CV_PI);
  const cv::Point2d along(std::cos(angle), std::sin(angle));
  const cv::Point2d across(-along.y, along.x);
  const double depth = random.uniform(20.0, 120.0);
  const double steel = random.uniform(0.05, 0.4);
  const int width = random.uniform(2, 16);
  const int bays = random.uniform(6, 40);
  for (int i = 0; i < bays; ++i) {
    const cv::Point2d a = from + along * (depth * i);
    const cv::Point2d b = a + along * depth;
    cv::line(canvas, a, b, grey(steel), width, cv::LINE_AA);
    cv::line(canvas, a + across * depth, b + across * depth, grey(steel), width, cv::LINE_AA);
    cv::line(canvas, a, i % 2 == 0 ? b + across * depth : a + across * depth, grey(steel), width / 2 + 1, cv::LINE_AA);
    cv::circle(canvas, a, width / 3 + 1, grey(steel + 0.25), -1, cv::LINE_AA);
    cv::circle(canvas, a + across * depth, width / 3 + 1, grey(steel + 0.25), -1, cv::LINE_AA);
  }
}

void draw_chain(cv::Mat& canvas, cv::RNG& random) {
  cv::Point2d at = anywhere(canvas, random);
  const double size = random.uniform(5.0, 30.0);
  const double steel = random.uniform(0.2, 0.8);
  double angle = random.uniform(0.0, CV_PI);
  for (int link = random.uniform(8, 40); link > 0; --link) {
    const cv::Size axes(static_cast<int>(size), static_cast<int>(link % 2 == 0 ? 0.55 * size : 0.2 * size) + 1);
    cv::ellipse(canvas, cv::Point(at), axes, angle * 180.0 / CV_PI, 0, 360, grey(steel),
                1 + static_cast<int>(size / 5.0), cv::LINE_AA);
    at += cv::Point2d(std::cos(angle), std::sin(angle)) * (1.4 * size);
    angle += random.uniform(-0.15, 0.15);
  }
}

void draw_sparks(cv::Mat& canvas, cv::RNG& random) {
  const cv::Point2d source = anywhere(canvas, random);
  for (int i = random.uniform(50, 600); i > 0; --i) {
    const double angle = random.uniform(0.0, 2.0 * CV_PI);
    const double distance = 400.0 * std::sqrt(random.uniform(0.0, 1.0));
    const cv::Point2d direction(std::cos(angle), std::sin(angle));
    const cv::Point2d begin = source + direction * distance;
    const double length = random.uniform(0.0, 30.0);
    cv::line(canvas, begin, begin + direction * length, grey(random.uniform(0.4, 1.2)), random.uniform(1, 5),
             cv::LINE_AA);
  }
}

/// A glowing round bar with scale on it, and its glow.
void draw_glowing_bar(cv::Mat& canvas, cv::RNG& random) {
  const cv::Point place = anywhere(canvas, random);
  const cv::RotatedRect bar(cv::Point2f(place),
                            cv::Size2f(random.uniform(200.0F, 1500.0F), random.uniform(40.0F, 260.0F)),
                            random.uniform(-20.0F, 20.0F));
  add_glow(canvas, place, static_cast<int>(bar.size.width), 0.3);
  cv::Point2f corners[4];
  bar.points(corners);
  cv::fillConvexPoly(canvas, std::vector<cv::Point>(corners, corners + 4), grey(0.95), cv::LINE_AA);
  const double angle = bar.angle * CV_PI / 180.0;
  for (int i = random.uniform(10, 200); i > 0; --i) {
    const double s = random.uniform(-0.5, 0.5) * bar.size.width;
    const double t = random.uniform(-0.45, 0.45) * bar.size.height;
    const cv::Point at(static_cast<int>(place.x + s * std::cos(angle) - t * std::sin(angle)),
                       static_cast<int>(place.y + s * std::sin(angle) + t * std::cos(angle)));
    cv::ellipse(canvas, at, {random.uniform(1, 24), random.uniform(1, 12)}, random.uniform(0.0, 180.0), 0, 360,
                grey(random.uniform(0.3, 0.9)), -1, cv::LINE_AA);
  }
}

void draw_grating(cv::Mat& canvas, cv::RNG& random) {
  const cv::Point corner = anywhere(canvas, random);
  const int pitch = random.uniform(6, 40);
  const int bar = std::max(1, static_cast<int>(pitch * random.uniform(0.15, 0.6)));
  const double steel = random.uniform(0.1, 0.8);
  const cv::Rect area = cv::Rect(corner, cv::Size(random.uniform(100, 700), random.uniform(100, 500))) &
                        cv::Rect(0, 0, canvas.cols, canvas.rows);
  cv::rectangle(canvas, area, grey(random.uniform(0.0, 0.3)), -1);
  for (int x = area.x; x < area.x + area.width; x += pitch)
    cv::rectangle(canvas, cv::Rect(x, area.y, bar, area.height), grey(steel), -1);
  if (random.uniform(0, 2) == 0) return;
  for (int y = area.y; y < area.y + area.height; y += pitch)
    cv::rectangle(canvas, cv::Rect(area.x, y, area.width, bar), grey(steel), -1);
}

bool overlaps(const cv::Rect& square, const std::vector<cv::Point2d>& places, double reach) {
  return std::any_of(places.begin(), places.end(), [&](const cv::Point2d& p) {
    const double dx = std::max({square.x - p.x, 0.0, p.x - (square.x + square.width)});
    const double dy = std::max({square.y - p.y, 0.0, p.y - (square.y + square.height)});
    return std::hypot(dx, dy) < reach;
  });
}

/// Lens, light, noise, 8 bit.
cv::Mat exposed(cv::Mat scene, cv::RNG& random) {
  const double blur_px = random.uniform(0.4, 2.2);
  cv::GaussianBlur(scene, scene, {}, blur_px);
  const double unevenness = random.uniform(0.0, 0.6);
  const cv::Point2d light_from = anywhere(scene, random);
  const double diagonal = std::hypot(scene.cols, scene.rows);
  for (int y = 0; y < scene.rows; ++y) {
    for (int x = 0; x < scene.cols; ++x) {
      const double far = std::hypot(x - light_from.x, y - light_from.y) / diagonal;
      scene.at<float>(y, x) *= static_cast<float>(1.0 - unevenness * far);
    }
  }
  cv::Mat noise(scene.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0.0, random.uniform(0.5, 9.0));
  const double contrast = random.uniform(60.0, 250.0);
  const double pedestal = random.uniform(0.0, 250.0 - contrast);
  cv::Mat frame;
  cv::Mat(scene * contrast + pedestal + noise).convertTo(frame, CV_8U);
  return frame;
}

}  // namespace

cv::Mat draw_hall(int width, int height, cv::RNG& random) {
  cv::Mat canvas = natural_noise(width, height, 1.3, random) * 0.05 + 0.2;
  for (int i = 0; i < 25; ++i) {
    const cv::Rect wall(anywhere(canvas, random), cv::Size(random.uniform(30, 900), random.uniform(30, 900)));
    cv::rectangle(canvas, wall, grey(random.uniform(0.02, 0.6)), random.uniform(0, 3) == 0 ? 3 : -1);
  }
  for (int i = 0; i < 12; ++i) draw_grating(canvas, random);
  for (int i = 0; i < 14; ++i) draw_girder(canvas, random);
  for (int i = 0; i < 8; ++i) draw_chain(canvas, random);
  for (int i = random.uniform(0, 3); i > 0; --i) draw_glowing_bar(canvas, random);
  for (int i = random.uniform(2, 20); i > 0; --i) {
    const cv::Point lamp = anywhere(canvas, random);
    const int size = random.uniform(3, 40);
    add_glow(canvas, lamp, 6 * size, random.uniform(0.1, 0.8));
    cv::ellipse(canvas, lamp, {size, std::max(1, static_cast<int>(size * random.uniform(0.3, 1.0)))},
                random.uniform(0.0, 180.0), 0, 360, grey(1.2), -1, cv::LINE_AA);
  }
  for (int i = random.uniform(0, 5); i > 0; --i) draw_sparks(canvas, random);
  return canvas;
}

cv::Mat draw_texture(int width, int height, cv::RNG& random) {
  cv::Mat texture = natural_noise(width, height, random.uniform(0.6, 1.6), random);
  switch (random.uniform(0, 3)) {
    case 0:
      return texture * random.uniform(0.1, 0.35) + 0.5;
    case 1: {  // two materials with a border that runs everywhere: lichen, rust, spots of a coat
      cv::Mat smooth;
      cv::GaussianBlur(texture, smooth, {}, random.uniform(1.0, 12.0));
      cv::Scalar mean;
      cv::Scalar deviation;
      cv::meanStdDev(smooth, mean, deviation);
      const cv::Mat inside = smooth > mean[0] + deviation[0] * random.uniform(-1.5, 1.5);
      cv::Mat spots;
      inside.convertTo(spots, CV_32F, random.uniform(0.3, 0.9) / 255.0, 0.05);
      return spots + texture * 0.02;
    }
    default: {  // gravel: discs of all sizes upon each other
      cv::Mat canvas = texture * 0.1 + 0.4;
      for (int i = width * height / 400; i > 0; --i) {
        const double size = std::exp(random.uniform(std::log(1.5), std::log(40.0)));
        const cv::RotatedRect stone(cv::Point2f(anywhere(canvas, random)),
                                    cv::Size2d(2.0 * size, 2.0 * size * random.uniform(0.4, 1.0)),
                                    random.uniform(0.0F, 180.0F));
        cv::ellipse(canvas, stone, grey(random.uniform(0.0, 1.0)), -1, cv::LINE_AA);
      }
      return canvas;
    }
  }
}

PhotographPieces cut_photographs(const std::filesystem::path& cern_panel) {
  std::ifstream table(cern_panel / "visible.csv");
  std::map<std::string, std::vector<cv::Point2d>> targets;
  std::string line;
  std::getline(table, line);
  while (std::getline(table, line)) {
    std::istringstream row(line);
    std::string image, id, x, y;
    std::getline(row, image, ',');
    std::getline(row, id, ',');
    std::getline(row, x, ',');
    std::getline(row, y, ',');
    targets[image].emplace_back(std::stod(x), std::stod(y));
  }
  PhotographPieces result;
  constexpr int side = 72;
  constexpr double target_reach_px = 34.0;  // outer radius of the largest ring in the set is 32 px
  for (const auto& [image, places] : targets) {
    const cv::Mat photograph = cv::imread((cern_panel / image).string(), cv::IMREAD_UNCHANGED);
    for (int y = 0; y + side <= photograph.rows; y += side / 3) {
      for (int x = 0; x + side <= photograph.cols; x += side / 3) {
        const cv::Rect square(x, y, side, side);
        if (overlaps(square, places, target_reach_px)) continue;
        cv::Scalar mean;
        cv::Scalar deviation;
        cv::meanStdDev(photograph(square), mean, deviation);
        if (deviation[0] > 3.0) result.pieces.push_back(photograph(square).clone());  // the dark hall shows nothing
      }
    }
  }
  return result;
}

cv::Mat draw_photographs(int width, int height, cv::RNG& random, const PhotographPieces& pieces) {
  cv::Mat canvas(height, width, CV_32F, grey(0.1));
  if (pieces.pieces.empty()) return canvas;
  const double scale = std::exp(random.uniform(std::log(0.7), std::log(3.0)));
  const double gain = random.uniform(1.0, 4.0);
  const int side = static_cast<int>(pieces.pieces.front().cols * scale);
  for (int y = 0; y < height; y += side) {
    for (int x = 0; x < width; x += side) {
      const auto chosen = static_cast<std::size_t>(random.uniform(0, static_cast<int>(pieces.pieces.size())));
      cv::Mat piece;
      pieces.pieces[chosen].convertTo(piece, CV_32F, gain / 255.0);
      cv::resize(piece, piece, {side, side}, 0.0, 0.0, cv::INTER_CUBIC);
      for (int turn = random.uniform(0, 4); turn > 0; --turn) cv::rotate(piece, piece, cv::ROTATE_90_CLOCKWISE);
      if (random.uniform(0, 2) == 0) cv::flip(piece, piece, 1);
      const cv::Rect room = cv::Rect(x, y, side, side) & cv::Rect(0, 0, width, height);
      piece(cv::Rect(0, 0, room.width, room.height)).copyTo(canvas(room));
    }
  }
  return canvas;
}

cv::Mat draw_clutter_frame(Clutter kind, int width, int height, std::uint64_t seed, const PhotographPieces& pieces) {
  cv::RNG random(seed * 7919 + static_cast<std::uint64_t>(kind) + 1);
  switch (kind) {
    case Clutter::shapes:
      return exposed(draw_clutter(width, height, seed, LookAlikes::without), random);
    case Clutter::look_alikes:
      return exposed(draw_clutter(width, height, seed, LookAlikes::with), random);
    case Clutter::print:
      return exposed(draw_print(width, height, random), random);
    case Clutter::circuit:
      return exposed(draw_circuit(width, height, random), random);
    case Clutter::machines:
      return exposed(draw_machines(width, height, random), random);
    case Clutter::gauges:
      return exposed(draw_gauges(width, height, random), random);
    case Clutter::hall:
      return exposed(draw_hall(width, height, random), random);
    case Clutter::texture:
      return exposed(draw_texture(width, height, random), random);
    case Clutter::grids:
      return exposed(draw_grids(width, height, random), random);
    case Clutter::photographs:
      return exposed(draw_photographs(width, height, random, pieces), random);
  }
  return {};
}

}  // namespace imprint::paper
