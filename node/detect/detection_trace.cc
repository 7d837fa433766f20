#include "node/detect/detection_trace.h"

namespace imprint {

const char* name_of(Rejection rejection) {
  switch (rejection) {
    case Rejection::none:
      return "target";
    case Rejection::no_dark_ground:
      return "no dark ground round the dot";
    case Rejection::no_ring:
      return "no ring";
    case Rejection::poor_ellipse:
      return "poor ellipse";
    case Rejection::size:
      return "size";
    case Rejection::outside:
      return "ring outside the image";
    case Rejection::no_code:
      return "no code of the library";
    case Rejection::id_twice:
      return "id found twice";
  }
  return "unknown";
}

}  // namespace imprint
