#pragma once

#include <string>
#include <vector>

#include "lib/result/result.h"
#include "lib/targets/target_library.h"

namespace imprint {

/// What is printed on: paper takes as many targets as fit, each on a black square to cut out; a plate is one target,
/// black to its edges.
struct SheetPage {
  double width_mm = 210.0;
  double height_mm = 297.0;
  bool plate = false;
};

/// "A4" to "A0", upright; "420x300": paper of that width and height in mm; "plate=300x300": a plate.
Result<SheetPage> parse_sheet_page(const std::string& text);

/// Ids of "1,5,7-12" in that order, a range in ascending order. Refuses an id that is named twice.
Result<std::vector<int>> parse_id_list(const std::string& text);

/// How coded targets are laid out on pages to print.
struct SheetLayout {
  double dot_diameter_mm = 28.0;
  SheetPage page;
  double margin_mm = 10.0;        ///< left free along the page's edges; printers need 5 or more
  double border_dot_radii = 1.0;  ///< least black outside the ring, in dot radii
  std::vector<int> ids;           ///< which targets, in this order; empty: all, in the library's order

  [[nodiscard]] Result<void> validate() const;
};

/// Where a target stands: page from 0, its dot's centre in mm right and down from the page's top left corner.
struct PlacedTarget {
  TargetCode code;
  int page = 0;
  double x_mm = 0.0;
  double y_mm = 0.0;
};

struct SheetPlan {
  std::vector<PlacedTarget> targets;  ///< page by page, row by row
  int pages = 0;
  double ground_width_mm = 0.0;  ///< of the black ground round each target
  double ground_height_mm = 0.0;
  double scale_bar_mm = 0.0;  ///< length of the bars along the page's left and lower edge; 0 where there is no room
};

inline constexpr double sheet_id_text_mm = 4.0;   ///< font size of an id
inline constexpr double sheet_cut_mark_mm = 3.0;  ///< reach of a crop mark out of a square's corner
inline constexpr double sheet_bar_room_mm = 9.0;  ///< kept for a scale bar inside the margin

/// Places the chosen targets. Fails when a target does not fit the page or an id is not in the library.
Result<SheetPlan> plan_target_sheet(const TargetLibrary& library, const SheetLayout& layout);

}  // namespace imprint
