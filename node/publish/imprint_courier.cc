#include "node/publish/imprint_courier.h"

#include <algorithm>
#include <random>
#include <utility>

#include "lib/clock/wall_clock.h"
#include "lib/log/log.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxEvents = 1024;
constexpr std::size_t kMaxReceiptBytes = 4096;
constexpr auto kIdleWait = std::chrono::seconds(5);  // and how often a disk that was full is tried again

}  // namespace

std::uint64_t make_boot_id() {
  std::random_device random;
  std::uint64_t id = 0;
  while (id == 0) id = (static_cast<std::uint64_t>(random()) << 32U) | random();
  return id;
}

ImprintCourier::ImprintCourier(const Keys& keys, std::string camera_id, std::uint64_t boot_id, ImprintSpool spool,
                               RetryConfig retry)
    : keys_(keys),
      camera_id_(std::move(camera_id)),
      boot_id_(boot_id),
      events_(std::make_shared<BoundedQueue<Event>>(kMaxEvents)),
      spool_(std::move(spool)),
      schedule_(retry) {
  note_earlier_starts();
}

void ImprintCourier::note_earlier_starts() {
  std::vector<ImprintNumber> numbers;
  for (const auto& entry : spool_.entries()) {
    schedule_.add(entry.place);
    numbers.push_back(entry.number);
  }
  for (const ImprintNumber& number : numbers) {
    const auto bytes = spool_.read(number);
    const auto imprint = bytes ? decode_imprint(*bytes) : invalid_input("gone");
    if (imprint && imprint->failure.empty()) answered_before_.emplace_back(imprint->session, imprint->observation);
  }
}

Result<std::unique_ptr<ImprintCourier>> ImprintCourier::start(Transport& transport, const Keys& keys,
                                                              const std::string& camera_id, std::uint64_t boot_id,
                                                              ImprintSpool spool, RetryConfig retry) {
  std::unique_ptr<ImprintCourier> courier(new ImprintCourier(keys, camera_id, boot_id, std::move(spool), retry));
  if (auto declared = courier->declare(transport); !declared) return pass_on(declared.error());
  if (const auto& left = courier->spool_.entries(); !left.empty()) {
    spdlog::info("{} imprint(s) of earlier starts have no receipt yet and are sent again", left.size());
  }
  courier->worker_ = std::thread([self = courier.get()] { self->work(); });
  return courier;
}

Result<void> ImprintCourier::declare(Transport& transport) {
  const auto publisher = [&](const std::string& key, PublisherOptions options,
                             std::unique_ptr<Publisher>& place) -> Result<void> {
    auto opened = transport.publish(key, options);
    if (!opened) return pass_on(opened.error());
    place = std::move(*opened);
    return {};
  };
  const std::string key = keys_.imprint(camera_id_);
  // Without Zenoh's history: after a cut it would bring the last ones ahead of those that the spool brings in order.
  if (auto done = publisher(key, {.traffic = Traffic::imprint, .history = 0}, live_); !done) return done;
  if (auto done = publisher(key, {.traffic = Traffic::backlog, .history = 0}, backlog_); !done) return done;
  if (auto done = publisher(keys_.delivery(camera_id_), {.traffic = Traffic::health, .history = 0}, reports_); !done)
    return done;

  const auto on_receipt = [events = events_](const Sample& sample) {
    if (sample.payload.size() <= kMaxReceiptBytes) events->push({Event::Kind::receipt, sample.payload});
  };
  const auto on_fusion = [events = events_](std::string_view, bool alive) {
    events->push({alive ? Event::Kind::fusion_came : Event::Kind::fusion_left, {}});
  };
  Result<std::unique_ptr<Declaration>> declared[] = {
      transport.subscribe(keys_.receipt(camera_id_), {.history = 0}, on_receipt),
      transport.watch_liveness(keys_.fusion_alive(), on_fusion),
  };
  for (auto& declaration : declared) {
    if (!declaration) return pass_on(declaration.error());
    declarations_.push_back(std::move(*declaration));
  }
  return {};
}

ImprintCourier::~ImprintCourier() {
  declarations_.clear();
  events_->drop();
  if (worker_.joinable()) worker_.join();
}

void ImprintCourier::send(Imprint imprint) {
  const std::lock_guard lock(mutex_);
  imprint.boot_id = boot_id_;
  imprint.sequence = ++sequence_;
  const auto bytes = encode_imprint(imprint);
  spool_.add({boot_id_, sequence_}, bytes);
  schedule_.sent(spool_.entries().back().place, std::chrono::steady_clock::now());
  if (auto sent = live_->put(bytes); !sent) spdlog::warn("imprint not sent yet: {}", sent.error().message);
  events_->push({Event::Kind::imprint_sent, {}});  // its timeout may be the next
}

std::vector<std::pair<std::string, std::uint32_t>> ImprintCourier::answered_before() const { return answered_before_; }

void ImprintCourier::report() {
  const std::lock_guard lock(mutex_);
  if (auto sent = reports_->put(encode_delivery(state())); !sent) spdlog::warn("{}", sent.error().message);
}

std::uint64_t ImprintCourier::sequence() const {
  const std::lock_guard lock(mutex_);
  return sequence_;
}

Delivery ImprintCourier::state() const {
  Delivery delivery{.camera_id = camera_id_,
                    .time_ns = wall_clock_ns(),
                    .boot_id = boot_id_,
                    .sequence = sequence_,
                    .waiting = static_cast<std::uint32_t>(spool_.entries().size()),
                    .waiting_bytes = spool_.bytes(),
                    .discarded = spool_.discarded(),
                    .refused = refused_,
                    .fault = spool_.fault()};
  const auto oldest =
      std::ranges::find_if(spool_.entries(), [&](const auto& entry) { return entry.number.boot_id == boot_id_; });
  if (oldest != spool_.entries().end()) delivery.oldest_waiting = oldest->number.sequence;
  return delivery;
}

void ImprintCourier::work() {
  while (!events_->finished()) {
    auto until = std::chrono::steady_clock::now() + kIdleWait;
    {
      const std::lock_guard lock(mutex_);
      if (fusion_is_there_) until = std::min(until, schedule_.next_timeout().value_or(until));
    }
    if (const auto event = events_->pop_until(until)) handle(*event);
    const std::lock_guard lock(mutex_);
    spool_.write_pending();
    if (fusion_is_there_) send_again();
  }
}

void ImprintCourier::handle(const Event& event) {
  switch (event.kind) {
    case Event::Kind::receipt:
      if (const auto receipt = decode_receipt(event.bytes); receipt && receipt->camera_id == camera_id_)
        receive(*receipt);
      return;
    case Event::Kind::fusion_came: {
      const std::lock_guard lock(mutex_);
      fusion_is_there_ = true;
      schedule_.begin_anew();
      return;
    }
    case Event::Kind::fusion_left:
      fusion_is_there_ = false;
      return;
    case Event::Kind::imprint_sent:
      return;
  }
}

void ImprintCourier::receive(const Receipt& receipt) {
  bool all_arrived = false;
  {
    const std::lock_guard lock(mutex_);
    const ImprintNumber number{receipt.boot_id, receipt.sequence};
    const auto entry = std::ranges::find(spool_.entries(), number, &ImprintSpool::Entry::number);
    if (entry == spool_.entries().end()) return;
    schedule_.remove(entry->place);
    spool_.remove(number);
    all_arrived = spool_.entries().empty();
    if (!receipt.refused.empty()) {
      ++refused_;
      spdlog::error("imprint {} was refused by fusion and is given up: {}", receipt.sequence, receipt.refused);
    }
  }
  if (all_arrived) report();
}

void ImprintCourier::send_again() {
  for (const std::uint64_t place : schedule_.due(std::chrono::steady_clock::now())) {
    const auto entry = std::ranges::find(spool_.entries(), place, &ImprintSpool::Entry::place);
    const auto bytes = entry == spool_.entries().end() ? std::nullopt : spool_.read(entry->number);
    if (!bytes) {  // ended for want of room, or damaged
      schedule_.remove(place);
      continue;
    }
    schedule_.sent(place, std::chrono::steady_clock::now());
    if (auto sent = backlog_->put(*bytes); !sent) spdlog::debug("{}", sent.error().message);
  }
}

}  // namespace imprint
