#include "node/capture/image_header.h"

#include <array>
#include <optional>
#include <vector>

namespace imprint {
namespace {

constexpr std::string_view png_signature{"\x89PNG\r\n\x1a\n", 8};

/// Unsigned integers of a byte string in either byte order; nothing where the bytes end first.
class ByteReader {
 public:
  ByteReader(std::string_view bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  [[nodiscard]] std::optional<std::uint64_t> integer(std::uint64_t offset, std::uint64_t size) const {
    if (size > bytes_.size() || offset > bytes_.size() - size) return std::nullopt;
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < size; ++i) {
      const std::uint64_t at = big_endian_ ? offset + i : offset + size - 1 - i;
      value = (value << 8U) | static_cast<unsigned char>(bytes_[at]);
    }
    return value;
  }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

Result<ImageHeader> check_png(std::string_view bytes, const std::string& source) {
  const ByteReader reader(bytes, true);
  const auto width = reader.integer(16, 4);
  const auto height = reader.integer(20, 4);
  if (!width || !height || bytes.substr(12, 4) != "IHDR") {
    return invalid_input("{}: truncated PNG: expected a header of 33 bytes, found a file of {}", source, bytes.size());
  }
  std::uint64_t offset = png_signature.size();
  while (true) {
    const auto length = reader.integer(offset, 4);
    const std::uint64_t next = offset + 12 + length.value_or(0);
    if (!length || next > bytes.size()) {
      return invalid_input("{}: truncated PNG: expected a last chunk IEND, the file ends after {} bytes; copy it again",
                           source, bytes.size());
    }
    if (bytes.substr(offset + 4, 4) == "IEND") break;
    offset = next;
  }
  return ImageHeader{static_cast<std::int64_t>(*width), static_cast<std::int64_t>(*height)};
}

/// Field sizes of the classic TIFF and of BigTIFF.
struct TiffLayout {
  std::uint64_t first_directory_at, count_size, entry_size, value_size;
};

class TiffDirectory {
 public:
  static std::optional<TiffDirectory> open(std::string_view bytes) {
    TiffDirectory directory{ByteReader(bytes, bytes[0] == 'M')};
    directory.layout_ =
        directory.reader_.integer(2, 2) == std::uint64_t{43} ? TiffLayout{8, 8, 20, 8} : TiffLayout{4, 2, 12, 4};
    const auto offset = directory.reader_.integer(directory.layout_.first_directory_at, directory.layout_.value_size);
    if (!offset) return std::nullopt;
    const auto entries = directory.reader_.integer(*offset, directory.layout_.count_size);
    if (!entries || *entries > bytes.size() / directory.layout_.entry_size) return std::nullopt;
    directory.entries_at_ = *offset + directory.layout_.count_size;
    directory.entries_ = *entries;
    const std::uint64_t next_directory_at = directory.entries_at_ + *entries * directory.layout_.entry_size;
    if (!directory.reader_.integer(next_directory_at, directory.layout_.value_size)) return std::nullopt;
    return directory;
  }

  /// The integers of a tag: empty when the tag is absent, nothing when the file ends before them.
  [[nodiscard]] std::optional<std::vector<std::uint64_t>> values(std::uint64_t tag) const {
    for (std::uint64_t i = 0; i < entries_; ++i) {
      const std::uint64_t entry = entries_at_ + i * layout_.entry_size;
      if (reader_.integer(entry, 2) == tag) return entry_values(entry);
    }
    return std::vector<std::uint64_t>{};
  }

 private:
  explicit TiffDirectory(ByteReader reader) : reader_(reader) {}

  [[nodiscard]] std::optional<std::vector<std::uint64_t>> entry_values(std::uint64_t entry) const {
    const std::uint64_t type = reader_.integer(entry + 2, 2).value_or(0);
    const std::uint64_t size = type == 1 ? 1 : type == 3 ? 2 : type == 4 ? 4 : type == 16 ? 8 : 0;
    const std::uint64_t count = reader_.integer(entry + 4, layout_.value_size).value_or(0);
    if (size == 0 || count > (std::uint64_t{1} << 32U)) return std::nullopt;
    std::uint64_t at = entry + 4 + layout_.value_size;
    if (count * size > layout_.value_size) at = reader_.integer(at, layout_.value_size).value_or(~std::uint64_t{0});
    std::vector<std::uint64_t> result;
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto value = reader_.integer(at + i * size, size);
      if (!value) return std::nullopt;
      result.push_back(*value);
    }
    return result;
  }

  ByteReader reader_;
  TiffLayout layout_{};
  std::uint64_t entries_at_ = 0;
  std::uint64_t entries_ = 0;
};

enum TiffTag : std::uint64_t {
  tiff_width = 256,
  tiff_height = 257,
  tiff_strip_offsets = 273,
  tiff_strip_sizes = 279,
  tiff_tile_offsets = 324,
  tiff_tile_sizes = 325,
};

Result<ImageHeader> check_tiff(std::string_view bytes, const std::string& source) {
  const auto truncated = [&] {
    return invalid_input("{}: truncated TIFF: its directory points past the end of its {} bytes; copy it again", source,
                         bytes.size());
  };
  const auto directory = TiffDirectory::open(bytes);
  if (!directory) return truncated();
  const auto width = directory->values(tiff_width);
  const auto height = directory->values(tiff_height);
  if (!width || !height) return truncated();
  if (width->size() != 1 || height->size() != 1) {
    return invalid_input("{}: expected a TIFF that states width and height, found none", source);
  }
  bool any = false;
  for (const auto& [offset_tag, size_tag] :
       {std::pair{tiff_strip_offsets, tiff_strip_sizes}, std::pair{tiff_tile_offsets, tiff_tile_sizes}}) {
    const auto offsets = directory->values(offset_tag);
    const auto sizes = directory->values(size_tag);
    if (!offsets || !sizes) return truncated();
    for (std::size_t i = 0; i < offsets->size(); ++i) {
      const std::uint64_t size = i < sizes->size() ? (*sizes)[i] : 1;
      if (size > bytes.size() || (*offsets)[i] > bytes.size() - size) return truncated();
      any = true;
    }
  }
  if (!any) return invalid_input("{}: expected a TIFF with strips or tiles, found no pixels", source);
  return ImageHeader{static_cast<std::int64_t>(width->front()), static_cast<std::int64_t>(height->front())};
}

bool is_tiff(std::string_view bytes) {
  using namespace std::string_view_literals;
  const std::string_view magic = bytes.substr(0, 4);
  return magic == "II*\0"sv || magic == "MM\0*"sv || magic == "II+\0"sv || magic == "MM\0+"sv;
}

}  // namespace

Result<ImageHeader> check_image_bytes(std::string_view bytes, const std::string& source) {
  if (bytes.empty()) return invalid_input("{}: expected a PNG or TIFF image, found an empty file", source);
  if (bytes.starts_with(png_signature)) return check_png(bytes, source);
  if (is_tiff(bytes)) return check_tiff(bytes, source);
  return invalid_input("{}: expected a PNG or TIFF image, found a file of another kind", source);
}

}  // namespace imprint
