#pragma once

#include <map>
#include <vector>

#include <opencv2/core.hpp>

namespace imprint::paper {

struct Claim {
  int id = 0;
  cv::Point2d center;
};

/// True and false positives and negatives of a data set, [A] 2.4: a target is right within 2 px of its place.
class Scores {
 public:
  void add(const std::map<int, cv::Point2d>& truth, const std::vector<Claim>& claims) {
    for (const Claim& claim : claims) {
      const auto place = truth.find(claim.id);
      const bool right = place != truth.end() && cv::norm(claim.center - place->second) < 2.0;
      right ? ++right_ : ++wrong_;
    }
    there_ += static_cast<int>(truth.size());
  }
  void add(const Scores& other) {
    right_ += other.right_;
    wrong_ += other.wrong_;
    there_ += other.there_;
  }
  [[nodiscard]] double recall() const { return there_ == 0 ? 0.0 : static_cast<double>(right_) / there_; }
  [[nodiscard]] double precision() const {
    return right_ + wrong_ == 0 ? 1.0 : static_cast<double>(right_) / (right_ + wrong_);
  }
  [[nodiscard]] int wrong() const { return wrong_; }

 private:
  int right_ = 0;
  int wrong_ = 0;
  int there_ = 0;
};

}  // namespace imprint::paper
