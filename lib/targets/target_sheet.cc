#include "lib/targets/target_sheet.h"

#include <algorithm>
#include <memory>
#include <numbers>

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/format.h>

#include "lib/targets/code_distance.h"

namespace imprint {
namespace {

constexpr double points_per_mm = 72.0 / 25.4;
constexpr double two_pi = 2.0 * std::numbers::pi;
constexpr double hairline_mm = 0.1;
constexpr double bar_line_mm = 0.2;
constexpr double tick_mm = 3.0;
constexpr double note_text_mm = 2.5;
constexpr double curve_tolerance_pt = 0.003;  // 1 um: cairo makes curves of arcs, by default to a tenth of a point

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

cairo_status_t append(void* text, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

/// Draws in mm from the page's top left corner.
class SheetPainter {
 public:
  SheetPainter(const TargetLibrary& library, const SheetLayout& layout, const SheetPlan& plan, cairo_t* context)
      : library_(library), layout_(layout), plan_(plan), context_(context) {}

  void page(int number) {
    if (layout_.page.plate) {
      set_grey(0.0);
      cairo_paint(context_);
    }
    for (const PlacedTarget& target : plan_.targets) {
      if (target.page == number) draw_target(target);
    }
    set_grey(layout_.page.plate ? 1.0 : 0.0);
    scale_bars();
    note(number);
    cairo_show_page(context_);
  }

 private:
  void draw_target(const PlacedTarget& target) {
    const double half_mm = 0.5 * plan_.ground_width_mm;
    if (!layout_.page.plate) {
      set_grey(0.0);
      cairo_rectangle(context_, target.x_mm - half_mm, target.y_mm - half_mm, 2.0 * half_mm, 2.0 * half_mm);
      cairo_fill(context_);
      crop_marks(target.x_mm, target.y_mm, half_mm);
      const double below_mm = target.y_mm + half_mm + sheet_id_text_mm;
      text(std::to_string(target.code.id), target.x_mm, below_mm, sheet_id_text_mm, 0.5);
    }
    set_grey(1.0);
    dot_and_ring(target);
    if (layout_.page.plate) {
      const double side_mm = layout_.margin_mm + sheet_id_text_mm;
      text(std::to_string(target.code.id), layout_.page.width_mm - layout_.margin_mm, side_mm, sheet_id_text_mm, 1.0);
    }
  }

  void dot_and_ring(const PlacedTarget& target) {
    cairo_new_path(context_);
    cairo_arc(context_, target.x_mm, target.y_mm, 0.5 * layout_.dot_diameter_mm, 0.0, two_pi);
    cairo_fill(context_);
    const int bits = library_.bits;
    const auto white = [&](int bit) { return bit_at(target.code.code, bits, bit) != 0; };
    bool any_black = false;
    for (int first = 0; first < bits; ++first) {
      any_black = any_black || !white(first);
      // One path for a run of white bits: seams between neighbours would show as grey lines.
      if (!white(first) || white(first + bits - 1)) continue;
      int length = 1;
      while (white(first + length)) ++length;
      ring_sector(target, first, length);
    }
    if (!any_black) ring_sector(target, 0, bits);
  }

  /// Angles run clockwise as seen, the page's y being down.
  void ring_sector(const PlacedTarget& target, int first, int length) {
    const double mm_a_unit = 0.5 * layout_.dot_diameter_mm / library_.geometry.dot_radius;
    const double begin = two_pi * first / library_.bits;
    const double end = two_pi * (first + length) / library_.bits;
    cairo_new_path(context_);
    cairo_arc(context_, target.x_mm, target.y_mm, mm_a_unit * library_.geometry.ring_outer_radius, begin, end);
    cairo_arc_negative(context_, target.x_mm, target.y_mm, mm_a_unit * library_.geometry.ring_inner_radius, end, begin);
    cairo_close_path(context_);
    cairo_fill(context_);
  }

  /// Outside each corner, so that nothing of them stays on the target.
  void crop_marks(double x_mm, double y_mm, double half_mm) {
    constexpr double gap_mm = 0.5;
    cairo_set_line_width(context_, hairline_mm);
    for (const double side_x : {-1.0, 1.0}) {
      for (const double side_y : {-1.0, 1.0}) {
        const double x = x_mm + side_x * half_mm;
        const double y = y_mm + side_y * half_mm;
        line(x + side_x * gap_mm, y, x + side_x * sheet_cut_mark_mm, y);
        line(x, y + side_y * gap_mm, x, y + side_y * sheet_cut_mark_mm);
      }
    }
  }

  /// Two bars from the lower left corner, one up and one to the right, a tick each 10 mm.
  void scale_bars() {
    if (plan_.scale_bar_mm <= 0.0) return;
    const double x = layout_.margin_mm + tick_mm;
    const double y = layout_.page.height_mm - layout_.margin_mm - tick_mm;
    const double length = plan_.scale_bar_mm;
    cairo_set_line_width(context_, bar_line_mm);
    line(x, y, x + length, y);
    line(x, y, x, y - length);
    for (double at = 0.0; at <= length + 1e-9; at += 10.0) {
      line(x + at, y, x + at, y + tick_mm);
      line(x, y - at, x - tick_mm, y - at);
    }
  }

  void note(int page_number) {
    if (plan_.scale_bar_mm <= 0.0) return;
    const double x = layout_.margin_mm + tick_mm;
    const double room_mm = layout_.page.width_mm - layout_.margin_mm - x - 1.0;
    const std::string words =
        fmt::format("{:g} mm from end to end, both ways. Dots {:g} mm, {} bits. Page {} of {}.", plan_.scale_bar_mm,
                    layout_.dot_diameter_mm, library_.bits, page_number + 1, plan_.pages);
    const double full_mm = width_of(words, note_text_mm);
    const double size_mm = note_text_mm * std::min(1.0, room_mm / std::max(full_mm, 1e-6));
    text(words, x + 1.0, layout_.page.height_mm - layout_.margin_mm - tick_mm - 1.0, size_mm, 0.0);
  }

  void set_grey(double level) { cairo_set_source_rgb(context_, level, level, level); }

  void line(double x1, double y1, double x2, double y2) {
    cairo_move_to(context_, x1, y1);
    cairo_line_to(context_, x2, y2);
    cairo_stroke(context_);
  }

  double width_of(const std::string& words, double size_mm) {
    cairo_select_font_face(context_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(context_, size_mm);
    cairo_text_extents_t extents;
    cairo_text_extents(context_, words.c_str(), &extents);
    return extents.x_advance;
  }

  /// `share` of the text's width stands left of `x_mm`.
  void text(const std::string& words, double x_mm, double base_mm, double size_mm, double share) {
    const double width_mm = width_of(words, size_mm);
    cairo_move_to(context_, x_mm - share * width_mm, base_mm);
    cairo_show_text(context_, words.c_str());
  }

  const TargetLibrary& library_;
  const SheetLayout& layout_;
  const SheetPlan& plan_;
  cairo_t* context_;
};

}  // namespace

Result<std::string> draw_target_sheet(const TargetLibrary& library, const SheetLayout& layout, const SheetPlan& plan) {
  std::string pdf;
  const Surface surface(cairo_pdf_surface_create_for_stream(append, &pdf, layout.page.width_mm * points_per_mm,
                                                            layout.page.height_mm * points_per_mm),
                        cairo_surface_destroy);
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, "Coded targets, print at 100 %");
  const Context context(cairo_create(surface.get()), cairo_destroy);
  cairo_set_tolerance(context.get(), curve_tolerance_pt);
  cairo_scale(context.get(), points_per_mm, points_per_mm);
  SheetPainter painter(library, layout, plan, context.get());
  for (int page = 0; page < plan.pages; ++page) painter.page(page);
  cairo_surface_finish(surface.get());
  for (const cairo_status_t status : {cairo_status(context.get()), cairo_surface_status(surface.get())}) {
    if (status != CAIRO_STATUS_SUCCESS)
      return job_failed("the PDF could not be drawn: {}", cairo_status_to_string(status));
  }
  return pdf;
}

}  // namespace imprint
