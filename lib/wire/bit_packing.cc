#include "lib/wire/bit_packing.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <utility>

namespace imprint {
namespace {

constexpr std::size_t kBlock = 25;
constexpr int kOrders = 3;
constexpr int kOrderBits = 2;
constexpr int kParameterBits = 5;
constexpr int kMaxParameter = 31;

class BitWriter {
 public:
  void put(std::uint64_t bits, int count) {
    for (int i = count - 1; i >= 0; --i) {
      if (used_ == 0) bytes_.push_back('\0');
      if ((bits >> i) & 1U)
        bytes_.back() = static_cast<char>(static_cast<unsigned char>(bytes_.back()) | (0x80U >> used_));
      used_ = (used_ + 1) % 8;
    }
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
  int used_ = 0;  // bits used of the last byte; 0: it is full
};

class BitReader {
 public:
  explicit BitReader(std::string_view bytes) : bytes_(bytes) {}

  /// The next `count` bits; zeros past the end, which `exhausted` then tells.
  std::uint64_t take(int count) {
    std::uint64_t bits = 0;
    for (int i = 0; i < count; ++i, ++position_) {
      const std::size_t byte = position_ / 8;
      const unsigned value = byte < bytes_.size() ? static_cast<unsigned char>(bytes_[byte]) : 0U;
      bits = bits << 1 | ((value >> (7 - position_ % 8)) & 1U);
    }
    return bits;
  }
  [[nodiscard]] bool exhausted() const { return position_ > 8 * bytes_.size(); }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
};

// What comes before value i: the prediction of the three orders.
struct Past {
  std::int64_t last;
  std::int64_t before_last;
};

std::int64_t predict(int order, const Past& past, std::int64_t base) {
  if (order == 0) return base;
  return order == 1 ? past.last : 2 * past.last - past.before_last;
}

std::uint64_t fold(std::int64_t residual) {
  return residual >= 0 ? 2 * static_cast<std::uint64_t>(residual) : 2 * static_cast<std::uint64_t>(-residual) - 1;
}
std::int64_t unfold(std::uint64_t folded) {
  const auto half = static_cast<std::int64_t>(folded >> 1);
  return folded & 1U ? -half - 1 : half;
}

int code_bits(std::uint64_t folded, int k) { return 2 * std::bit_width((folded >> k) + 1) - 1 + k; }

void put_code(BitWriter& writer, std::uint64_t folded, int k) {
  const std::uint64_t q = (folded >> k) + 1;
  const int width = std::bit_width(q);
  writer.put(0, width - 1);
  writer.put(q, width);
  writer.put(folded & ((std::uint64_t{1} << k) - 1), k);
}

struct BlockCode {
  int order = 0;
  int k = 0;
  std::size_t bits = std::numeric_limits<std::size_t>::max();
  std::vector<std::uint64_t> folded;
};

BlockCode cheapest_code(std::span<const std::int32_t> block, Past past, std::int64_t base) {
  BlockCode best;
  for (int order = 0; order < kOrders; ++order) {
    std::vector<std::uint64_t> folded;
    Past running = past;
    for (const std::int64_t value : block) {
      folded.push_back(fold(value - predict(order, running, base)));
      running = {value, running.last};
    }
    for (int k = 0; k <= kMaxParameter; ++k) {
      std::size_t bits = 0;
      for (const auto u : folded) bits += static_cast<std::size_t>(code_bits(u, k));
      if (bits < best.bits) best = {order, k, bits, folded};
    }
  }
  return best;
}

Result<std::uint64_t> take_code(BitReader& reader, int k) {
  int zeros = 0;
  while (reader.take(1) == 0) {
    if (++zeros > 32 || reader.exhausted()) return invalid_input("expected a code of at most 32 leading zero bits");
  }
  const std::uint64_t q = std::uint64_t{1} << zeros | reader.take(zeros);
  return (q - 1) << k | reader.take(k);
}

}  // namespace

std::string pack_values(std::span<const std::int32_t> values, std::int32_t base) {
  BitWriter writer;
  Past past{base, base};
  while (!values.empty()) {
    const auto block = values.first(std::min(kBlock, values.size()));
    const BlockCode code = cheapest_code(block, past, base);
    writer.put(static_cast<std::uint64_t>(code.order), kOrderBits);
    writer.put(static_cast<std::uint64_t>(code.k), kParameterBits);
    for (const auto folded : code.folded) put_code(writer, folded, code.k);
    past = {block.back(), block.size() > 1 ? block[block.size() - 2] : past.last};
    values = values.subspan(block.size());
  }
  return writer.take();
}

Result<std::vector<std::int32_t>> unpack_values(std::string_view bytes, std::size_t count, std::int32_t base) {
  // No value takes less than a bit: bytes that cannot hold `count` are refused before anything is reserved.
  if (8 * bytes.size() < count) return invalid_input("expected {} values, found {} bytes", count, bytes.size());
  std::vector<std::int32_t> values;
  values.reserve(count);
  BitReader reader(bytes);
  Past past{base, base};
  while (values.size() < count) {
    const int order = static_cast<int>(reader.take(kOrderBits));
    const int k = static_cast<int>(reader.take(kParameterBits));
    if (order >= kOrders)
      return invalid_input("value {}: expected prediction order 0, 1 or 2, found {}", values.size(), order);
    const std::size_t end = std::min(count, values.size() + kBlock);
    while (values.size() < end) {
      auto folded = take_code(reader, k);
      if (!folded) return invalid_input("value {}: {}", values.size(), folded.error().message);
      constexpr std::uint64_t kMaxFolded = std::uint64_t{1} << 33;
      const std::int64_t value = predict(order, past, base) + unfold(std::min(*folded, kMaxFolded));
      if (*folded > kMaxFolded || value != static_cast<std::int32_t>(value))
        return invalid_input("value {}: expected 32 bits, found more", values.size());
      values.push_back(static_cast<std::int32_t>(value));
      past = {value, past.last};
    }
    if (reader.exhausted()) return invalid_input("expected {} values, the bytes end after {}", count, values.size());
  }
  return values;
}

}  // namespace imprint
