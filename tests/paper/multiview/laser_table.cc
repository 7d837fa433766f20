#include "tests/paper/multiview/laser_table.h"

#include <array>
#include <random>
#include <string>
#include <utility>

#include <fmt/core.h>

#include "fusion/comparison/comparison.h"
#include "tests/paper/multiview/corruption.h"
#include "tests/unit/fusion/comparison/laser_scan.h"

namespace imprint::test {
namespace {

constexpr std::size_t kObservations = 12;

/// A row of the table: the columns of [D] table 1, and the RMS difference.
struct Row {
  Agreement axis, diameter, circularity;
  int count = 0;

  // The forgings' sections are as many, so that means over the forgings are means over all sections; of the medians it
  // is the mean that is printed.
  void add(const Comparison& c) {
    for (auto [sum, one] : {std::pair{&axis, &c.axis}, {&diameter, &c.diameter}, {&circularity, &c.circularity}}) {
      sum->overlap += one->overlap;
      sum->mean_mm += one->mean_mm;
      sum->median_mm += one->median_mm;
      sum->rms_mm += one->rms_mm;
    }
    ++count;
  }
};

void print(const std::string& name, const Row& row) {
  fmt::print("  {:<34} |", name);
  for (const Agreement* a : {&row.axis, &row.diameter, &row.circularity})
    fmt::print(" {:>8.2f} {:>+8.4f} {:>+8.4f} {:>8.4f} |", 100.0 * a->overlap / row.count, a->mean_mm / row.count,
               a->median_mm / row.count, a->rms_mm / row.count);
  fmt::print("\n");
}

}  // namespace

Result<void> print_laser_table(int forgings, unsigned seed, const OutOfRound& out_of_round) {
  // Paper D's own two clouds were registered by spheres, to better than 1 mm.
  const LaserScan exact{}, registered{.registration_mm = 0.5};
  Row joint, joint_registered, thesis;
  for (int i = 0; i < forgings; ++i) {
    const unsigned own = seed + 2000 + static_cast<unsigned>(i);
    const Rod rod = forging(out_of_round, own);
    std::mt19937 generator(own + 500);
    const Session session =
        corrupted(observe(rod, {.observations = static_cast<int>(kObservations), .seed = own}), {}, generator);
    const auto all = reconstruct(session);
    if (!all) return pass_on(all.error());
    const auto by_joint = measurement_of(session, *all, kObservations, Estimator::joint);
    if (!by_joint) return pass_on(by_joint.error());
    const auto by_thesis = measurement_of(session, *all, kObservations, Estimator::thesis);
    if (!by_thesis) return pass_on(by_thesis.error());
    // The scanners have a world of their own: the comparison finds where the cloud belongs.
    const Lying elsewhere = displaced(turned({}, 137.0), generator, 500.0, 5.0);
    const auto add = [&](Row& row, const Measurement& measured, const LaserScan& scan) -> Result<void> {
      const auto compared = compare(measured, scanned(rod, elsewhere, scan, own), {});
      if (!compared) return pass_on(compared.error());
      row.add(*compared);
      return {};
    };
    for (const auto& done :
         {add(joint, *by_joint, exact), add(joint_registered, *by_joint, registered), add(thesis, *by_thesis, exact)})
      if (!done) return done;
  }
  fmt::print(
      "\n[D] table 1: {} observations less a laser scan of points 3 mm apart with 2 mm of noise, {} forgings: overlap "
      "of the 95 % intervals in %,\nmean, median and RMS difference in mm\n  {:<34} | {:^35} | {:^35} | {:^35} |\n",
      kObservations, forgings, "", "axis deflection", "diameter", "circularity");
  fmt::print("  {:<34} |", "[D]");
  for (const auto& [overlap, mean, median] :
       {std::array{98.47, -0.0402, 0.0043}, {50.27, -0.5027, -0.7755}, {51.20, 0.9041, 0.0720}})
    fmt::print(" {:>8.2f} {:>+8.4f} {:>+8.4f} {:>8} |", overlap, mean, median, "-");
  fmt::print("\n");
  print("thesis", thesis);
  print("joint", joint);
  print("joint, scanners registered to 0.5", joint_registered);
  return {};
}

}  // namespace imprint::test
