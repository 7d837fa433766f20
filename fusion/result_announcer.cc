#include "fusion/result_announcer.h"

#include "lib/config/atomic_file.h"
#include "lib/log/log.h"
#include "lib/wire/wire.h"

namespace imprint {
namespace {

constexpr std::size_t kPublishedSessions = 16;  // whose last result a late watcher still gets

}  // namespace

void ResultAnnouncer::announce(const StoredResult& result) {
  board_.count("results");
  write_file(result);
  publish(result);
  board_.set_result(result);
}

void ResultAnnouncer::publish(const StoredResult& result) {
  auto publisher = publishers_.find(result.session);
  if (publisher == publishers_.end()) {
    auto opened = transport_.publish(keys_.result(result.session), {.traffic = Traffic::bulk, .history = 1});
    if (!opened) {
      spdlog::error("session {}: {}", result.session, opened.error().message);
      return;
    }
    if (published_sessions_.size() >= kPublishedSessions) {
      publishers_.erase(published_sessions_.front());
      published_sessions_.pop_front();
    }
    published_sessions_.push_back(result.session);
    publisher = publishers_.emplace(result.session, std::move(*opened)).first;
  }
  const auto sent = publisher->second->put(encode_result({result.session, result.complete, result.error, result.json}));
  if (!sent) spdlog::error("session {}: {}", result.session, sent.error().message);
}

void ResultAnnouncer::write_file(const StoredResult& result) {
  if (result_dir_.empty() || result.json.empty()) return;
  const std::filesystem::path folder = result_dir_ / result.session;
  const std::filesystem::path file = folder / "result.json";
  const std::string content = result.json + "\n";
  if (const auto there = read_file(file); there && *there == content) return;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    board_.set_alarm("result_dir", fmt::format("{}: {}", folder.string(), error.message()));
    return;
  }
  const auto written = write_file_atomically(file, content);
  board_.set_alarm("result_dir", written ? "" : written.error().message);
}

}  // namespace imprint
