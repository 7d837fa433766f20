#include "survey/relative_orientation.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>

#include "lib/geometry/median.h"

namespace imprint {
namespace {

constexpr double kConfidence = 0.9999;

Eigen::Matrix3d matrix_of(const cv::Mat& m) {
  Eigen::Matrix3d result;
  for (int i = 0; i < 9; ++i) result(i / 3, i % 3) = m.at<double>(i / 3, i % 3);
  return result;
}

CameraPose pose_of(const cv::Mat& R, const Eigen::Vector3d& translation) {
  CameraPose pose;
  pose.R_cam_world = matrix_of(R);
  pose.center_world_mm = -pose.R_cam_world.transpose() * translation.normalized();
  return pose;
}

// Targets in front of both cameras when the rays are intersected.
int count_in_front(const std::vector<RayPair>& pairs, const CameraPose& pose) {
  int count = 0;
  for (const RayPair& pair : pairs) {
    const Eigen::Vector3d a = pair.first.homogeneous();
    const Eigen::Vector3d b = pose.R_cam_world.transpose() * pair.second.homogeneous();
    // Depths along both rays where they are nearest.
    Eigen::Matrix2d matrix;
    matrix << a.dot(a), -a.dot(b), -a.dot(b), b.dot(b);
    const double determinant = matrix.determinant();
    if (determinant < 1e-12 * a.squaredNorm() * b.squaredNorm()) continue;
    const Eigen::Vector2d right(a.dot(pose.center_world_mm), -b.dot(pose.center_world_mm));
    const Eigen::Vector2d depths = matrix.inverse() * right;
    if (depths.x() > 0.0 && depths.y() > 0.0) ++count;
  }
  return count;
}

void add_by_essential(const std::vector<cv::Point2d>& first, const std::vector<cv::Point2d>& second, double tolerance,
                      std::vector<CameraPose>& poses) {
  const cv::Mat all = cv::findEssentialMat(first, second, 1.0, {0.0, 0.0}, cv::RANSAC, kConfidence, tolerance);
  for (int row = 0; row + 3 <= all.rows; row += 3) {
    cv::Mat one, other, translation;
    cv::decomposeEssentialMat(all.rowRange(row, row + 3), one, other, translation);
    const Eigen::Vector3d t(translation.at<double>(0), translation.at<double>(1), translation.at<double>(2));
    for (const cv::Mat& R : {one, other})
      for (const double sign : {1.0, -1.0}) poses.push_back(pose_of(R, sign * t));
  }
}

void add_by_homography(const std::vector<cv::Point2d>& first, const std::vector<cv::Point2d>& second, double tolerance,
                       std::vector<CameraPose>& poses) {
  const cv::Mat H = cv::findHomography(first, second, cv::RANSAC, tolerance, cv::noArray(), 2000, kConfidence);
  if (H.empty()) return;
  std::vector<cv::Mat> rotations, translations, normals;
  cv::decomposeHomographyMat(H, cv::Mat::eye(3, 3, CV_64F), rotations, translations, normals);
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const cv::Mat& m = translations[i];
    const Eigen::Vector3d t(m.at<double>(0), m.at<double>(1), m.at<double>(2));
    if (t.norm() > 1e-6) poses.push_back(pose_of(rotations[i], t));
  }
}

}  // namespace

std::vector<CameraPose> relative_poses(const std::vector<RayPair>& pairs, double tolerance) {
  if (pairs.size() < 5) return {};
  std::vector<cv::Point2d> first, second;
  for (const RayPair& pair : pairs) {
    first.emplace_back(pair.first.x(), pair.first.y());
    second.emplace_back(pair.second.x(), pair.second.y());
  }
  std::vector<CameraPose> poses;
  try {
    add_by_essential(first, second, tolerance, poses);
    add_by_homography(first, second, tolerance, poses);
  } catch (const cv::Exception&) {  // a degenerate set: the poses found before it stand
  }
  std::erase_if(poses, [&](const CameraPose& pose) {
    return !pose.R_cam_world.allFinite() || !pose.center_world_mm.allFinite() ||
           count_in_front(pairs, pose) < 0.6 * static_cast<double>(pairs.size());
  });
  return poses;
}

double parallax_rad(const std::vector<RayPair>& pairs) {
  if (pairs.size() < 4) return 0.0;
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (const RayPair& pair : pairs)
    sum += pair.second.homogeneous().normalized() * pair.first.homogeneous().normalized().transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1.0, 1.0, (svd.matrixU() * svd.matrixV().transpose()).determinant());
  const Eigen::Matrix3d turn = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  std::vector<double> angles;
  for (const RayPair& pair : pairs)
    angles.push_back((turn * pair.first.homogeneous().normalized() - pair.second.homogeneous().normalized()).norm());
  return median(std::move(angles));
}

}  // namespace imprint
