#include "node/detect/decode_ring.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "lib/targets/code_distance.h"
#include "node/detect/ring_evidence.h"
#include "node/detect/ring_light.h"

namespace imprint {
namespace {

constexpr double black_sigma = 0.06;        // unevenness of the ground, in units of the dot's contrast, ours
constexpr double white_sigma = 0.12;        // unevenness of paint and light, in shares of a white bit's reading, ours
constexpr double cover_probability = 0.05;  // that a bit shows something else, ours
constexpr double cover_density = 0.4;       // of a reading that may be anything from -0.5 to 2
constexpr double known_limit = 0.35;        // of the bit's contrast: a reading farther off is neither colour
constexpr double max_profile =
    0.15;  // rms of the columns; spots of a texture have no edges where a code has them, ours
// Bits that are amiss each for itself, by their likelihood: more, and no cover explains the ring.
constexpr double hopeless = 32.0;
constexpr double max_step =
    0.1;  // bits reach from the ring's inner edge to its outer one, letters and pads do not, ours
constexpr double max_fit = 0.15;  // rms of the known bits; rings in clutter have levels at random

double log_likelihood(double reading, double expected, double sigma) {
  if (std::isnan(reading)) return std::log(cover_probability * cover_density);
  const double z = (reading - expected) / sigma;
  const double normal = std::exp(-0.5 * z * z) / (sigma * std::sqrt(2.0 * std::numbers::pi));
  return std::log((1.0 - cover_probability) * normal + cover_probability * cover_density);
}

double log_likelihood(const RingScan& scan, std::size_t bit, int before, int own, int after) {
  const double expected = scan.response[bit].reading(before, own, after);
  return log_likelihood(scan.reading[bit], expected, std::hypot(black_sigma, white_sigma * expected, scan.noise));
}

/// Of a ring that reads as its code says.
double perfect_likelihood(const RingScan& scan) {
  const double sigma = std::hypot(0.5 * (black_sigma + white_sigma), scan.noise);
  return static_cast<double>(scan.reading.size()) * log_likelihood(0.0, 0.0, sigma);
}

double bit_contrast(const RingScan& scan, std::size_t bit) {
  return std::max(scan.response[bit].light * scan.response[bit].own, 0.1);
}

/// Outer rows less inner rows, over the middle of the bit, besides what the dot lends them, by the bit's own light.
/// Where blur takes much of the ring's width, as in a ring seen from its edge, the step counts less.
double unexpected_step(const RingScan& scan, std::size_t bit) {
  constexpr int left_out = columns_per_bit / 6;
  const auto begin = scan.steps.begin() + static_cast<std::ptrdiff_t>(bit * columns_per_bit);
  const double step =
      std::accumulate(begin + left_out, begin + columns_per_bit - left_out, 0.0) / (columns_per_bit - 2 * left_out);
  const BitResponse& response = scan.response[bit];
  constexpr double blurred = 0.6;  // share of a white bit's light on the scanned rows
  constexpr double sharp = 0.9;
  const double weight = std::clamp((response.radial - blurred) / (sharp - blurred), 0.0, 1.0);
  return weight * (step - response.step) / std::max(1.0, response.light);
}

/// Mean of the middle half of a bit's columns.
double middle_of(const std::vector<double>& columns, std::size_t bit) {
  constexpr int left_out = columns_per_bit / 4;
  const auto begin = columns.begin() + static_cast<std::ptrdiff_t>(bit * columns_per_bit);
  return std::accumulate(begin + left_out, begin + columns_per_bit - left_out, 0.0) / (columns_per_bit - 2 * left_out);
}

/// Whether at least half the bits reach over the whole width of the ring, or leave all of it dark: what covers do not
/// hide of a ring does, letters and pads do not.
bool is_even_across(const RingScan& scan) {
  std::vector<double> steps;
  for (std::size_t bit = 0; bit < scan.reading.size(); ++bit) {
    const double step = std::abs(unexpected_step(scan, bit));
    if (!std::isnan(step)) steps.push_back(step);
  }
  if (steps.empty()) return true;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle < std::hypot(max_step, 3.0 * scan.noise);
}

/// What the code has the bit's reading be; `flipped`: were the bit of the other colour.
double expected_reading(const RingScan& scan, std::uint32_t code, int bit, bool flipped) {
  const int bits = static_cast<int>(scan.reading.size());
  const int own = bit_at(code, bits, bit);
  return scan.response[static_cast<std::size_t>(bit)].reading(bit_at(code, bits, bit - 1), flipped ? 1 - own : own,
                                                              bit_at(code, bits, bit + 1));
}

/// Whether the bit shows the colour that the code has there.
bool is_known(const RingScan& scan, std::uint32_t code, int bit) {
  const auto at = static_cast<std::size_t>(bit);
  const double off = std::abs(scan.reading[at] - expected_reading(scan, code, bit, false));
  return off <= known_limit * bit_contrast(scan, at) + 2.0 * scan.noise;
}

/// Log likelihood of stretches of a code, so that a whole code costs few look-ups: each stretch of five bits depends
/// on those and their two neighbours.
class StretchTables {
 public:
  StretchTables(const RingScan& scan, int bits) : bits_(bits) {
    for (int first = 0; first < bits; first += stretch) {
      const int length = std::min(stretch, bits - first);
      std::vector<double> table(std::size_t{1} << (length + 2));
      for (std::size_t pattern = 0; pattern < table.size(); ++pattern) {
        for (int i = 0; i < length; ++i) {
          const auto bit = [&](int k) { return static_cast<int>((pattern >> (length + 1 - k)) & 1U); };
          const auto at = static_cast<std::size_t>(first) + static_cast<std::size_t>(i);
          table[pattern] += log_likelihood(scan, at, bit(i), bit(i + 1), bit(i + 2));
        }
      }
      tables_.push_back(std::move(table));
    }
  }

  [[nodiscard]] double of(std::uint32_t code) const {
    // The ring unrolled with its last bit before and its first bit after.
    const std::uint64_t last = code & 1U;
    const std::uint64_t first = (code >> (bits_ - 1)) & 1U;
    const std::uint64_t unrolled = (last << (bits_ + 1)) | (static_cast<std::uint64_t>(code) << 1U) | first;
    double sum = 0.0;
    for (std::size_t t = 0; t < tables_.size(); ++t) {
      const int begin = static_cast<int>(t) * stretch;
      const int length = std::min(stretch, bits_ - begin);
      const int shift = bits_ - begin - length;
      sum += tables_[t][(unrolled >> shift) & ((std::uint64_t{1} << (length + 2)) - 1)];
    }
    return sum;
  }

 private:
  static constexpr int stretch = 5;
  int bits_;
  std::vector<std::vector<double>> tables_;
};

/// Has the light be that of the ring's white bits; false when they do not tell it.
bool fit_light(RingScan& scan, std::uint32_t code) {
  const auto light = light_on_ring(scan, code);
  // The paint of dot and ring is one: where the ring as a whole were darker, it would be another thing's.
  constexpr double most_level = 0.7;  // logarithm
  if (!light || std::abs(std::log(light->level)) > most_level) return false;
  set_light(scan, light->slope, light->level);
  return true;
}

}  // namespace

bool is_open(const RingScan& scan, std::uint32_t code) {
  const int bits = static_cast<int>(scan.reading.size());
  int white = 0;
  int open = 0;
  for (int bit = 0; bit < bits; ++bit) {
    const auto at = static_cast<std::size_t>(bit);
    const BitResponse& response = scan.response[at];
    const auto goes_on = [&](const std::vector<double>& columns, double expected) {
      const double half_way = 0.5 * (response.radial + expected) * response.light;
      return middle_of(columns, at) > half_way + 2.0 * scan.noise;
    };
    if (bit_at(code, bits, bit) == 0 || std::isnan(middle_of(scan.outside, at))) continue;
    ++white;
    if (goes_on(scan.inside, response.inside) || goes_on(scan.outside, response.outside)) ++open;
  }
  return 2 * open > white;
}

RingDecoder::RingDecoder(const TargetLibrary& library, double max_unknown)
    : bits_(library.bits),
      max_unknown_(max_unknown),
      min_distance_(smallest_distance(library.codes, library.bits)),
      codes_(library.codes) {
  least_white_ = bits_;
  for (const TargetCode& code : codes_) {
    least_white_ = std::min(least_white_, std::popcount(code.code));
  }
  const int correctable = (min_distance_ - 1) / 2;
  least_white_ = std::max(0, least_white_ - correctable);
}

struct RingDecoder::Match {
  double log_likelihood = -std::numeric_limits<double>::max();
  std::size_t code = 0;      // index
  std::uint32_t turned = 0;  // the code from the scan's first bit on
};

/// Where the bits begin was read off a ring with all that covers it: the code tells it better. Whether it moved.
bool RingDecoder::turn_to_fit(RingScan& scan, const DecodedRing& ring) {
  constexpr int most = columns_per_bit / 4;
  int best = 0;
  double least = ring.cost;
  RingEvidence evidence(scan);
  for (int columns = -most; columns <= most; ++columns) {
    evidence.turn(columns);
    const double cost = evidence.explain(ring.code).cost;
    if (cost >= least) continue;
    least = cost;
    best = columns;
  }
  if (best != 0) scan = turned(scan, best);
  return best != 0;
}

DecodedRing RingDecoder::decode(RingScan& scan) const {
  DecodedRing ring = decode_once(scan);
  if (ring.cost < hopeless && turn_to_fit(scan, ring)) ring = decode_once(scan);
  constexpr int rounds = 2;
  constexpr double even_enough = 0.05;
  for (int round = 0; round < rounds && (!ring.accepted || ring.profile > even_enough); ++round) {
    RingScan relit = scan;
    if (!fit_light(relit, ring.code)) break;
    const DecodedRing next = decode_once(relit);
    const bool better = next.unknown < ring.unknown || (next.unknown == ring.unknown && next.profile < ring.profile);
    if (next.wrong > 0 || !better || (ring.accepted && !next.accepted))
      break;  // a light of one's own choice explains enough
    ring = next;
    scan = std::move(relit);
  }
  return ring;
}

DecodedRing RingDecoder::decode_plainly(const RingScan& scan) const {
  DecodedRing ring;
  for (int i = 0; i < bits_; ++i)
    ring.code = ring.code << 1U | (scan.reading[static_cast<std::size_t>(i)] > 0.5 ? 1U : 0U);
  const auto known = std::find_if(codes_.begin(), codes_.end(), [&](const TargetCode& code) {
    return smallest_rotation(code.code, bits_) == smallest_rotation(ring.code, bits_);
  });
  ring.lead = std::numeric_limits<double>::infinity();
  ring.accepted = known != codes_.end();
  if (ring.accepted) ring.id = known->id;
  return ring;
}

/// The colours that the bits show each for itself, without those that may be either: two masks, the first bit highest.
struct PlainBits {
  std::uint32_t white = 0;
  std::uint32_t clear = 0;
};

PlainBits plain_bits(const RingScan& scan) {
  PlainBits bits;
  for (std::size_t i = 0; i < scan.reading.size(); ++i) {
    const double share = (scan.reading[i] - scan.response[i].floor) / std::max(0.1, scan.response[i].light);
    constexpr double black = 0.3;
    constexpr double white = 0.7;
    bits.white = bits.white << 1U | (share > white ? 1U : 0U);
    bits.clear = bits.clear << 1U | (share < black || share > white ? 1U : 0U);
  }
  return bits;
}

/// Codes and turns that two covers at most could reconcile with what the bits show, the likeliest first.
std::vector<RingDecoder::Match> RingDecoder::likeliest(const RingScan& scan) const {
  const StretchTables tables(scan, bits_);
  const PlainBits seen = plain_bits(scan);
  constexpr int most_covers = 2;
  constexpr std::size_t kept = 80;
  std::vector<Match> matches;
  for (std::size_t i = 0; i < codes_.size(); ++i) {
    for (int k = 0; k < bits_; ++k) {
      const std::uint32_t turned = rotated(codes_[i].code, bits_, k);
      const std::uint32_t amiss = (turned ^ seen.white) & seen.clear;
      const int stretches = std::popcount(amiss & ~rotated(amiss, bits_, 1));
      if (stretches > most_covers || std::popcount(amiss) > bits_ / 2 + 1) continue;
      matches.push_back({tables.of(turned), i, turned});
    }
  }
  const auto likelier = [](const Match& a, const Match& b) {
    return a.log_likelihood != b.log_likelihood ? a.log_likelihood > b.log_likelihood : a.turned < b.turned;
  };
  const auto end = matches.begin() + static_cast<std::ptrdiff_t>(std::min(kept, matches.size()));
  std::partial_sort(matches.begin(), end, matches.end(), likelier);
  matches.erase(end, matches.end());
  return matches;
}

/// The code that explains the ring best, covers allowed, and its lead over the next id.
DecodedRing RingDecoder::decode_once(const RingScan& scan) const {
  const std::vector<Match> matches = likeliest(scan);
  DecodedRing ring;
  ring.cost = std::numeric_limits<double>::max();
  if (matches.empty()) return ring;
  ring.id = codes_[matches.front().code].id;
  ring.code = matches.front().turned;
  if (perfect_likelihood(scan) - matches.front().log_likelihood < hopeless && is_even_across(scan)) {
    const RingEvidence evidence(scan);
    std::vector<double> best_of_code(codes_.size(), std::numeric_limits<double>::max());
    std::size_t best_code = 0;
    for (const Match& match : matches) {
      const RingExplanation explanation = evidence.explain(match.turned);
      best_of_code[match.code] = std::min(best_of_code[match.code], explanation.cost);
      if (explanation.cost >= ring.cost) continue;
      best_code = match.code;
      ring.id = codes_[match.code].id;
      ring.code = match.turned;
      ring.cost = explanation.cost;
      ring.covered = explanation.covered;
    }
    best_of_code[best_code] = std::numeric_limits<double>::max();
    ring.margin = *std::min_element(best_of_code.begin(), best_of_code.end()) - ring.cost;
  }
  compare_bits(scan, ring);
  compare_profile(scan, ring);
  constexpr double most_cost = 13.5;  // a cover over a few bits costs 9 to 11; what texture feigns costs more, ours
  ring.lead = std::min(ring.margin - least_margin(ring), most_cost - ring.cost);
  ring.accepted = ring.lead > 0.0 && ring.covered < max_unknown_ && ring.fit < max_fit && ring.profile < max_profile &&
                  ring.step < max_step && !is_open(scan, ring.code);
  return ring;
}

void RingDecoder::compare_bits(const RingScan& scan, DecodedRing& ring) const {
  double sum = 0.0;
  int known = 0;
  for (int i = 0; i < bits_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double contrast = bit_contrast(scan, at);
    const double off = std::abs(scan.reading[at] - expected_reading(scan, ring.code, i, false));
    const double other = std::abs(scan.reading[at] - expected_reading(scan, ring.code, i, true));
    if (is_known(scan, ring.code, i)) {
      sum += off * off / std::max(0.25, contrast * contrast);
      ++known;
    } else if (other <= known_limit * contrast + 2.0 * scan.noise) {
      ++ring.wrong;
    } else {
      ++ring.unknown;
    }
  }
  ring.distance = ring.wrong + 0.5 * ring.unknown;
  ring.fit = known > 0 ? std::sqrt(std::max(0.0, sum / known - scan.noise * scan.noise)) : 1.0;
}

/// Over the bits that show the code's colour; a column counts as no farther off than half the contrast (dirt).
void RingDecoder::compare_profile(const RingScan& scan, DecodedRing& ring) const {
  double sum = 0.0;
  double steps = 0.0;
  int count = 0;
  for (int i = 0; i < bits_; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const int before = bit_at(ring.code, bits_, i - 1);
    const int own = bit_at(ring.code, bits_, i);
    const int after = bit_at(ring.code, bits_, i + 1);
    if (!is_known(scan, ring.code, i)) continue;
    const double step = unexpected_step(scan, at);
    if (!std::isnan(step)) steps += step * step / bits_;
    for (int k = 0; k < columns_per_bit; ++k) {
      const double column = scan.columns[at * columns_per_bit + static_cast<std::size_t>(k)];
      if (std::isnan(column)) continue;
      const double offset = (k + 0.5) / columns_per_bit - 0.5;
      const double off = std::min(0.5, std::abs(column - scan.response[at].column_reading(offset, before, own, after)));
      sum += off * off;
      ++count;
    }
  }
  // A step's variance is four times a reading's; of fifteen squares twice the mean is rarely passed.
  ring.step = std::sqrt(std::max(0.0, steps - 12.0 * scan.noise * scan.noise));
  const double column_noise = scan.noise * std::sqrt(static_cast<double>(columns_per_bit));
  ring.profile = count == 0 ? 1.0 : std::sqrt(std::max(0.0, sum / count - std::min(0.15, column_noise * column_noise)));
}

double RingDecoder::least_margin(const DecodedRing& ring) const {
  constexpr double of_uncovered = 3.5;
  // A ring that is covered in part may be another one, covered elsewhere: the lead over the next id has to be larger.
  constexpr double of_covered = 6.0;
  // One bit that shows the wrong colour is nearer to this code than to any other, whatever could be covered.
  constexpr double of_one_bit = 1.0;
  if (ring.covered == 0.0) return of_uncovered;
  const bool one_bit = ring.wrong == 1 && ring.unknown == 0 && min_distance_ >= 3 && ring.covered * bits_ < 1.4;
  return one_bit ? of_one_bit : of_covered;
}

}  // namespace imprint
