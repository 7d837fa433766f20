#include "lib/targets/sheet_layout.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <string_view>

namespace imprint {
namespace {

constexpr double least_side_mm = 20.0;
constexpr double largest_side_mm = 5000.0;  // PDF ends at 5080

/// The whole text as a number, or nothing.
template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "300x400" in mm.
std::optional<SheetPage> parse_sides(std::string_view text, bool plate) {
  const std::size_t by = text.find('x');
  if (by == std::string_view::npos) return std::nullopt;
  const auto width = number_in<double>(text.substr(0, by));
  const auto height = number_in<double>(text.substr(by + 1));
  if (!width || !height) return std::nullopt;
  return SheetPage{*width, *height, plate};
}

/// First and last id of "7-12" or of "7".
std::optional<std::pair<int, int>> parse_id_range(std::string_view text) {
  const std::size_t dash = text.find('-');
  const auto first = number_in<int>(text.substr(0, dash));
  const auto last = dash == std::string_view::npos ? first : number_in<int>(text.substr(dash + 1));
  if (!first || !last || *first < 0 || *last < *first) return std::nullopt;
  return std::pair{*first, *last};
}

Result<std::vector<TargetCode>> chosen_codes(const TargetLibrary& library, const std::vector<int>& ids) {
  if (ids.empty()) return library.codes;
  std::map<int, TargetCode> by_id;
  for (const TargetCode& code : library.codes) by_id[code.id] = code;
  std::vector<TargetCode> codes;
  for (const int id : ids) {
    const auto known = by_id.find(id);
    if (known == by_id.end()) {
      return invalid_input("--ids: expected ids of the library ({} codes, ids {} to {}), found {}", by_id.size(),
                           by_id.begin()->first, by_id.rbegin()->first, id);
    }
    codes.push_back(known->second);
  }
  return codes;
}

/// The cells of a page, each with one target in the middle of its upper part, its id below.
struct Grid {
  double column_mm = 0.0;
  double row_mm = 0.0;
  int columns = 0;
  int rows = 0;
};

Grid paper_grid(const SheetLayout& layout, double square_mm) {
  Grid grid;
  grid.column_mm = square_mm + 2.0 * sheet_cut_mark_mm;
  grid.row_mm = grid.column_mm + sheet_id_text_mm;
  const double used_mm = 2.0 * layout.margin_mm + sheet_bar_room_mm;
  constexpr double rounding_mm = 1e-9;
  grid.columns = static_cast<int>(std::floor((layout.page.width_mm - used_mm + rounding_mm) / grid.column_mm));
  grid.rows = static_cast<int>(std::floor((layout.page.height_mm - used_mm + rounding_mm) / grid.row_mm));
  return grid;
}

/// As long as a steel rule checks well and the page has room for, in both directions.
double scale_bar_for(const SheetLayout& layout) {
  const double room_mm =
      std::min(layout.page.width_mm, layout.page.height_mm) - 2.0 * layout.margin_mm - sheet_bar_room_mm;
  if (room_mm >= 50.0) return std::min(200.0, 50.0 * std::floor(room_mm / 50.0));
  return 10.0 * std::max(0.0, std::floor(room_mm / 10.0));
}

tl::unexpected<Error> too_large(const SheetLayout& layout, double width_mm, double height_mm) {
  return invalid_input(
      "--dot-diameter-mm {:g}: expected a target that fits the page of {:g} x {:g} mm, found one that takes "
      "{:.1f} x {:.1f} mm with margins and scale bars; take a smaller dot or a larger --page",
      layout.dot_diameter_mm, layout.page.width_mm, layout.page.height_mm, width_mm, height_mm);
}

}  // namespace

Result<SheetPage> parse_sheet_page(const std::string& text) {
  static const std::map<std::string, SheetPage> paper{{"A4", {210.0, 297.0}},
                                                      {"A3", {297.0, 420.0}},
                                                      {"A2", {420.0, 594.0}},
                                                      {"A1", {594.0, 841.0}},
                                                      {"A0", {841.0, 1189.0}}};
  if (const auto known = paper.find(text); known != paper.end()) return known->second;
  const std::string_view prefix = "plate=";
  const bool plate = text.starts_with(prefix);
  const auto page = parse_sides(std::string_view(text).substr(plate ? prefix.size() : 0), plate);
  if (!page) {
    return invalid_input("--page: expected A4, A3, A2, A1, A0, WIDTHxHEIGHT or plate=WIDTHxHEIGHT in mm, found \"{}\"",
                         text);
  }
  return *page;
}

Result<std::vector<int>> parse_id_list(const std::string& text) {
  constexpr int most = 1'000'000;  // more than any library has; keeps "1-2000000000" from filling the memory
  std::vector<int> ids;
  std::set<int> seen;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t comma = std::min(text.find(',', begin), text.size());
    const auto range = parse_id_range(std::string_view(text).substr(begin, comma - begin));
    if (!range || range->second - range->first >= most)
      return invalid_input("--ids: expected ids and ranges like 1,5,7-12, found \"{}\"", text);
    for (int id = range->first; id <= range->second; ++id) {
      if (!seen.insert(id).second) return invalid_input("--ids: expected each id once, found {} twice", id);
      ids.push_back(id);
    }
    begin = comma + 1;
  }
  return ids;
}

Result<void> SheetLayout::validate() const {
  if (!(dot_diameter_mm >= 0.5 && dot_diameter_mm <= 1000.0))
    return invalid_input("--dot-diameter-mm: expected 0.5 to 1000, found {:g}", dot_diameter_mm);
  for (const double side_mm : {page.width_mm, page.height_mm}) {
    if (!(side_mm >= least_side_mm && side_mm <= largest_side_mm)) {
      return invalid_input("--page: expected sides of {:g} to {:g} mm, found {:g}", least_side_mm, largest_side_mm,
                           side_mm);
    }
  }
  if (!(margin_mm >= 0.0 && margin_mm <= 0.25 * std::min(page.width_mm, page.height_mm)))
    return invalid_input("--margin-mm: expected 0 to a quarter of the page, found {:g}", margin_mm);
  if (!(border_dot_radii >= 0.5 && border_dot_radii <= 20.0))
    return invalid_input("--border-dot-radii: expected 0.5 to 20, found {:g}", border_dot_radii);
  return {};
}

Result<SheetPlan> plan_target_sheet(const TargetLibrary& library, const SheetLayout& layout) {
  if (auto valid = layout.validate(); !valid) return pass_on(valid.error());
  const auto codes = chosen_codes(library, layout.ids);
  if (!codes) return pass_on(codes.error());
  const double ring_in_dots = library.geometry.ring_outer_radius / library.geometry.dot_radius;
  const double square_mm = layout.dot_diameter_mm * (ring_in_dots + layout.border_dot_radii);
  const double page_width_mm = layout.page.width_mm;
  const double page_height_mm = layout.page.height_mm;
  SheetPlan plan;
  plan.scale_bar_mm = scale_bar_for(layout);
  if (layout.page.plate) {
    // The same room on both sides: the target stays in the plate's middle.
    const double needed_mm = square_mm + 2.0 * (layout.margin_mm + sheet_bar_room_mm);
    if (needed_mm > std::min(page_width_mm, page_height_mm)) return too_large(layout, needed_mm, needed_mm);
    plan.ground_width_mm = page_width_mm;
    plan.ground_height_mm = page_height_mm;
    for (const TargetCode& code : *codes)
      plan.targets.push_back({code, plan.pages++, 0.5 * page_width_mm, 0.5 * page_height_mm});
    return plan;
  }
  const Grid grid = paper_grid(layout, square_mm);
  if (grid.columns < 1 || grid.rows < 1) {
    const double used_mm = 2.0 * layout.margin_mm + sheet_bar_room_mm;
    return too_large(layout, grid.column_mm + used_mm, grid.row_mm + used_mm);
  }
  plan.ground_width_mm = plan.ground_height_mm = square_mm;
  const double left_mm = 0.5 * (page_width_mm + sheet_bar_room_mm - grid.columns * grid.column_mm);
  for (int i = 0; i < static_cast<int>(codes->size()); ++i) {
    const int place = i % (grid.columns * grid.rows);
    const int row = place / grid.columns;
    const int column = place % grid.columns;
    plan.pages = i / (grid.columns * grid.rows) + 1;
    plan.targets.push_back({(*codes)[static_cast<std::size_t>(i)], plan.pages - 1,
                            left_mm + (column + 0.5) * grid.column_mm,
                            layout.margin_mm + row * grid.row_mm + 0.5 * grid.column_mm});
  }
  return plan;
}

}  // namespace imprint
