#include "fusion/comparison/point_cloud.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

using Points = std::vector<Eigen::Vector3d>;

/// The next line of `text` from `at` on, without its end; moves `at` behind it.
std::string_view next_line(std::string_view text, std::size_t& at) {
  const std::size_t end = std::min(text.find('\n', at), text.size());
  std::string_view line = text.substr(at, end - at);
  at = std::min(end + 1, text.size());
  if (line.ends_with('\r')) line.remove_suffix(1);
  return line;
}

/// The words of a line, parted by blanks, tabs, commas and semicolons.
std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kGaps = " \t,;";
  std::vector<std::string_view> words;
  std::size_t at = line.find_first_not_of(kGaps);
  while (at != std::string_view::npos) {
    const std::size_t end = std::min(line.find_first_of(kGaps, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = line.find_first_not_of(kGaps, end);
  }
  return words;
}

std::optional<double> number_of(std::string_view word) {
  double value = 0.0;
  const auto [end, fault] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (fault != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

void add(Points& points, const Eigen::Vector3d& point) {
  if (point.allFinite()) points.push_back(point);
}

enum class Kind { i8, u8, i16, u16, i32, u32, f32, f64 };

std::optional<Kind> kind_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Kind>, 16> kNames{{{"char", Kind::i8},
                                                                      {"int8", Kind::i8},
                                                                      {"uchar", Kind::u8},
                                                                      {"uint8", Kind::u8},
                                                                      {"short", Kind::i16},
                                                                      {"int16", Kind::i16},
                                                                      {"ushort", Kind::u16},
                                                                      {"uint16", Kind::u16},
                                                                      {"int", Kind::i32},
                                                                      {"int32", Kind::i32},
                                                                      {"uint", Kind::u32},
                                                                      {"uint32", Kind::u32},
                                                                      {"float", Kind::f32},
                                                                      {"float32", Kind::f32},
                                                                      {"double", Kind::f64},
                                                                      {"float64", Kind::f64}}};
  for (const auto& [known, kind] : kNames)
    if (known == name) return kind;
  return std::nullopt;
}

std::size_t size_of(Kind kind) {
  constexpr std::array<std::size_t, 8> kSizes{1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<std::size_t>(kind)];
}

template <typename Number>
double as(const std::array<char, 8>& bytes) {
  Number number{};
  std::memcpy(&number, bytes.data(), sizeof(number));
  return static_cast<double>(number);
}

double value_at(const char* at, Kind kind, bool swap) {
  std::array<char, 8> bytes{};
  std::memcpy(bytes.data(), at, size_of(kind));
  if (swap) std::reverse(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size_of(kind)));
  switch (kind) {
    case Kind::i8:
      return as<std::int8_t>(bytes);
    case Kind::u8:
      return as<std::uint8_t>(bytes);
    case Kind::i16:
      return as<std::int16_t>(bytes);
    case Kind::u16:
      return as<std::uint16_t>(bytes);
    case Kind::i32:
      return as<std::int32_t>(bytes);
    case Kind::u32:
      return as<std::uint32_t>(bytes);
    case Kind::f32:
      return as<float>(bytes);
    case Kind::f64:
      break;
  }
  return as<double>(bytes);
}

struct PlyElement {
  std::string name;
  std::size_t count = 0;
  std::vector<Kind> properties;
  std::array<std::optional<std::size_t>, 3> xyz;  ///< index among the properties
  bool has_list = false;
};

struct PlyHeader {
  enum class Format { none, ascii, little, big } format = Format::none;
  std::vector<PlyElement> elements;  ///< to the vertices
  std::size_t size = 0;              ///< bytes
};

Result<PlyHeader> read_ply_header(const std::filesystem::path& path, std::string_view text) {
  PlyHeader header;
  std::size_t at = 0;
  if (next_line(text, at) != "ply") return invalid_input("{}: expected \"ply\" in the first line", path.string());
  bool ended = false, past = false;  // past the vertices
  for (int number = 2; at < text.size() && !ended; ++number) {
    const auto words = words_of(next_line(text, at));
    const auto wrong = [&] { return invalid_input("{}:{}: not a line of a PLY header", path.string(), number); };
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") {
      ended = true;
    } else if (words[0] == "format") {
      if (words.size() < 2) return wrong();
      header.format = words[1] == "ascii"                  ? PlyHeader::Format::ascii
                      : words[1] == "binary_little_endian" ? PlyHeader::Format::little
                      : words[1] == "binary_big_endian"    ? PlyHeader::Format::big
                                                           : PlyHeader::Format::none;
    } else if (words[0] == "element") {
      const auto count = words.size() == 3 ? number_of(words[2]) : std::nullopt;
      if (!count || !(*count >= 0.0 && *count < 1e10)) return wrong();
      past = !header.elements.empty() && header.elements.back().name == "vertex";
      if (!past) header.elements.push_back({std::string(words[1]), static_cast<std::size_t>(*count), {}, {}, false});
    } else if (words[0] == "property") {
      if (past) continue;
      if (words.size() < 3 || header.elements.empty()) return wrong();
      PlyElement& element = header.elements.back();
      if (words[1] == "list") {
        element.has_list = true;
        continue;
      }
      const auto kind = kind_of(words[1]);
      if (!kind) return wrong();
      constexpr std::string_view kXyz = "xyz";
      if (words[2].size() == 1 && kXyz.find(words[2]) != std::string_view::npos)
        element.xyz[kXyz.find(words[2])] = element.properties.size();
      element.properties.push_back(*kind);
    } else {
      return wrong();
    }
  }
  header.size = at;
  if (!ended || header.format == PlyHeader::Format::none)
    return invalid_input("{}: expected a PLY header with a format that ends with end_header", path.string());
  if (header.elements.empty() || header.elements.back().name != "vertex" ||
      !std::ranges::all_of(header.elements.back().xyz, [](const auto& place) { return place.has_value(); }))
    return invalid_input("{}: expected an element vertex with x, y and z", path.string());
  if (std::ranges::any_of(header.elements, &PlyElement::has_list))
    return invalid_input("{}: lists before or among the vertices are not read", path.string());
  return header;
}

Result<Points> read_ply(const std::filesystem::path& path, std::string_view text, double scale) {
  const auto header = read_ply_header(path, text);
  if (!header) return pass_on(header.error());
  Points points;
  std::size_t at = header->size;
  for (const PlyElement& element : header->elements) {
    const bool is_vertex = &element == &header->elements.back();
    std::size_t row = 0;
    std::vector<std::size_t> offsets;
    for (const Kind kind : element.properties) offsets.push_back(row), row += size_of(kind);
    for (std::size_t i = 0; i < element.count; ++i) {
      Eigen::Vector3d point;
      bool whole = true;
      if (header->format == PlyHeader::Format::ascii) {
        whole = at < text.size();
        const auto words = words_of(next_line(text, at));
        for (std::size_t k = 0; is_vertex && k < 3 && whole; ++k) {
          const auto value = *element.xyz[k] < words.size() ? number_of(words[*element.xyz[k]]) : std::nullopt;
          whole = value.has_value();
          if (whole) point(static_cast<int>(k)) = *value;
        }
      } else {
        whole = row > 0 && at + row <= text.size();
        const bool swap = (header->format == PlyHeader::Format::big) == (std::endian::native == std::endian::little);
        for (std::size_t k = 0; is_vertex && k < 3 && whole; ++k)
          point(static_cast<int>(k)) =
              value_at(text.data() + at + offsets[*element.xyz[k]], element.properties[*element.xyz[k]], swap);
        at += row;
      }
      if (!whole)
        return invalid_input("{}: {} {} of {} is missing or no number", path.string(), element.name, i + 1,
                             element.count);
      if (is_vertex) add(points, scale * point);
    }
  }
  return points;
}

Result<Points> read_xyz(const std::filesystem::path& path, std::string_view text, double scale) {
  Points points;
  std::size_t at = 0;
  for (int number = 1; at < text.size(); ++number) {
    const std::string_view line = next_line(text, at);
    const auto words = words_of(line);
    if (words.empty() || words[0].starts_with('#') || words[0].starts_with("//")) continue;
    std::array<std::optional<double>, 3> xyz;
    for (std::size_t k = 0; k < std::min<std::size_t>(3, words.size()); ++k) xyz[k] = number_of(words[k]);
    if (!xyz[0] || !xyz[1] || !xyz[2]) {
      if (number == 1) continue;  // a header
      return invalid_input("{}:{}: expected three numbers, found \"{}\"", path.string(), number, line.substr(0, 60));
    }
    add(points, scale * Eigen::Vector3d(*xyz[0], *xyz[1], *xyz[2]));
  }
  return points;
}

}  // namespace

Result<Points> read_point_cloud(const std::filesystem::path& path, double scale) {
  std::string ending = path.extension().string();
  std::ranges::transform(ending, ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
  const bool is_ply = ending == ".ply";
  constexpr std::array<std::string_view, 4> kXyz{".xyz", ".txt", ".asc", ".csv"};
  if (!is_ply && std::ranges::find(kXyz, ending) == kXyz.end())
    return invalid_input("{}: expected a point cloud named .ply, .xyz, .txt, .asc or .csv", path.string());
  const auto text = read_file(path);
  if (!text) return pass_on(text.error());
  return is_ply ? read_ply(path, *text, scale) : read_xyz(path, *text, scale);
}

}  // namespace imprint
