// Print, circuit boards and regular grids.
#include <cmath>
#include <string>

#include <opencv2/imgproc.hpp>

#include "tests/paper/targets/clutter_frames.h"

namespace imprint::paper {
namespace {

cv::Scalar grey(double level) { return cv::Scalar::all(level); }

std::string random_word(cv::RNG& random) {
  static const std::string letters = "aeiounrstldmOQCGDB0689@&%oepbdq.:";
  std::string word;
  for (int length = random.uniform(1, 10); length > 0; --length)
    word += letters[static_cast<std::size_t>(random.uniform(0, static_cast<int>(letters.size())))];
  return word;
}

/// A block of lines in one font.
void print_block(cv::Mat& page, const cv::Rect& block, double ink, cv::RNG& random) {
  const double size = std::exp(random.uniform(std::log(0.25), std::log(4.0)));
  const int font = random.uniform(0, 8);  // OpenCV's Hershey fonts
  const int weight = 1 + static_cast<int>(size * random.uniform(0.5, 3.0));
  const int line = static_cast<int>(34.0 * size) + 3;
  for (int y = block.y + line; y < block.y + block.height; y += line) {
    int x = block.x;
    while (x < block.x + block.width) {
      const std::string word = random_word(random);
      cv::putText(page, word, {x, y}, font, size, grey(ink), weight, cv::LINE_AA);
      x += cv::getTextSize(word, font, size, weight, nullptr).width + static_cast<int>(14.0 * size);
    }
  }
}

/// A package with legs on two sides or four, and its name.
void draw_chip(cv::Mat& board, const cv::Point& place, cv::RNG& random) {
  const int pitch = random.uniform(5, 22);
  const int legs = random.uniform(4, 17);
  const int side = pitch * (legs + 1);
  const cv::Rect body(place, cv::Size(side, random.uniform(0, 2) == 0 ? side : side / 2 + 10));
  const int leg = pitch / 2 + 1;
  const cv::Scalar metal = grey(random.uniform(0.7, 1.0));
  for (int i = 1; i <= legs; ++i) {
    const int x = body.x + i * pitch;
    cv::rectangle(board, cv::Rect(x - leg / 2, body.y - 2 * leg, leg, body.height + 4 * leg), metal, -1);
    const int y = body.y + i * pitch;
    if (body.height == side)
      cv::rectangle(board, cv::Rect(body.x - 2 * leg, y - leg / 2, body.width + 4 * leg, leg), metal, -1);
  }
  cv::rectangle(board, body, grey(random.uniform(0.02, 0.15)), -1);
  cv::circle(board, {body.x + pitch, body.y + pitch}, pitch / 3 + 1, grey(random.uniform(0.3, 0.9)), -1, cv::LINE_AA);
  cv::putText(board, random_word(random), {body.x + pitch, body.y + body.height / 2}, cv::FONT_HERSHEY_SIMPLEX,
              pitch / 14.0, grey(0.8), 1, cv::LINE_AA);
}

/// Tracks at 45 degree steps between two plated holes.
void draw_track(cv::Mat& board, cv::RNG& random) {
  cv::Point at(random.uniform(0, board.cols), random.uniform(0, board.rows));
  const int width = random.uniform(1, 8);
  const int pad = width + random.uniform(2, 14);
  const double copper = random.uniform(0.45, 0.9);
  const auto plated_hole = [&](const cv::Point& center) {
    cv::circle(board, center, pad, grey(std::min(1.0, copper + 0.2)), -1, cv::LINE_AA);
    cv::circle(board, center, pad / 2, grey(0.05), -1, cv::LINE_AA);
  };
  plated_hole(at);
  for (int bends = random.uniform(1, 7); bends > 0; --bends) {
    const int direction = random.uniform(0, 8);
    const int length = random.uniform(20, 260);
    const double angle = direction * CV_PI / 4.0;
    const cv::Point next(at.x + static_cast<int>(length * std::cos(angle)),
                         at.y + static_cast<int>(length * std::sin(angle)));
    cv::line(board, at, next, grey(copper), width, cv::LINE_AA);
    at = next;
  }
  plated_hole(at);
}

}  // namespace

cv::Mat draw_print(int width, int height, cv::RNG& random) {
  const bool dark_paper = random.uniform(0, 2) == 0;
  cv::Mat page(height, width, CV_32F, grey(dark_paper ? 0.08 : 0.92));
  for (int i = width * height / 60000; i > 0; --i) {
    const cv::Rect block(random.uniform(-50, width), random.uniform(-50, height), random.uniform(80, 900),
                         random.uniform(40, 500));
    const bool inverted = random.uniform(0, 4) == 0;
    const double paper = dark_paper != inverted ? random.uniform(0.0, 0.2) : random.uniform(0.8, 1.0);
    cv::rectangle(page, block, grey(paper), -1);
    print_block(page, block, 1.0 - paper, random);
  }
  return page;
}

cv::Mat draw_circuit(int width, int height, cv::RNG& random) {
  cv::Mat board(height, width, CV_32F, grey(random.uniform(0.1, 0.45)));
  for (int i = width * height / 9000; i > 0; --i) draw_track(board, random);
  for (int i = width * height / 60000; i > 0; --i) {
    const cv::Point corner(random.uniform(0, width), random.uniform(0, height));
    const int pitch = random.uniform(8, 50);
    const int radius = static_cast<int>(pitch * random.uniform(0.2, 0.48));
    const double hole = random.uniform(0.0, 0.8);
    for (int row = random.uniform(1, 8); row > 0; --row) {
      for (int column = random.uniform(1, 12); column > 0; --column) {
        const cv::Point at(corner.x + column * pitch, corner.y + row * pitch);
        cv::circle(board, at, radius, grey(0.85), -1, cv::LINE_AA);
        cv::circle(board, at, static_cast<int>(hole * radius), grey(0.04), -1, cv::LINE_AA);
      }
    }
  }
  for (int i = width * height / 90000; i > 0; --i)
    draw_chip(board, {random.uniform(0, width), random.uniform(0, height)}, random);
  return board;
}

cv::Mat draw_grids(int width, int height, cv::RNG& random) {
  cv::Mat canvas(height, width, CV_32F, grey(random.uniform(0.0, 1.0)));
  for (int i = width * height / 50000; i > 0; --i) {
    const cv::Point2d corner(random.uniform(0, width), random.uniform(0, height));
    const double pitch = std::exp(random.uniform(std::log(5.0), std::log(90.0)));
    const double turn = random.uniform(0.0, CV_PI);
    const double squeeze = random.uniform(0.3, 1.0);
    const double size = pitch * random.uniform(0.15, 0.5);
    const double ground = random.uniform(0.0, 1.0);
    const double spot = ground < 0.5 ? random.uniform(ground + 0.2, 1.0) : random.uniform(0.0, ground - 0.2);
    const double hexagonal = random.uniform(0, 2) * 0.5;
    const double missing = random.uniform(0.0, 0.6);
    const int rows = random.uniform(2, 14);
    const int columns = random.uniform(2, 14);
    const auto place = [&](double column, double row) {
      const double x = pitch * column;
      const double y = pitch * squeeze * row;
      return cv::Point2d(corner.x + x * std::cos(turn) - y * std::sin(turn),
                         corner.y + x * std::sin(turn) + y * std::cos(turn));
    };
    std::vector<cv::Point> sheet{place(-1, -1), place(columns + 0.5, -1), place(columns + 0.5, rows), place(-1, rows)};
    cv::fillConvexPoly(canvas, sheet, grey(ground), cv::LINE_AA);
    for (int row = 0; row < rows; ++row) {
      for (int column = 0; column < columns; ++column) {
        if (random.uniform(0.0, 1.0) < missing) continue;
        const cv::RotatedRect disc(place(column + hexagonal * (row % 2), row),
                                   cv::Size2d(2.0 * size, 2.0 * size * squeeze),
                                   static_cast<float>(turn * 180.0 / CV_PI));
        cv::ellipse(canvas, disc, grey(spot), -1, cv::LINE_AA);
      }
    }
  }
  return canvas;
}

}  // namespace imprint::paper
