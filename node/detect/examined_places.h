#pragma once

#include <map>
#include <utility>
#include <vector>

#include "node/detect/ellipse.h"

namespace imprint {

/// Ellipses already looked at: one dot is found from several maxima, on two levels. On a finer level it gets another
/// look, since the coarser one may have had too few pixels.
class ExaminedPlaces {
 public:
  /// Whether a look of that rank (`Look::rank`), or one that sees as well, has met such an ellipse there.
  [[nodiscard]] bool has_like(const Ellipse& ellipse, int rank) const;
  void add(const Ellipse& ellipse, int rank);

 private:
  struct Place {
    Ellipse ellipse;
    int rank;
  };
  std::map<std::pair<int, int>, std::vector<Place>> cells_;
};

}  // namespace imprint
