#include "node/service/thermometer.h"

#include <chrono>
#include <cmath>
#include <fstream>
#include <numbers>

namespace imprint {
namespace {

constexpr double kMiddle_c = 35.0;
constexpr double kSwing_c = 10.0;
constexpr double kPeriod_s = 600.0;
constexpr double kLowest_c = -60.0;  // beyond these a sensor is broken
constexpr double kHighest_c = 200.0;

std::filesystem::path sensor_of(const std::filesystem::path& hwmon, const std::string& chip, const std::string& input) {
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(hwmon, ignored)) {
    std::ifstream file(entry.path() / "name");
    std::string name;
    if (std::getline(file, name) && name == chip) return entry.path() / (input + "_input");
  }
  return {};
}

}  // namespace

Result<Thermometer> Thermometer::open(const std::string& source, const std::filesystem::path& hwmon) {
  Thermometer thermometer;
  if (source.empty()) return thermometer;
  if (source == "simulated") {
    thermometer.simulated_ = true;
    return thermometer;
  }
  if (source.starts_with("file:")) {
    thermometer.file_ = source.substr(5);
    return thermometer;
  }
  const auto slash = source.find('/');
  if (source.starts_with("hwmon:") && slash != std::string::npos && slash + 1 < source.size()) {
    thermometer.file_ = sensor_of(hwmon, source.substr(6, slash - 6), source.substr(slash + 1));
    return thermometer;
  }
  return invalid_input("expected hwmon:CHIP/tempN, file:PATH or simulated, found \"{}\"", source);
}

std::optional<double> Thermometer::read() const {
  if (simulated_) {
    const std::chrono::duration<double> now = std::chrono::steady_clock::now().time_since_epoch();
    return kMiddle_c + kSwing_c * std::sin(2.0 * std::numbers::pi * now.count() / kPeriod_s);
  }
  if (file_.empty()) return std::nullopt;
  std::ifstream file(file_);
  double thousandths = 0.0;
  if (!(file >> thousandths)) return std::nullopt;
  const double celsius = 0.001 * thousandths;
  return celsius > kLowest_c && celsius < kHighest_c ? std::optional(celsius) : std::nullopt;
}

}  // namespace imprint
