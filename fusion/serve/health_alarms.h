#pragma once

#include <map>
#include <string>
#include <vector>

#include "lib/result/result.h"
#include "lib/wire/wire.h"

namespace imprint {

/// When a camera's health record becomes an alarm. All ours; 0 or below turns a limit off.
struct HealthLimits {
  double max_temperature_c = 70.0;   // of housing or sensor; below what boards and lenses are made for (85 C)
  double max_reprojection_px = 1.0;  // of the targets: ten times what a good pose shows
  double max_blur_px = 3.0;          // across the rims: dirt, focus, a lens that is loose
  double min_contrast = 0.02;        // across the rims, share of full scale
  double min_storage_mb = 200.0;     // free on the node's data partition
  double hysteresis = 0.2;           // share of the limit by which a value must be better before the alarm ends
  int records = 3;                   // in a row that must say so, to begin or end an alarm

  [[nodiscard]] Result<void> validate() const;
};

/// Watches the health records of all cameras. An alarm begins after `records` records in a row beyond its limit and
/// ends after as many on the good side of limit and hysteresis: a value that trembles at its limit makes one alarm.
class HealthAlarms {
 public:
  struct Change {
    std::string name;  ///< of the alarm: `temperature_cam1`
    std::string text;  ///< empty: it has ended
  };

  explicit HealthAlarms(HealthLimits limits) : limits_(limits) {}

  /// What the record changes.
  std::vector<Change> note(const Health& health);

 private:
  struct State {
    bool stands = false;
    int streak = 0;  // records in a row that contradict `stands`
  };
  struct Watched {
    const char* name;
    const char* words;
    const char* unit;
    double limit;
    bool above;  // beyond the limit is above it
    std::optional<double> value;
  };
  std::vector<Watched> watched(const Health& health) const;

  HealthLimits limits_;
  std::map<std::string, State> states_;  // by the alarm's name
};

}  // namespace imprint
