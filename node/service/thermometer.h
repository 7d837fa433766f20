#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "lib/result/result.h"

namespace imprint {

/// A temperature of the board: `hwmon:CHIP/tempN` (a sensor of the kernel, by the chip's name), `file:PATH` (any file
/// with thousandths of a degree, as hwmon's), `simulated` (25 to 45 C, up and down in ten minutes), or nothing.
class Thermometer {
 public:
  /// Fails (invalid_input) on another text. That a sensor is not there is no failure: it gives nothing.
  static Result<Thermometer> open(const std::string& source, const std::filesystem::path& hwmon = "/sys/class/hwmon");

  /// In C; nothing when it cannot be read at this moment.
  [[nodiscard]] std::optional<double> read() const;

 private:
  std::filesystem::path file_;
  bool simulated_ = false;
};

}  // namespace imprint
