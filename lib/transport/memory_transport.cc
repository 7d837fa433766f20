#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "lib/transport/callback_gate.h"
#include "lib/transport/key_expression.h"
#include "lib/transport/transport.h"

namespace imprint {
namespace {

/// What a get waits for; shared with the queries it sent out, which may be answered after it gave up.
class PendingGet {
 public:
  explicit PendingGet(std::size_t queries) : open_(queries) {}

  void add(Sample sample) {
    const std::lock_guard lock(mutex_);
    samples_.push_back(std::move(sample));
  }
  void fail(std::string message) {
    const std::lock_guard lock(mutex_);
    if (error_.empty()) error_ = std::move(message);
    failed_ = true;
  }
  void close_one() {
    {
      const std::lock_guard lock(mutex_);
      --open_;
    }
    changed_.notify_all();
  }
  Result<std::vector<Sample>> wait(const std::string& selector, std::chrono::milliseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return open_ == 0; });
    if (failed_) return job_failed("query '{}': {}", selector, error_);
    return std::move(samples_);
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t open_;
  std::vector<Sample> samples_;
  std::string error_;
  bool failed_ = false;
};

class MemoryQuery final : public Query {
 public:
  MemoryQuery(std::shared_ptr<PendingGet> pending, std::string key, std::string declared, std::string parameters,
              Bytes payload)
      : pending_(std::move(pending)),
        key_(std::move(key)),
        declared_(std::move(declared)),
        parameters_(std::move(parameters)),
        payload_(std::move(payload)) {}
  ~MemoryQuery() override {
    if (!answered_) pending_->close_one();
  }
  MemoryQuery(const MemoryQuery&) = delete;
  MemoryQuery& operator=(const MemoryQuery&) = delete;

  std::string key() const override { return key_; }
  std::string parameters() const override { return parameters_; }
  Bytes payload() const override { return payload_; }

  Result<void> reply(std::span<const std::uint8_t> payload) override {
    const bool wild = key_.find('*') != std::string::npos;
    const std::string& reply_key = wild ? declared_ : key_;
    if (reply_key.find('*') != std::string::npos)
      return job_failed("query on '{}': cannot be answered: no single key to answer on: declared {}", key_, declared_);
    return answer([&] { pending_->add({reply_key, Bytes(payload.begin(), payload.end())}); });
  }
  Result<void> reply_error(std::string_view message) override {
    return answer([&] { pending_->fail(std::string(message)); });
  }

 private:
  template <class Send>
  Result<void> answer(Send&& send) {
    const std::lock_guard lock(mutex_);
    if (answered_) return job_failed("query on '{}': expected one answer, found a second", key_);
    answered_ = true;
    send();
    pending_->close_one();
    return {};
  }

  std::shared_ptr<PendingGet> pending_;
  std::string key_;
  std::string declared_;
  std::string parameters_;
  Bytes payload_;
  std::mutex mutex_;
  bool answered_ = false;
};

/// Something declared on the bus: a callback of the given type behind its gate.
template <class Callback>
struct Entry {
  std::string key;
  Callback callback;
  CallbackGate gate;
};
template <class Callback>
using Entries = std::vector<std::shared_ptr<Entry<Callback>>>;

struct History {
  std::string key;
  std::size_t depth = 0;
  std::deque<Sample> samples;
};

template <class Callback>
void remove(Entries<Callback>& entries, const Entry<Callback>* gone) {
  std::erase_if(entries, [&](const auto& entry) { return entry.get() == gone; });
}

}  // namespace

/// All that is declared, and one thread that delivers, so that callbacks never run on the caller's thread
/// (as with Zenoh) and every subscriber sees one order.
class MemoryBus {
 public:
  MemoryBus() : dispatcher_([this] { dispatch(); }) {}
  ~MemoryBus() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_.notify_all();
    dispatcher_.join();
  }
  MemoryBus(const MemoryBus&) = delete;
  MemoryBus& operator=(const MemoryBus&) = delete;

  std::shared_ptr<History> add_history(const std::string& key, std::size_t depth) {
    const std::lock_guard lock(mutex_);
    return histories_.emplace_back(std::make_shared<History>(History{key, depth, {}}));
  }
  void remove_history(const History* gone) {
    const std::lock_guard lock(mutex_);
    std::erase_if(histories_, [&](const auto& history) { return history.get() == gone; });
  }

  void put(History& history, std::span<const std::uint8_t> payload) {
    const std::lock_guard lock(mutex_);
    Sample sample{history.key, Bytes(payload.begin(), payload.end())};
    for (const auto& subscriber : subscribers_)
      if (keys_intersect(subscriber->key, sample.key)) deliver(subscriber, sample);
    history.samples.push_back(std::move(sample));
    if (history.samples.size() > history.depth) history.samples.pop_front();
  }

  std::shared_ptr<Entry<SampleCallback>> add_subscriber(const std::string& key, std::size_t wanted,
                                                        SampleCallback callback) {
    auto entry = make_entry(key, std::move(callback));
    const std::lock_guard lock(mutex_);
    subscribers_.push_back(entry);
    for (const auto& history : histories_) {
      if (!keys_intersect(key, history->key)) continue;
      const std::size_t skipped = history->samples.size() - std::min(wanted, history->samples.size());
      for (std::size_t i = skipped; i < history->samples.size(); ++i) deliver(entry, history->samples[i]);
    }
    return entry;
  }

  std::shared_ptr<Entry<QueryCallback>> add_queryable(const std::string& key, QueryCallback callback) {
    const std::lock_guard lock(mutex_);
    return queryables_.emplace_back(make_entry(key, std::move(callback)));
  }

  std::shared_ptr<PendingGet> ask(const std::string& key, const std::string& parameters, const Bytes& payload) {
    const std::lock_guard lock(mutex_);
    Entries<QueryCallback> asked;
    std::copy_if(queryables_.begin(), queryables_.end(), std::back_inserter(asked),
                 [&](const auto& queryable) { return keys_intersect(queryable->key, key); });
    auto pending = std::make_shared<PendingGet>(asked.size());
    for (const auto& queryable : asked) {
      auto query = std::make_shared<MemoryQuery>(pending, key, queryable->key, parameters, payload);
      post([queryable, query = std::move(query)]() mutable {
        queryable->gate.pass([&] { queryable->callback(std::move(query)); });
      });
    }
    return pending;
  }

  std::shared_ptr<Entry<LivenessCallback>> add_watch(const std::string& key, LivenessCallback callback) {
    auto entry = make_entry(key, std::move(callback));
    const std::lock_guard lock(mutex_);
    watches_.push_back(entry);
    for (const auto& [token, count] : tokens_)
      if (keys_intersect(key, token)) tell(entry, token, true);
    return entry;
  }

  void add_token(const std::string& key) {
    const std::lock_guard lock(mutex_);
    if (++tokens_[key] == 1) tell_all(key, true);
  }
  void remove_token(const std::string& key) {
    const std::lock_guard lock(mutex_);
    if (--tokens_[key] > 0) return;
    tokens_.erase(key);
    tell_all(key, false);
  }

  void take_back(const Entry<SampleCallback>* gone) { take_back(subscribers_, gone); }
  void take_back(const Entry<QueryCallback>* gone) { take_back(queryables_, gone); }
  void take_back(const Entry<LivenessCallback>* gone) { take_back(watches_, gone); }

 private:
  template <class Callback>
  static std::shared_ptr<Entry<Callback>> make_entry(const std::string& key, Callback callback) {
    auto entry = std::make_shared<Entry<Callback>>();
    entry->key = key;
    entry->callback = std::move(callback);
    return entry;
  }

  template <class Callback>
  void take_back(Entries<Callback>& entries, const Entry<Callback>* gone) {
    const std::lock_guard lock(mutex_);
    remove(entries, gone);
  }

  // The following are called with the lock held.
  void post(std::function<void()> event) {
    events_.push_back(std::move(event));
    wake_.notify_all();
  }
  void deliver(const std::shared_ptr<Entry<SampleCallback>>& to, const Sample& sample) {
    post([to, sample] { to->gate.pass([&] { to->callback(sample); }); });
  }
  void tell(const std::shared_ptr<Entry<LivenessCallback>>& to, const std::string& key, bool alive) {
    post([to, key, alive] { to->gate.pass([&] { to->callback(key, alive); }); });
  }
  void tell_all(const std::string& key, bool alive) {
    for (const auto& watch : watches_)
      if (keys_intersect(watch->key, key)) tell(watch, key, alive);
  }

  void dispatch() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stopping_ || !events_.empty(); });
      if (stopping_) return;
      std::function<void()> event = std::move(events_.front());
      events_.pop_front();
      lock.unlock();
      event();
      event = nullptr;  // what it held may call back into the bus
      lock.lock();
    }
  }

  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::deque<std::function<void()>> events_;
  std::vector<std::shared_ptr<History>> histories_;  // one a publisher
  Entries<SampleCallback> subscribers_;
  Entries<QueryCallback> queryables_;
  Entries<LivenessCallback> watches_;
  std::map<std::string, int> tokens_;
  std::thread dispatcher_;  // last: it uses all of the above
};

namespace {

class MemoryPublisher final : public Publisher {
 public:
  MemoryPublisher(std::shared_ptr<MemoryBus> bus, const std::string& key, std::size_t depth)
      : bus_(std::move(bus)), history_(bus_->add_history(key, depth)) {}
  ~MemoryPublisher() override { bus_->remove_history(history_.get()); }
  MemoryPublisher(const MemoryPublisher&) = delete;
  MemoryPublisher& operator=(const MemoryPublisher&) = delete;

  Result<void> put(std::span<const std::uint8_t> payload) override {
    bus_->put(*history_, payload);
    return {};
  }

 private:
  std::shared_ptr<MemoryBus> bus_;
  std::shared_ptr<History> history_;
};

template <class Callback>
class MemoryDeclaration final : public Declaration {
 public:
  MemoryDeclaration(std::shared_ptr<MemoryBus> bus, std::shared_ptr<Entry<Callback>> entry)
      : bus_(std::move(bus)), entry_(std::move(entry)) {}
  ~MemoryDeclaration() override {
    bus_->take_back(entry_.get());
    entry_->gate.close();
  }
  MemoryDeclaration(const MemoryDeclaration&) = delete;
  MemoryDeclaration& operator=(const MemoryDeclaration&) = delete;

 private:
  std::shared_ptr<MemoryBus> bus_;
  std::shared_ptr<Entry<Callback>> entry_;
};

class MemoryToken final : public Declaration {
 public:
  MemoryToken(std::shared_ptr<MemoryBus> bus, std::string key) : bus_(std::move(bus)), key_(std::move(key)) {
    bus_->add_token(key_);
  }
  ~MemoryToken() override { bus_->remove_token(key_); }
  MemoryToken(const MemoryToken&) = delete;
  MemoryToken& operator=(const MemoryToken&) = delete;

 private:
  std::shared_ptr<MemoryBus> bus_;
  std::string key_;
};

class MemoryTransport final : public Transport {
 public:
  explicit MemoryTransport(std::shared_ptr<MemoryBus> bus) : bus_(std::move(bus)) {}

  Result<std::unique_ptr<Publisher>> publish(const std::string& key, PublisherOptions options) override {
    if (auto checked = check_key(key, false); !checked) return pass_on(checked.error());
    return std::make_unique<MemoryPublisher>(bus_, key, options.history);
  }

  // Nothing is ever lost here: `on_miss` is never called.
  Result<std::unique_ptr<Declaration>> subscribe(const std::string& key, SubscriberOptions options,
                                                 SampleCallback on_sample, MissCallback) override {
    if (auto checked = check_key(key, true); !checked) return pass_on(checked.error());
    return declaration(bus_->add_subscriber(key, options.history, std::move(on_sample)));
  }

  Result<std::unique_ptr<Declaration>> answer(const std::string& key, QueryCallback on_query) override {
    if (auto checked = check_key(key, true); !checked) return pass_on(checked.error());
    return declaration(bus_->add_queryable(key, std::move(on_query)));
  }

  Result<std::unique_ptr<Declaration>> announce(const std::string& key) override {
    if (auto checked = check_key(key, false); !checked) return pass_on(checked.error());
    return std::make_unique<MemoryToken>(bus_, key);
  }

  Result<std::unique_ptr<Declaration>> watch_liveness(const std::string& key, LivenessCallback on_change) override {
    if (auto checked = check_key(key, true); !checked) return pass_on(checked.error());
    return declaration(bus_->add_watch(key, std::move(on_change)));
  }

  using Transport::get;
  Result<std::vector<Sample>> get(const std::string& selector, std::span<const std::uint8_t> payload,
                                  std::chrono::milliseconds timeout, Traffic) override {
    const auto mark = selector.find('?');
    const std::string key = selector.substr(0, mark);
    if (auto checked = check_key(key, true); !checked) return pass_on(checked.error());
    const std::string parameters = mark == std::string::npos ? "" : selector.substr(mark + 1);
    return bus_->ask(key, parameters, Bytes(payload.begin(), payload.end()))->wait(selector, timeout);
  }

 private:
  template <class Callback>
  std::unique_ptr<Declaration> declaration(std::shared_ptr<Entry<Callback>> entry) {
    return std::make_unique<MemoryDeclaration<Callback>>(bus_, std::move(entry));
  }

  std::shared_ptr<MemoryBus> bus_;
};

}  // namespace

std::shared_ptr<MemoryBus> make_memory_bus() { return std::make_shared<MemoryBus>(); }

std::unique_ptr<Transport> open_memory(std::shared_ptr<MemoryBus> bus) {
  return std::make_unique<MemoryTransport>(std::move(bus));
}

}  // namespace imprint
