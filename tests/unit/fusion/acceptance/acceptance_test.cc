#include "fusion/acceptance/acceptance.h"

#include <cmath>

#include <catch2/catch.hpp>

#include "fusion/acceptance/stock.h"

namespace imprint {
namespace {

/// A round bar of 200 mm, 1000 mm long, bent by `bow_mm` towards y; every diameter known to 0.5 mm.
Measurement bar(double bow_mm) {
  Measurement m;
  m.length_mm = 1000.0;
  for (int i = 0; i <= 100; ++i) {
    const double s = 10.0 * i, y = bow_mm * std::sin(M_PI * s / 1000.0);
    m.sections.push_back({s, {s, y, 0.0}, y, 200.0, 0.0, 0.2, 0.5, 0.1});
    m.shape.push_back({{y, 0.0}, 100.0, Eigen::Matrix<double, 2 * kHarmonics, 1>::Zero()});
  }
  m.straightness.max_deflection = {bow_mm, 0.2};
  m.draws = {m.shape, m.shape};
  for (auto& section : m.draws[0]) section.radius_mm += 0.3;
  for (auto& section : m.draws[1]) section.radius_mm -= 0.3;
  return m;
}

Nominal nominal(double lower, double upper) {
  return {.name = "bar",
          .cold = false,
          .max_deflection_mm = 0.0,
          .min_stock_mm = 2.0,
          .steps = {{"whole", 0.0, 1000.0, 200.0, lower, upper, 190.0}}};
}

}  // namespace

TEST_CASE("acceptance: a value is judged only where its interval lets it be") {
  CHECK(decide({10.0, 0.5}, 9.0, 11.0) == Verdict::pass);
  CHECK(decide({10.8, 0.5}, 9.0, 11.0) == Verdict::undecided);
  CHECK(decide({11.2, 0.5}, 9.0, 11.0) == Verdict::undecided);
  CHECK(decide({11.6, 0.5}, 9.0, 11.0) == Verdict::fail);
  CHECK(decide({8.4, 0.5}, 9.0, 11.0) == Verdict::fail);
}

TEST_CASE("acceptance: a step passes, fails or stays open by its worst section") {
  CHECK(accept(bar(0.0), nominal(-2.0, 2.0))->steps[0].verdict == Verdict::pass);
  CHECK(accept(bar(0.0), nominal(-0.2, 2.0))->steps[0].verdict == Verdict::undecided);
  CHECK(accept(bar(0.0), nominal(1.0, 2.0))->steps[0].verdict == Verdict::fail);
  Measurement dented = bar(0.0);
  dented.sections[40].diameter_mm = 195.0;
  const auto found = accept(dented, nominal(-2.0, 2.0));
  CHECK(found->verdict == Verdict::fail);
  CHECK(found->steps[0].smallest_at_mm == 400.0);
}

TEST_CASE("acceptance: a straight part of 190 mm in a straight bar of 200 mm has 5 mm of stock") {
  const auto found = accept(bar(0.0), nominal(-2.0, 2.0));
  REQUIRE(found->stock);
  CHECK(found->stock->least.mm == Approx(5.0).margin(0.01));
  CHECK(found->stock->least.ci95_mm == Approx(1.96 * 0.3).epsilon(0.05));
  CHECK(found->stock->verdict == Verdict::pass);
}

TEST_CASE("acceptance: in a bar bent by 4 mm the part lies half way between its middle and its ends") {
  const auto found = accept(bar(4.0), nominal(-2.0, 2.0));
  REQUIRE(found->stock);
  CHECK(found->stock->least.mm == Approx(3.0).margin(0.02));
  CHECK(found->stock->y_first_mm == Approx(2.0).margin(0.02));
  CHECK(found->stock->z_last_mm == Approx(0.0).margin(0.02));
  CHECK(accept(bar(8.0), nominal(-2.0, 2.0))->stock->verdict == Verdict::fail);       // 1.0 mm where 2 are wanted
  CHECK(accept(bar(6.0), nominal(-2.0, 2.0))->stock->verdict == Verdict::undecided);  // 2.0 +- 0.6
}

TEST_CASE("acceptance: out-of-round counts where it is narrow") {
  Measurement m = bar(0.0);
  m.shape[50].harmonics_mm(0) = -3.0;  // 3 mm narrower towards y at 500 mm
  const auto found = accept(m, nominal(-2.0, 2.0));
  CHECK(found->stock->least.mm == Approx(2.0).margin(0.02));
  CHECK(found->stock->least_at_mm == 500.0);
  CHECK(std::abs(std::remainder(found->stock->direction_deg, 180.0)) < 1.0);
}

TEST_CASE("acceptance: a short part is moved along to where there is most") {
  Measurement m = bar(0.0);
  for (std::size_t i = 0; i < 30; ++i) m.shape[i].radius_mm = 97.0;
  Nominal part = nominal(-2.0, 2.0);
  part.steps[0].to_mm = 500.0;
  const auto found = accept(m, part);
  CHECK(found->stock->least.mm == Approx(5.0).margin(0.02));
  CHECK(found->stock->shift_mm > 290.0);
}

TEST_CASE(
    "acceptance: a part longer than the forging fails, a step beyond it and a cold nominal without heat are errors") {
  Nominal part = nominal(-2.0, 2.0);
  part.steps[0].to_mm = 1010.0;
  CHECK(accept(bar(0.0), part)->stock->verdict == Verdict::fail);
  part.steps.push_back({"beyond", 1200.0, 1300.0, 100.0, -1.0, 1.0, std::nullopt});
  CHECK_FALSE(accept(bar(0.0), part));
  Nominal cold = nominal(-2.0, 2.0);
  cold.cold = true;
  const auto unknown = accept(bar(0.0), cold);
  REQUIRE_FALSE(unknown);
  CHECK(unknown.error().message.find("--temperature-c") != std::string::npos);
}

TEST_CASE("acceptance: the deflection's limit is part of the verdict") {
  Nominal straight = nominal(-2.0, 2.0);
  straight.min_stock_mm = 0.0;
  straight.max_deflection_mm = 3.0;
  CHECK(accept(bar(2.0), straight)->verdict == Verdict::pass);
  CHECK(accept(bar(3.1), straight)->verdict == Verdict::undecided);
  CHECK(accept(bar(4.0), straight)->verdict == Verdict::fail);
}

}  // namespace imprint
