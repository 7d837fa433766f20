#include "cli/calibration_sheet.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <cairo-pdf.h>
#include <cairo.h>
#include <fmt/core.h>

#include "lib/adjust/calibration_review.h"

namespace imprint {
namespace {

struct Rgb {
  double r, g, b;
};
constexpr Rgb kInk{0.13, 0.13, 0.13}, kFaint{0.78, 0.78, 0.78}, kUsed{0.05, 0.35, 0.65}, kLeftOut{0.80, 0.20, 0.10};

struct Box {
  double x, y, width, height;
};

// A cairo context with the few marks that the sheet is made of; lengths in points.
class Pen {
 public:
  explicit Pen(cairo_surface_t* surface) : cairo_(cairo_create(surface), cairo_destroy) {}

  void scale(double factor) { cairo_scale(raw(), factor, factor); }
  void color(const Rgb& c) { cairo_set_source_rgb(raw(), c.r, c.g, c.b); }
  void fill_page() {
    color({1, 1, 1});
    cairo_paint(raw());
  }
  void line(double x1, double y1, double x2, double y2, double width = 0.5) {
    cairo_set_line_width(raw(), width);
    cairo_move_to(raw(), x1, y1);
    cairo_line_to(raw(), x2, y2);
    cairo_stroke(raw());
  }
  void frame(const Box& box) {
    cairo_set_line_width(raw(), 0.5);
    cairo_rectangle(raw(), box.x, box.y, box.width, box.height);
    cairo_stroke(raw());
  }
  void dot(double x, double y, double radius) {
    cairo_new_path(raw());  // text leaves its end behind, from where an arc would draw a line
    cairo_arc(raw(), x, y, radius, 0, 2 * std::numbers::pi);
    cairo_fill(raw());
  }
  void text(double x, double y, const std::string& words, double size = 8.0, bool bold = false) {
    cairo_select_font_face(raw(), "sans-serif", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(raw(), size);
    cairo_move_to(raw(), x, y);
    cairo_show_text(raw(), words.c_str());
  }
  void next_page() { cairo_show_page(raw()); }

 private:
  cairo_t* raw() { return cairo_.get(); }
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> cairo_;
};

// 1, 2 or 5 times a power of ten, not above `value`.
double round_step(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

void draw_vectors(Pen& pen, const Calibration& calibration, Box box) {
  const CameraModel& camera = calibration.camera;
  const double scale = std::min(box.width / camera.width_px, (box.height - 26.0) / camera.height_px);
  const Box image{box.x, box.y + 14.0, scale * camera.width_px, scale * camera.height_px};
  pen.color(kInk);
  pen.text(box.x, box.y + 8.0, "Residuals, observed minus projected", 9.0, true);
  // A typical vector is a fortieth of the image wide.
  const double rms = std::max(calibration.reprojection_rms_px, 1e-9);
  const double stretch = image.width / 40.0 / rms;
  pen.color(kFaint);
  pen.frame(image);
  const double cx = image.x + scale * camera.principal_point.x_px, cy = image.y + scale * camera.principal_point.y_px;
  pen.line(cx - 5, cy, cx + 5, cy);
  pen.line(cx, cy - 5, cx, cy + 5);
  for (const CalibrationResidual& r : calibration.residuals) {
    const double x = image.x + scale * r.at.x_px, y = image.y + scale * r.at.y_px;
    if (!r.used) {
      pen.color(kLeftOut);
      pen.line(x - 2, y - 2, x + 2, y + 2, 0.8);
      pen.line(x - 2, y + 2, x + 2, y - 2, 0.8);
      continue;
    }
    pen.color(kUsed);
    pen.line(x, y, x + stretch * r.dx_px, y + stretch * r.dy_px, 0.7);
    pen.dot(x, y, 0.9);
  }
  const double length_px = round_step(2.0 * rms);
  const double below = image.y + image.height + 10.0;
  pen.color(kUsed);
  pen.line(image.x, below - 3, image.x + stretch * length_px, below - 3, 1.2);
  pen.color(kInk);
  pen.text(image.x + stretch * length_px + 5, below, fmt::format("{:g} px;  x: left out", length_px), 7.5);
}

// Radial part of the residuals against the distance from the principal point, with the mean of each ring: what is left
// of the lens shows as a curve.
void draw_radial_profile(Pen& pen, const Calibration& calibration, Box box) {
  constexpr int kRings = 12;
  const CameraModel& camera = calibration.camera;
  struct Sample {
    double radius_px, outward_px;
  };
  std::vector<Sample> samples;
  double longest = 1.0, largest = 1e-9;
  for (const CalibrationResidual& r : calibration.residuals) {
    if (!r.used) continue;
    const double x = r.at.x_px - camera.principal_point.x_px, y = r.at.y_px - camera.principal_point.y_px;
    const double radius = std::hypot(x, y);
    if (radius < 1.0) continue;
    samples.push_back({radius, (x * r.dx_px + y * r.dy_px) / radius});
    longest = std::max(longest, radius);
    largest = std::max(largest, std::abs(samples.back().outward_px));
  }
  pen.color(kInk);
  pen.text(box.x, box.y + 8.0, "Radial part over the distance from the principal point", 9.0, true);
  const Box plot{box.x + 34.0, box.y + 16.0, box.width - 40.0, box.height - 36.0};
  const auto x_of = [&](double radius_px) { return plot.x + plot.width * radius_px / longest; };
  const auto y_of = [&](double px) { return plot.y + plot.height * (0.5 - 0.48 * px / largest); };
  pen.color(kFaint);
  pen.frame(plot);
  const double step = round_step(largest);
  for (const double mark : {-step, 0.0, step}) {
    pen.color(kFaint);
    pen.line(plot.x, y_of(mark), plot.x + plot.width, y_of(mark));
    pen.color(kInk);
    pen.text(box.x, y_of(mark) + 2.5, fmt::format("{:+g}", mark), 7.0);
  }
  pen.color(kInk);
  pen.text(box.x, plot.y + 7.0, "px", 7.0);
  pen.text(plot.x, plot.y + plot.height + 10.0, "0", 7.0);
  pen.text(plot.x + plot.width - 40.0, plot.y + plot.height + 10.0, fmt::format("{:.0f} px", longest), 7.0);
  std::array<double, kRings> sum{};
  std::array<int, kRings> count{};
  for (const Sample& s : samples) {
    pen.color({0.60, 0.72, 0.85});
    pen.dot(x_of(s.radius_px), y_of(s.outward_px), 1.0);
    const auto ring = static_cast<std::size_t>(std::min<double>(kRings - 1, kRings * s.radius_px / longest));
    sum[ring] += s.outward_px;
    ++count[ring];
  }
  pen.color(kLeftOut);
  for (std::size_t ring = 0; ring < kRings; ++ring) {
    if (count[ring] == 0) continue;
    const double y = y_of(sum[ring] / count[ring]);
    pen.line(x_of(longest * static_cast<double>(ring) / kRings), y,
             x_of(longest * static_cast<double>(ring + 1) / kRings), y, 1.4);
  }
}

// Lines of text from the top of a page down, a new page when one is full.
class TextColumn {
 public:
  TextColumn(Pen& pen, double top, double bottom) : pen_(pen), y_(top), bottom_(bottom) {}
  void add(const std::string& words, double size = 8.0, bool bold = false) {
    if (y_ > bottom_) {
      pen_.next_page();
      y_ = 50.0;
    }
    pen_.color(kInk);
    pen_.text(kLeft, y_, words, size, bold);
    y_ += size * 1.45;
  }
  void add_wrapped(const std::string& words, std::size_t columns = 115) {
    std::size_t begin = 0;
    while (begin < words.size()) {
      std::size_t length = std::min(columns, words.size() - begin);
      if (begin + length < words.size()) {
        const auto blank = words.rfind(' ', begin + length);
        if (blank != std::string::npos && blank > begin) length = blank - begin;
      }
      add((begin > 0 ? "    " : "") + words.substr(begin, length));
      begin += length;
      while (begin < words.size() && words[begin] == ' ') ++begin;
    }
  }
  void skip(double points = 8.0) { y_ += points; }
  void restart(double top) { y_ = top; }
  [[nodiscard]] double y() const { return y_; }

  static constexpr double kLeft = 45.0;

 private:
  Pen& pen_;
  double y_, bottom_;
};

double constant(const CameraModel& camera, std::size_t i) {
  const std::array<double, 3> first{camera.focal_length_px, camera.principal_point.x_px, camera.principal_point.y_px};
  return i < 3 ? first[i] : camera.distortion.terms()[i - 3];
}

void write_constants(TextColumn& column, const CalibrationSheet& sheet) {
  const Calibration& calibration = sheet.calibration;
  const CameraModel& camera = calibration.camera;
  column.add(fmt::format("Calibration of camera {}", camera.id), 15.0, true);
  column.add(fmt::format("{}, {} x {} px, pixel pitch {} um, field {}", sheet.made_at, camera.width_px,
                         camera.height_px, camera.pixel_pitch_um, sheet.field_name));
  column.add(fmt::format("Reprojection RMS {:.4f} px over {} targets in {} images", calibration.reprojection_rms_px,
                         calibration.observations, sheet.images.size()));
  if (calibration.target_sigma_mm > 0.0)
    column.add(fmt::format("Targets off the field by {:.4f} mm a coordinate, alike in all images (sigma)",
                           calibration.target_sigma_mm));
  column.skip();
  for (std::size_t i = 0; i < kInteriorNames.size(); ++i) {
    const double value = constant(camera, i), half_width = calibration.ci95(static_cast<int>(i));
    column.add(i < 3 ? fmt::format("{}  {:.3f} +- {:.3f}", kInteriorNames[i], value, half_width)
                     : fmt::format("{}  {:.4e} +- {:.1e}", kInteriorNames[i], value, half_width));
  }
  column.add(fmt::format("focal length in mm  {:.4f} +- {:.4f}   (intervals: 95 %)",
                         camera.focal_length_px * camera.pixel_pitch_um / 1000.0,
                         calibration.ci95(0) * camera.pixel_pitch_um / 1000.0));
}

void write_lists(TextColumn& column, const CalibrationSheet& sheet) {
  const Calibration& calibration = sheet.calibration;
  column.add("Images", 10.0, true);
  for (std::size_t i = 0; i < sheet.images.size(); ++i) {
    double squares = 0.0;
    int used = 0;
    for (const CalibrationResidual& r : calibration.residuals)
      if (r.image == i && r.used) squares += r.dx_px * r.dx_px + r.dy_px * r.dy_px, ++used;
    column.add(fmt::format("{}: {} targets, RMS {:.4f} px", sheet.images[i].name, used,
                           used > 0 ? std::sqrt(squares / used) : 0.0));
  }
  column.skip();
  column.add("Left out", 10.0, true);
  bool any = false;
  for (const CalibrationResidual& r : calibration.residuals) {
    if (r.used) continue;
    any = true;
    column.add(fmt::format("{} target {}: {}", sheet.images[r.image].name, r.id, rejection_reason(calibration, r)));
  }
  for (const UnknownTarget& u : calibration.unknown) {
    any = true;
    column.add(fmt::format("{} target {}: not in the field", sheet.images[u.image].name, u.id));
  }
  if (!any) column.add("none");
  column.skip();
  column.add("Warnings", 10.0, true);
  for (const std::string& warning : calibration.warnings) column.add_wrapped(warning);
  if (calibration.warnings.empty()) column.add("none");
}

void draw_correlations(Pen& pen, TextColumn& column, const InteriorMatrix& covariance) {
  column.skip();
  column.add("Correlations between the constants", 10.0, true);
  constexpr std::array<const char*, 10> kShort{"f", "x0", "y0", "A1", "A2", "A3", "B1", "B2", "C1", "C2"};
  const double left = TextColumn::kLeft + 22.0, cell = 42.0;
  const double head = column.y();
  column.skip(12.0);
  for (int j = 0; j < kInteriorTerms; ++j) pen.text(left + cell * j, head, kShort[static_cast<std::size_t>(j)], 7.5);
  for (int i = 0; i < kInteriorTerms; ++i) {
    const double y = column.y();
    pen.color(kInk);
    pen.text(TextColumn::kLeft, y, kShort[static_cast<std::size_t>(i)], 7.5);
    for (int j = 0; j <= i; ++j) {
      const double c = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
      pen.color(i != j && std::abs(c) > 0.95 ? kLeftOut : kInk);
      pen.text(left + cell * j, y, fmt::format("{:+.3f}", c), 7.5);
    }
    column.skip(11.0);
  }
}

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

Result<void> drawn(const Surface& surface) {
  const cairo_status_t status = cairo_surface_status(surface.get());
  if (status != CAIRO_STATUS_SUCCESS)
    return job_failed("calibration record: cannot be drawn: {}", cairo_status_to_string(status));
  return {};
}

}  // namespace

Result<std::string> draw_residuals_png(const CalibrationSheet& sheet) {
  constexpr int kWidth = 720, kHeight = 800;
  constexpr double kScale = 2.0;  // sharp on a screen of today
  const Surface surface(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(kScale * kWidth),
                                                   static_cast<int>(kScale * kHeight)),
                        cairo_surface_destroy);
  {
    Pen pen(surface.get());
    pen.scale(kScale);
    pen.fill_page();
    pen.color(kInk);
    pen.text(20, 24,
             fmt::format("camera {}: reprojection RMS {:.4f} px, {} targets in {} images", sheet.calibration.camera.id,
                         sheet.calibration.reprojection_rms_px, sheet.calibration.observations, sheet.images.size()),
             12.0, true);
    draw_vectors(pen, sheet.calibration, {20, 40, 680, 540});
    draw_radial_profile(pen, sheet.calibration, {20, 600, 680, 190});
  }
  std::string bytes;
  if (const auto status = cairo_surface_write_to_png_stream(surface.get(), append, &bytes);
      status != CAIRO_STATUS_SUCCESS)
    return job_failed("calibration plot: cannot be drawn: {}", cairo_status_to_string(status));
  return bytes;
}

Result<std::string> draw_record_pdf(const CalibrationSheet& sheet) {
  constexpr double kA4Width = 595.276, kA4Height = 841.89;
  std::string bytes;
  const Surface surface(cairo_pdf_surface_create_for_stream(append, &bytes, kA4Width, kA4Height),
                        cairo_surface_destroy);
  {
    Pen pen(surface.get());
    TextColumn first(pen, 55.0, kA4Height - 40.0);
    write_constants(first, sheet);
    const double width = kA4Width - 2.0 * TextColumn::kLeft;
    draw_vectors(pen, sheet.calibration, {TextColumn::kLeft, first.y() + 8.0, width, 390.0});
    draw_radial_profile(pen, sheet.calibration, {TextColumn::kLeft, first.y() + 408.0, width, 150.0});
    pen.next_page();
    TextColumn second(pen, 50.0, kA4Height - 40.0);
    write_lists(second, sheet);
    if (second.y() > kA4Height - 200.0) {
      pen.next_page();
      second.restart(50.0);
    }
    draw_correlations(pen, second, sheet.calibration.covariance);
    pen.next_page();
  }
  cairo_surface_finish(surface.get());
  if (auto done = drawn(surface); !done) return pass_on(done.error());
  return bytes;
}

}  // namespace imprint
