#include "fusion/history/history_export.h"

#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr int kMessagesAtOnce = 200;  // of at most 16 KiB
constexpr int kResultsAtOnce = 20;    // of some 100 KiB

}  // namespace

HistoryExport::HistoryExport(std::unique_ptr<HistoryCopy> copy, std::string site, std::string line, SessionStore& store,
                             LineBoard& board, Waits waits)
    : copy_(std::move(copy)),
      site_(std::move(site)),
      line_(std::move(line)),
      store_(store),
      board_(board),
      waits_(waits),
      thread_([this] { work(); }) {}

HistoryExport::~HistoryExport() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void HistoryExport::work() {
  bool failing = false;
  auto pause = std::chrono::milliseconds(0);
  while (wait(pause)) {
    const auto more = turn();
    show(more.has_value());
    if (!more) {
      position_.reset();
      board_.set_alarm("history", more.error().message);
      if (!failing) spdlog::warn("history: {}; tried again until it succeeds", more.error().message);
    } else if (failing) {
      board_.set_alarm("history", "");
      spdlog::info("history: connected again");
    }
    failing = !more;
    pause = failing ? waits_.retry : *more ? std::chrono::milliseconds(0) : waits_.idle;
  }
}

Result<bool> HistoryExport::turn() {
  if (!position_) {
    const auto position = connect();
    if (!position) return pass_on(position.error());
    position_ = reached_ = *position;
  }
  const auto messages = store_.messages_after(position_->message, kMessagesAtOnce);
  if (!messages) return pass_on(messages.error());
  const auto results = store_.results_after(position_->revision, kResultsAtOnce);
  if (!results) return pass_on(results.error());
  if (auto added = copy_->add(*messages, *results); !added) return pass_on(added.error());
  if (!messages->empty()) position_->message = messages->back().id;
  if (!results->empty()) position_->revision = results->back().revision;
  reached_ = *position_;
  board_.count("copied", messages->size() + results->size());
  return !messages->empty() || !results->empty();
}

Result<HistoryPosition> HistoryExport::connect() {
  const auto open = [this]() -> Result<HistoryEnd> {
    auto identity = store_.identity();
    if (!identity) return pass_on(identity.error());
    return copy_->connect({std::move(*identity), site_, line_});
  };
  auto end = open();
  if (!end) return pass_on(end.error());
  const auto agreed = agrees(*end);
  if (!agreed) return pass_on(agreed.error());
  if (*agreed) return end->position;
  spdlog::warn("history: the database is older than its copy, as one from a backup is; copied anew beside the former");
  if (auto renewed = store_.renew_identity(); !renewed) return pass_on(renewed.error());
  end = open();
  if (!end) return pass_on(end.error());
  return end->position;
}

Result<bool> HistoryExport::agrees(const HistoryEnd& end) {
  const auto newest = store_.newest();
  if (!newest) return pass_on(newest.error());
  if (newest->message < end.position.message || newest->revision < end.position.revision) return false;
  if (end.position.message == 0) return true;
  const auto same = store_.messages_after(end.position.message - 1, 1);
  if (!same) return pass_on(same.error());
  return !same->empty() && same->front().reception.received_ns == end.received_ns;
}

void HistoryExport::show(bool connected) {
  if (const auto newest = store_.newest()) {
    board_.set_history({connected, newest->message - reached_.message, newest->revision - reached_.revision});
  }
}

bool HistoryExport::wait(std::chrono::milliseconds time) {
  std::unique_lock lock(mutex_);
  return !changed_.wait_for(lock, time, [this] { return stopping_; });
}

}  // namespace imprint
