#include "lib/targets/target_sheet.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <catch2/catch.hpp>
#include <opencv2/imgcodecs.hpp>

#include "lib/targets/code_distance.h"
#include "lib/targets/sheet_layout.h"
#include "node/detect/detect_config.h"
#include "node/detect/detect_targets.h"
#include "tests/unit/temporary_folder.h"

using namespace imprint;
namespace fs = std::filesystem;

namespace {

/// The first `count` codes at distance 3 with 6 transitions or more, ids from `first_id`.
TargetLibrary library_of(int bits, int count, int first_id = 1) {
  TargetLibrary library;
  library.bits = bits;
  library.min_distance = 3;
  for (std::uint32_t code = 1; static_cast<int>(library.codes.size()) < count; ++code) {
    REQUIRE(code < (std::uint32_t{1} << bits));
    const bool far = std::all_of(library.codes.begin(), library.codes.end(),
                                 [&](const TargetCode& other) { return cyclic_distance(code, other.code, bits) >= 3; });
    if (far && bit_transitions(code, bits) >= 6)
      library.codes.push_back({first_id + static_cast<int>(library.codes.size()), code});
  }
  return library;
}

/// The pages of a document as grey images, drawn by poppler.
std::vector<cv::Mat> rasterized(const std::string& pdf, int dots_per_inch) {
  const TemporaryFolder folder;
  const fs::path document = folder.path() / "sheet.pdf";
  std::ofstream(document, std::ios::binary) << pdf;
  const std::string command =
      fmt::format("pdftoppm -gray -r {} {} {}", dots_per_inch, document.string(), (folder.path() / "page").string());
  REQUIRE(std::system(command.c_str()) == 0);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder.path())) {
    if (entry.path().extension() == ".pgm") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());  // poppler pads the page's number with zeros
  std::vector<cv::Mat> images;
  for (const fs::path& file : files) {
    images.push_back(cv::imread(file.string(), cv::IMREAD_GRAYSCALE));
    REQUIRE_FALSE(images.back().empty());
  }
  return images;
}

/// Every planned target and no other is seen on its page, within 0.05 mm of its place, its dot true to 0.05 mm.
void check_read_back(const TargetLibrary& library, const SheetLayout& layout, int dots_per_inch) {
  const auto plan = plan_target_sheet(library, layout);
  REQUIRE(plan);
  const auto pdf = draw_target_sheet(library, layout, *plan);
  REQUIRE(pdf);
  const double px_a_mm = dots_per_inch / 25.4;
  const auto pages = rasterized(*pdf, dots_per_inch);
  REQUIRE(static_cast<int>(pages.size()) == plan->pages);
  std::size_t found = 0;
  for (int page = 0; page < plan->pages; ++page) {
    const cv::Mat& image = pages[static_cast<std::size_t>(page)];
    CHECK(image.cols == Approx(layout.page.width_mm * px_a_mm).margin(1.0));  // poppler rounds up to whole pixels
    CHECK(image.rows == Approx(layout.page.height_mm * px_a_mm).margin(1.0));
    for (const DetectedTarget& seen : detect_targets(image, library, DetectConfig{})) {
      const auto placed = std::find_if(plan->targets.begin(), plan->targets.end(),
                                       [&](const PlacedTarget& t) { return t.code.id == seen.id; });
      REQUIRE(placed != plan->targets.end());
      INFO("page " << page << ", id " << seen.id);
      CHECK(placed->page == page);
      CHECK(seen.distance == 0.0);
      // The middle of the first pixel is half a pixel from the page's edge.
      CHECK(std::abs((seen.center.x_px + 0.5) / px_a_mm - placed->x_mm) < 0.05);
      CHECK(std::abs((seen.center.y_px + 0.5) / px_a_mm - placed->y_mm) < 0.05);
      CHECK(std::abs(seen.dot_diameter_px / px_a_mm - layout.dot_diameter_mm) < 0.05);
      ++found;
    }
  }
  CHECK(found == plan->targets.size());
}

}  // namespace

TEST_CASE("target sheet: rasterised A4 pages show every target in its place, true to scale") {
  SheetLayout layout;
  layout.dot_diameter_mm = 10.0;
  check_read_back(library_of(15, 14), layout, 150);
}

TEST_CASE("target sheet: 14 bits and other radii are read back too") {
  TargetLibrary library = library_of(14, 30, 101);
  library.geometry = {2.0, 3.5, 6.0};
  SheetLayout layout;
  layout.dot_diameter_mm = 8.0;
  layout.page = *parse_sheet_page("A3");
  std::swap(layout.page.width_mm, layout.page.height_mm);
  check_read_back(library, layout, 150);
}

TEST_CASE("target sheet: a plate carries one target in its middle, black to its edges") {
  SheetLayout layout;
  layout.dot_diameter_mm = 28.0;
  layout.page = *parse_sheet_page("plate=154x170");
  layout.ids = {5, 3, 9};
  const TargetLibrary library = library_of(15, 14);
  const auto plan = plan_target_sheet(library, layout);
  REQUIRE(plan);
  CHECK(plan->pages == 3);
  CHECK(plan->targets[1].code.id == 3);
  CHECK(plan->targets[1].x_mm == 77.0);
  CHECK(plan->targets[1].y_mm == 85.0);
  const auto pages = rasterized(*draw_target_sheet(library, layout, *plan), 72);
  CHECK(pages[0].at<std::uint8_t>(1, 1) == 0);
  CHECK(pages[0].at<std::uint8_t>(pages[0].rows - 3, pages[0].cols - 3) == 0);
  check_read_back(library, layout, 100);
}

TEST_CASE("target sheet: a ring all white is closed, one all black is empty") {
  TargetLibrary library;
  library.bits = 15;
  library.codes = {{1, 0x7fff}, {2, 0}};
  SheetLayout layout;
  layout.dot_diameter_mm = 20.0;
  const auto plan = plan_target_sheet(library, layout);
  REQUIRE(plan);
  REQUIRE(plan->pages == 1);
  const auto pages = rasterized(*draw_target_sheet(library, layout, *plan), 100);
  for (const PlacedTarget& target : plan->targets) {
    for (int deg = 0; deg < 360; deg += 3) {
      const double angle = deg * 3.14159265358979 / 180.0;
      const int x = static_cast<int>((target.x_mm + 25.0 * std::cos(angle)) * 100.0 / 25.4);
      const int y = static_cast<int>((target.y_mm + 25.0 * std::sin(angle)) * 100.0 / 25.4);
      CHECK(pages[0].at<std::uint8_t>(y, x) == (target.code.id == 1 ? 255 : 0));
    }
  }
}

TEST_CASE("target sheet: the scale bars are as long as they say, along and across the page") {
  const TargetLibrary library = library_of(15, 1);
  SheetLayout layout;
  const auto plan = plan_target_sheet(library, layout);
  REQUIRE(plan);
  CHECK(plan->scale_bar_mm == 150.0);
  constexpr int dots_per_inch = 300;
  constexpr double px_a_mm = dots_per_inch / 25.4;
  const cv::Mat page = rasterized(*draw_target_sheet(library, layout, *plan), dots_per_inch)[0];
  // Ticks stand 3 mm out of each bar: along their middle the first and last dark pixel are the
  // outer edges of the outer ticks, whose lines are 0.2 mm wide.
  const auto extent_mm = [&](const cv::Mat& strip) {
    std::vector<cv::Point> dark;
    cv::findNonZero(strip < 128, dark);
    REQUIRE_FALSE(dark.empty());
    const bool across = strip.cols > 1;
    const int first = across ? dark.front().x : dark.front().y;
    const int last = across ? dark.back().x : dark.back().y;
    return (last - first + 1) / px_a_mm - 0.2;
  };
  const int y = static_cast<int>((297.0 - 10.0 - 1.5) * px_a_mm);
  const int x = static_cast<int>((10.0 + 1.5) * px_a_mm);
  CHECK(extent_mm(page.row(y)) == Approx(150.0).margin(0.1));  // a pixel is 0.085 mm
  CHECK(extent_mm(page.col(x)) == Approx(150.0).margin(0.1));
}

TEST_CASE("target sheet: no two grounds touch, and all stay inside margins and clear of the scale bars") {
  const TargetLibrary library = library_of(15, 40);
  for (const char* page : {"A4", "A2", "A0", "333x555"}) {
    SheetLayout layout;
    layout.dot_diameter_mm = 12.0;
    layout.page = *parse_sheet_page(page);
    const auto plan = plan_target_sheet(library, layout);
    REQUIRE(plan);
    const double half = 0.5 * plan->ground_width_mm;
    for (const PlacedTarget& a : plan->targets) {
      CHECK(a.x_mm - half >= layout.margin_mm + sheet_bar_room_mm);
      CHECK(a.x_mm + half <= layout.page.width_mm - layout.margin_mm);
      CHECK(a.y_mm - half >= layout.margin_mm);
      CHECK(a.y_mm + half + sheet_id_text_mm <= layout.page.height_mm - layout.margin_mm - sheet_bar_room_mm);
      for (const PlacedTarget& b : plan->targets) {
        if (a.code.id >= b.code.id || a.page != b.page) continue;
        CHECK(std::max(std::abs(a.x_mm - b.x_mm), std::abs(a.y_mm - b.y_mm)) >= 2.0 * (half + sheet_cut_mark_mm));
      }
    }
  }
}

TEST_CASE("target sheet: ids come in the order they are asked for, and go on over further pages") {
  SheetLayout layout;
  layout.ids = *parse_id_list("5,3,9-11");
  const auto plan = plan_target_sheet(library_of(15, 14), layout);  // squares of 112 mm: two to a page of A4
  REQUIRE(plan);
  CHECK(plan->pages == 3);
  std::vector<int> ids;
  for (const PlacedTarget& target : plan->targets) ids.push_back(target.code.id);
  CHECK(ids == std::vector<int>{5, 3, 9, 10, 11});
  CHECK(plan->targets[2].page == 1);
}

TEST_CASE("target sheet: what does not fit or does not exist is an error of one line that names the option") {
  const TargetLibrary library = library_of(15, 14);
  const auto message = [&](const SheetLayout& layout) {
    const auto plan = plan_target_sheet(library, layout);
    REQUIRE_FALSE(plan);
    CHECK(plan.error().exit_status() == 2);
    CHECK(plan.error().message.find('\n') == std::string::npos);
    return plan.error().message;
  };
  SheetLayout layout;
  layout.dot_diameter_mm = 60.0;
  CHECK(message(layout).find("--dot-diameter-mm 60") != std::string::npos);
  layout.page = {200.0, 200.0, true};
  CHECK(message(layout).find("--dot-diameter-mm 60") != std::string::npos);
  layout = {};
  layout.ids = {999};
  CHECK(message(layout).find("999") != std::string::npos);
  layout = {};
  layout.dot_diameter_mm = std::nan("");
  CHECK(message(layout).find("--dot-diameter-mm") != std::string::npos);
  layout = {};
  layout.page.width_mm = 9000.0;
  CHECK(message(layout).find("--page") != std::string::npos);
  layout = {};
  layout.margin_mm = -1.0;
  CHECK(message(layout).find("--margin-mm") != std::string::npos);
}

TEST_CASE("target sheet: page sizes and id lists are read or refused as a whole") {
  CHECK(parse_sheet_page("A0")->height_mm == 1189.0);
  CHECK(parse_sheet_page("300x400.5")->height_mm == 400.5);
  CHECK_FALSE(parse_sheet_page("300x400")->plate);
  CHECK(parse_sheet_page("plate=300x300")->plate);
  for (const char* text : {"", "A7", "300", "300x", "x300", "300x400mm", "plate=", "plate=300", "plate=A4", "a4 "})
    CHECK_FALSE(parse_sheet_page(text));
  CHECK(*parse_id_list("1,5,7-9") == std::vector<int>{1, 5, 7, 8, 9});
  for (const char* text : {"", ",", "1,", "1,,2", "a", "3-1", "-2", "1-", "1,1", "4,2-6", "1-2000000000", "1;2", " 1"})
    CHECK_FALSE(parse_id_list(text));
}
