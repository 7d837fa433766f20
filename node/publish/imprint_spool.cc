#include "node/publish/imprint_spool.h"

#include <algorithm>
#include <cstdio>
#include <string_view>

#include "lib/config/atomic_file.h"
#include "lib/log/log.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxBytesInMemory = 4U << 20U;  // a thousand imprints
constexpr std::string_view kSuffix = ".imprint";

std::string file_name(const ImprintSpool::Entry& entry) {
  return fmt::format("{:016x}-{:016x}-{:016x}{}", entry.place, entry.number.boot_id, entry.number.sequence, kSuffix);
}

// The entry a file's name speaks of; none for other files.
std::optional<ImprintSpool::Entry> entry_of(const std::string& name) {
  ImprintSpool::Entry entry;
  unsigned long long place = 0, boot_id = 0, sequence = 0;
  if (std::sscanf(name.c_str(), "%16llx-%16llx-%16llx", &place, &boot_id, &sequence) != 3) return std::nullopt;
  entry.place = place;
  entry.number = {boot_id, sequence};
  return file_name(entry) == name ? std::optional(entry) : std::nullopt;
}

std::span<const std::uint8_t> bytes_of(const std::string& text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

}  // namespace

Result<ImprintSpool> ImprintSpool::open(const std::filesystem::path& folder, std::size_t max_bytes) {
  if (folder.empty()) return ImprintSpool({}, std::nullopt, max_bytes);
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return invalid_input("{}: cannot be made: {}", folder.string(), error.message());
  auto lock =
      FileLock::take(folder / "lock", fmt::format("{}: in use by another imprint-node; stop that one, or name another "
                                                  "folder as node.data_dir",
                                                  folder.string()));
  if (!lock) return pass_on(lock.error());
  ImprintSpool spool(folder, std::move(*lock), max_bytes);
  spool.take_up();
  return spool;
}

void ImprintSpool::take_up() {
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(folder_, error)) {
    const std::string name = file.path().filename().string();
    if (name == "lock") continue;
    auto entry = entry_of(name);
    const auto content = entry ? read_file(file.path()) : invalid_input("not of the spool");
    if (!content || !decode_imprint(bytes_of(*content))) {
      spdlog::warn("{}: removed, it is no imprint", file.path().string());
      std::filesystem::remove(file.path(), error);
      continue;
    }
    entry->size = content->size();
    bytes_ += entry->size;
    next_place_ = std::max(next_place_, entry->place + 1);
    entries_.push_back(std::move(*entry));
  }
  if (error) spdlog::error("{}: {}", folder_.string(), error.message());
  std::ranges::sort(entries_, {}, &Entry::place);
  make_room(0);
}

void ImprintSpool::add(ImprintNumber number, std::span<const std::uint8_t> bytes) {
  make_room(bytes.size());
  Entry entry{next_place_++, number, bytes.size(), {}};
  write(entry, bytes);
  bytes_ += entry.size;
  bytes_in_memory_ += entry.in_memory.size();
  entries_.push_back(std::move(entry));
}

bool ImprintSpool::remove(ImprintNumber number) {
  const auto entry = find(number);
  if (entry == entries_.end()) return false;
  erase(entry);
  return true;
}

std::optional<std::vector<std::uint8_t>> ImprintSpool::read(ImprintNumber number) {
  const auto entry = find(number);
  if (entry == entries_.end()) return std::nullopt;
  if (!entry->in_memory.empty()) return entry->in_memory;
  const auto content = read_file(file_of(*entry));
  if (content && content->size() == entry->size) return std::vector<std::uint8_t>(content->begin(), content->end());
  spdlog::error("{}: lost: {}", file_of(*entry).string(), content ? "its size has changed" : content.error().message);
  ++discarded_;
  erase(entry);
  return std::nullopt;
}

void ImprintSpool::write_pending() {
  if (folder_.empty() || bytes_in_memory_ == 0) return;
  for (Entry& entry : entries_) {
    if (entry.in_memory.empty()) continue;
    const auto bytes = std::move(entry.in_memory);
    entry.in_memory.clear();
    write(entry, bytes);
    if (!entry.in_memory.empty()) return;
    bytes_in_memory_ -= bytes.size();
  }
}

void ImprintSpool::make_room(std::size_t wanted) {
  const auto in_memory = [](const Entry& entry) { return !entry.in_memory.empty(); };
  while (!entries_.empty() && bytes_ + wanted > max_bytes_) {
    ++discarded_;
    erase(entries_.begin());
  }
  while (bytes_in_memory_ > 0 && bytes_in_memory_ + wanted > kMaxBytesInMemory) {
    ++discarded_;
    erase(std::ranges::find_if(entries_, in_memory));
  }
}

void ImprintSpool::write(Entry& entry, std::span<const std::uint8_t> bytes) {
  if (!folder_.empty()) {
    const auto written =
        write_file_atomically(file_of(entry), {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
    if (written) {
      if (!fault_.empty()) spdlog::info("{}: can be written again", folder_.string());
      return fault_.clear();
    }
    if (fault_.empty()) spdlog::error("{}; imprints are kept in memory", written.error().message);
    fault_ = written.error().message;
  }
  entry.in_memory.assign(bytes.begin(), bytes.end());
}

void ImprintSpool::erase(std::vector<Entry>::iterator entry) {
  bytes_ -= entry->size;
  bytes_in_memory_ -= entry->in_memory.size();
  std::error_code ignored;  // what stays behind is sent again by the next start, and dropped by fusion as repeated
  if (entry->in_memory.empty()) std::filesystem::remove(file_of(*entry), ignored);
  entries_.erase(entry);
}

std::vector<ImprintSpool::Entry>::iterator ImprintSpool::find(ImprintNumber number) {
  return std::ranges::find(entries_, number, &Entry::number);
}

std::filesystem::path ImprintSpool::file_of(const Entry& entry) const { return folder_ / file_name(entry); }

}  // namespace imprint
