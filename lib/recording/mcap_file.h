#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "lib/result/result.h"

namespace imprint {

/// Writes MCAP (mcap.dev/spec), a log of messages on topics that Foxglove and others read: one record after the other,
/// without chunks or index, so that a recording that is cut off is whole up to the cut. Messages are protobuf.
class McapWriter {
 public:
  /// Writes to `<path>.part`; `close` gives the file its name. Fails (invalid_input) when that cannot be made.
  static Result<McapWriter> open(const std::filesystem::path& path);

  /// Messages of one topic have one schema: `schema` is its name, `description` its FileDescriptorSet. Times in ns
  /// since the Unix epoch. Fails (job_failed) when the disk does not take it.
  Result<void> write(const std::string& topic, const std::string& schema, std::string_view description,
                     std::int64_t time_ns, std::span<const std::uint8_t> bytes);
  Result<void> close();

 private:
  explicit McapWriter(std::filesystem::path path) : path_(std::move(path)) {}
  Result<void> put(std::uint8_t opcode, const std::string& content);
  [[nodiscard]] Error failure() const;

  std::filesystem::path path_;
  std::ofstream file_;
  std::map<std::string, std::uint16_t> schemas_;
  std::map<std::string, std::uint16_t> channels_;
  std::uint32_t sequence_ = 0;
};

struct McapMessage {
  std::string topic;
  std::string schema;
  std::int64_t time_ns = 0;
  std::vector<std::uint8_t> bytes;
};

struct McapContent {
  std::vector<McapMessage> messages;
  bool cut_off = false;  ///< the file ends in the middle of a record, or without its end
};

/// Every message of a file as `McapWriter` makes it, in its order. Fails (invalid_input) on what is no MCAP file, has
/// chunks, or contradicts itself; never throws, and takes no more memory than the file is long.
Result<McapContent> read_mcap(const std::filesystem::path& path);

}  // namespace imprint
