#include "node/imprint/rim_agreement.h"

#include <cmath>
#include <functional>

#include <catch2/catch.hpp>

namespace imprint {
namespace {

using Shape = std::function<double(double)>;

RimCurve rim(const Shape& offset_px, double weight = 1.0) {
  RimCurve curve;
  for (int s = 0; s < 1200; ++s) curve.push_back({static_cast<double>(s), offset_px(s), weight});
  return curve;
}

double bow(double s) { return 8.0 * (1.0 - std::pow((s - 600.0) / 600.0, 2)); }

double trust(const RimCurve& curve, int first, int last) {
  double sum = 0;
  for (const CurveSample& s : curve)
    if (s.station_px >= first && s.station_px < last) sum += s.weight;
  return sum / (last - first);
}

}  // namespace

TEST_CASE("rim agreement: two rims of one bent body keep all their trust") {
  for (const double height : {0.0, 1.0, 6.0}) {  // up to a bow of 48 px
    RimCurve upper = rim([&](double s) { return height * bow(s) - 90; }),
             lower = rim([&](double s) { return height * bow(s) + 90; });
    reject_disagreement(upper, lower, FilterConfig{});
    CHECK(trust(upper, 0, 1200) > 0.99);
    CHECK(trust(lower, 0, 1200) > 0.99);
  }
}

TEST_CASE("rim agreement: a kinked body is one body too") {
  const Shape kink = [](double s) { return 20.0 * (1.0 - std::abs(s - 500.0) / 500.0); };
  RimCurve upper = rim([&](double s) { return kink(s) - 90; }), lower = rim([&](double s) { return kink(s) + 90; });
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(upper, 0, 450) > 0.95);
  CHECK(trust(lower, 600, 1200) > 0.95);
}

TEST_CASE("rim agreement: the border of scale inside the body is not believed, the other rim is") {
  RimCurve upper = rim([](double s) { return bow(s) - 90 + (s > 400 && s < 480 ? 1.2 : 0.0); }),
           lower = rim([](double s) { return bow(s) + 90; });
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(upper, 410, 470) < 0.05);
  CHECK(trust(lower, 410, 470) > 0.95);
  CHECK(trust(upper, 0, 390) > 0.95);
}

TEST_CASE("rim agreement: at an end the edge of a beam beside the body drags nothing along") {
  // Both rims were found over the last 110 stations, but the lower one is the edge of something 25 px farther out.
  RimCurve upper = rim([](double s) { return bow(s) - 90 + (s > 1090 ? 25.0 : 0.0); });
  RimCurve lower = rim([](double s) { return bow(s) + 90; });
  for (CurveSample& s : upper)
    if (s.station_px > 1090) s.weight = 0.4;
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(lower, 1095, 1200) < 0.05);
  CHECK(trust(upper, 1095, 1200) < 0.05);  // nobody can tell which of the two is wrong
  CHECK(trust(lower, 0, 1080) > 0.95);
}

TEST_CASE("rim agreement: what a pair says holds for the neighbours without a partner") {
  RimCurve upper = rim([](double s) { return bow(s) - 90; }),
           lower = rim([](double s) { return bow(s) + 90 + (s > 700 && s < 760 ? 12.0 : 0.0); });
  std::erase_if(upper, [](const CurveSample& s) { return s.station_px > 720 && s.station_px < 745; });
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(lower, 722, 743) < 0.05);
}

TEST_CASE("rim agreement: a rim that leans without its partner is the edge of something else") {
  const auto leaning = [](double s) { return bow(s) - 90 + (s > 300 && s < 340 ? 3.0 + 0.2 * (s - 300) : 0.0); };
  RimCurve upper = rim(leaning), lower = rim([](double s) { return bow(s) + 90; });
  std::erase_if(lower, [](const CurveSample& s) { return s.station_px > 280 && s.station_px < 360; });
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(upper, 312, 330) < 0.05);
  CHECK(trust(upper, 400, 1200) > 0.95);
}

TEST_CASE("rim agreement: a weak edge has no say over a clear rim") {
  RimCurve upper = rim([](double s) { return bow(s) - 90; }),
           lower = rim([](double s) { return bow(s) + 90 - (s > 900 ? 20.0 : 0.0); });
  for (CurveSample& s : lower)
    if (s.station_px > 900) s.weight = 0.01;
  reject_disagreement(upper, lower, FilterConfig{});
  CHECK(trust(upper, 900, 1200) > 0.95);
}

}  // namespace imprint
