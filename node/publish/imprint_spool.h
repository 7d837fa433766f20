#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "lib/config/file_lock.h"
#include "lib/result/result.h"

namespace imprint {

/// What an imprint is known by between node and fusion.
struct ImprintNumber {
  std::uint64_t boot_id = 0;
  std::uint64_t sequence = 0;
  bool operator==(const ImprintNumber&) const = default;
};

/// The imprints that fusion has not yet said to have on its disk: a file each, oldest first, so that a node that is
/// killed or loses power at any moment finds all of them again. Bounded: when there is no room left the oldest end,
/// and are counted. What the disk does not take (full, broken) is kept in memory and written later.
/// Knows nothing of Zenoh; one thread at a time.
class ImprintSpool {
 public:
  struct Entry {
    std::uint64_t place = 0;  ///< order of arrival, over all starts of the node
    ImprintNumber number;
    std::size_t size = 0;
    std::vector<std::uint8_t> in_memory;  ///< not on disk; else empty
  };

  /// Takes up what an earlier start has left in `folder` (made when it is not there; empty: in memory alone). Fails
  /// (invalid_input) when the folder cannot be used or another node uses it. Files that a kill left half-written, and
  /// what is no imprint, are removed.
  static Result<ImprintSpool> open(const std::filesystem::path& folder, std::size_t max_bytes);

  /// Keeps one more, on disk when this returns without a `fault()`.
  void add(ImprintNumber number, std::span<const std::uint8_t> bytes);
  /// False when there is no such imprint (any more).
  bool remove(ImprintNumber number);
  /// None when the file has gone or is damaged; the entry is removed then.
  std::optional<std::vector<std::uint8_t>> read(ImprintNumber number);
  /// Tries again to write what is only in memory.
  void write_pending();

  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }  ///< the oldest first
  [[nodiscard]] std::size_t bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t discarded() const { return discarded_; }
  /// Why the last one could not be written; empty when it was.
  [[nodiscard]] const std::string& fault() const { return fault_; }

 private:
  ImprintSpool(std::filesystem::path folder, std::optional<FileLock> lock, std::size_t max_bytes)
      : folder_(std::move(folder)), lock_(std::move(lock)), max_bytes_(max_bytes) {}

  void take_up();
  void make_room(std::size_t wanted);
  void write(Entry& entry, std::span<const std::uint8_t> bytes);
  void erase(std::vector<Entry>::iterator entry);
  [[nodiscard]] std::vector<Entry>::iterator find(ImprintNumber number);
  [[nodiscard]] std::filesystem::path file_of(const Entry& entry) const;

  std::filesystem::path folder_;
  std::optional<FileLock> lock_;
  std::size_t max_bytes_;
  std::vector<Entry> entries_;
  std::uint64_t next_place_ = 1;
  std::size_t bytes_ = 0;
  std::size_t bytes_in_memory_ = 0;
  std::uint64_t discarded_ = 0;
  std::string fault_;
};

}  // namespace imprint
