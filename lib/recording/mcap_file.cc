#include "lib/recording/mcap_file.h"

#include <optional>
#include <utility>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kRecordHeader = 9;  // opcode and length

enum Opcode : std::uint8_t { header = 1, footer = 2, schema = 3, channel = 4, message = 5, chunk = 6, data_end = 15 };

// Little-endian, as the whole format.
template <class T>
void put_number(std::string& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out.push_back(static_cast<char>((value >> (8 * i)) & 0xFFU));
}
void put_text(std::string& out, std::string_view text) {
  put_number(out, static_cast<std::uint32_t>(text.size()));
  out += text;
}

// Takes values off the front of a record; `failed` once one does not fit.
struct Cursor {
  std::string_view rest;
  bool failed = false;

  template <class T>
  T number() {
    if (rest.size() < sizeof(T)) {
      failed = true;
      rest = {};
      return 0;
    }
    T value = 0;
    for (std::size_t i = 0; i < sizeof(T); ++i)
      value = static_cast<T>(value | (static_cast<T>(static_cast<unsigned char>(rest[i])) << (8 * i)));
    rest.remove_prefix(sizeof(T));
    return value;
  }
  std::string_view text() {
    const auto size = number<std::uint32_t>();
    if (size > rest.size()) failed = true;
    const std::string_view value = rest.substr(0, size);
    rest.remove_prefix(value.size());
    return value;
  }
};

struct Channel {
  std::string topic;
  std::string schema;
};

struct Reading {
  std::map<std::uint16_t, std::string> schemas;
  std::map<std::uint16_t, Channel> channels;
  McapContent content;
};

// False when the record contradicts itself or speaks of what was not there before it.
bool take_record(Reading& reading, std::uint8_t opcode, std::string_view bytes) {
  Cursor record{bytes};
  switch (opcode) {
    case Opcode::schema: {
      const auto id = record.number<std::uint16_t>();
      reading.schemas[id] = std::string(record.text());
      return !record.failed && id != 0;
    }
    case Opcode::channel: {
      const auto id = record.number<std::uint16_t>();
      const auto of = reading.schemas.find(record.number<std::uint16_t>());
      const std::string topic(record.text());
      if (record.failed || of == reading.schemas.end()) return false;
      reading.channels[id] = {topic, of->second};
      return true;
    }
    case Opcode::message: {
      const auto on = reading.channels.find(record.number<std::uint16_t>());
      record.number<std::uint32_t>();  // counts within the channel
      const auto time_ns = static_cast<std::int64_t>(record.number<std::uint64_t>());
      record.number<std::uint64_t>();  // when it was published
      if (record.failed || on == reading.channels.end()) return false;
      reading.content.messages.push_back(
          {on->second.topic, on->second.schema, time_ns, {record.rest.begin(), record.rest.end()}});
      return true;
    }
    default:
      return true;  // of no interest, or of a later version
  }
}

}  // namespace

Result<McapWriter> McapWriter::open(const std::filesystem::path& path) {
  McapWriter writer(path);
  writer.file_.open(path.string() + ".part", std::ios::binary | std::ios::trunc);
  writer.file_ << kMagic;
  std::string content;
  put_text(content, "");  // no profile
  put_text(content, "imprint");
  if (auto put = writer.put(Opcode::header, content); !put) {
    return invalid_input("{}.part: cannot be written; check that the folder exists and is writable", path.string());
  }
  return writer;
}

Result<void> McapWriter::write(const std::string& topic, const std::string& schema, std::string_view description,
                               std::int64_t time_ns, std::span<const std::uint8_t> bytes) {
  const auto [known_schema, new_schema] = schemas_.try_emplace(schema, static_cast<std::uint16_t>(schemas_.size() + 1));
  if (new_schema) {
    std::string content;
    put_number(content, known_schema->second);
    put_text(content, schema);
    put_text(content, "protobuf");
    put_text(content, description);
    if (auto put = this->put(Opcode::schema, content); !put) return put;
  }
  const auto [known_channel, new_channel] =
      channels_.try_emplace(topic, static_cast<std::uint16_t>(channels_.size() + 1));
  if (new_channel) {
    std::string content;
    put_number(content, known_channel->second);
    put_number(content, known_schema->second);
    put_text(content, topic);
    put_text(content, "protobuf");
    put_number(content, std::uint32_t{0});  // no metadata
    if (auto put = this->put(Opcode::channel, content); !put) return put;
  }
  std::string content;
  put_number(content, known_channel->second);
  put_number(content, sequence_++);
  put_number(content, static_cast<std::uint64_t>(time_ns));
  put_number(content, static_cast<std::uint64_t>(time_ns));
  content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  return put(Opcode::message, content);
}

Result<void> McapWriter::close() {
  std::string content;
  put_number(content, std::uint32_t{0});  // no checksum
  if (auto put = this->put(Opcode::data_end, content); !put) return put;
  content.clear();
  put_number(content, std::uint64_t{0});  // no summary
  put_number(content, std::uint64_t{0});
  put_number(content, std::uint32_t{0});
  if (auto put = this->put(Opcode::footer, content); !put) return put;
  file_ << kMagic;
  file_.close();
  std::error_code error;
  if (file_) std::filesystem::rename(path_.string() + ".part", path_, error);
  if (!file_ || error) return pass_on(failure());
  return {};
}

Result<void> McapWriter::put(std::uint8_t opcode, const std::string& content) {
  std::string record(1, static_cast<char>(opcode));
  put_number(record, static_cast<std::uint64_t>(content.size()));
  file_ << record << content << std::flush;  // whole up to here, whatever happens next
  if (!file_) return pass_on(failure());
  return {};
}

Error McapWriter::failure() const {
  return {ErrorKind::job_failed, path_.string() + ".part: cannot be written; is the disk full?"};
}

Result<McapContent> read_mcap(const std::filesystem::path& path) {
  const auto file = read_file(path);
  if (!file) return pass_on(file.error());
  std::string_view rest = *file;
  if (!rest.starts_with(kMagic)) return invalid_input("{}: expected an MCAP file, found something else", path.string());
  rest.remove_prefix(kMagic.size());
  Reading reading;
  reading.content.cut_off = true;
  while (rest.size() >= kRecordHeader) {
    Cursor cursor{rest};
    const auto opcode = cursor.number<std::uint8_t>();
    const auto length = cursor.number<std::uint64_t>();
    if (length > cursor.rest.size()) break;
    if (opcode == Opcode::data_end) reading.content.cut_off = false;
    if (opcode == Opcode::data_end || opcode == Opcode::footer) break;  // what follows only repeats
    if (opcode == Opcode::chunk) {
      return invalid_input("{}: expected a recording without chunks, as `imprint record` makes it", path.string());
    }
    if (!take_record(reading, opcode, cursor.rest.substr(0, length))) {
      return invalid_input("{}: damaged at byte {}: a record that contradicts itself", path.string(),
                           file->size() - rest.size());
    }
    rest = cursor.rest.substr(length);
  }
  return std::move(reading.content);
}

}  // namespace imprint
