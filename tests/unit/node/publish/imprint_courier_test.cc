#include "node/publish/imprint_courier.h"

#include <condition_variable>

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using namespace std::chrono_literals;

Imprint taken(std::uint32_t observation) {
  Imprint imprint;
  imprint.camera_id = "cam1";
  imprint.session = "S";
  imprint.observation = observation;
  imprint.failure = "no forging found";
  return imprint;
}

// The other end: hears imprints and reports, sends receipts when told to.
struct FakeFusion {
  explicit FakeFusion(const std::shared_ptr<MemoryBus>& bus) : side(open_memory(bus)) {
    declarations.push_back(*side->subscribe(keys.imprint(), {.history = 0}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      heard.push_back(*decode_imprint(sample.payload));
      changed.notify_all();
    }));
    declarations.push_back(*side->subscribe(keys.delivery(), {.history = 0}, [this](const Sample& sample) {
      const std::lock_guard lock(mutex);
      reports.push_back(*decode_delivery(sample.payload));
      changed.notify_all();
    }));
    receipts = *side->publish(keys.receipt("cam1"), {.traffic = Traffic::imprint});
    declarations.push_back(*side->announce(keys.fusion_alive()));
  }

  bool eventually(const std::function<bool()>& condition) {
    std::unique_lock lock(mutex);
    return changed.wait_for(lock, 5s, condition);
  }
  void confirm(const Imprint& imprint) {
    REQUIRE(receipts->put(encode_receipt({"cam1", imprint.boot_id, imprint.sequence, ""})));
  }

  Keys keys = *Keys::of("plant", "L1");
  std::unique_ptr<Transport> side;
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<Imprint> heard;
  std::vector<Delivery> reports;
  std::unique_ptr<Publisher> receipts;
  std::vector<std::unique_ptr<Declaration>> declarations;
};

struct Node {
  Node(const std::shared_ptr<MemoryBus>& bus, const std::filesystem::path& folder, std::uint64_t boot_id,
       double retry_s = 60.0)
      : side(open_memory(bus)),
        courier(*ImprintCourier::start(*side, *Keys::of("plant", "L1"), "cam1", boot_id,
                                       *ImprintSpool::open(folder, 1U << 20U), {.first_timeout_s = retry_s})) {}
  std::unique_ptr<Transport> side;
  std::unique_ptr<ImprintCourier> courier;
};

}  // namespace

TEST_CASE("courier: without a receipt an imprint is sent again, with one no more") {
  const TemporaryFolder folder;
  const auto bus = make_memory_bus();
  FakeFusion fusion(bus);
  const Node node(bus, folder / "cam1", 7, 0.2);
  node.courier->send(taken(0));
  REQUIRE(fusion.eventually([&] { return fusion.heard.size() >= 3; }));
  for (const Imprint& imprint : fusion.heard) REQUIRE(imprint.sequence == 1);
  fusion.confirm(fusion.heard[0]);
  REQUIRE(fusion.eventually([&] { return !fusion.reports.empty() && fusion.reports.back().waiting == 0; }));
  const auto count = fusion.heard.size();
  std::this_thread::sleep_for(600ms);
  REQUIRE(fusion.heard.size() == count);
}

TEST_CASE("courier: what was taken while fusion was away, also by an earlier start, is sent when it comes") {
  const TemporaryFolder folder;
  const auto bus = make_memory_bus();
  {
    const Node node(bus, folder / "cam1", 7);
    for (std::uint32_t observation = 0; observation < 20; ++observation) node.courier->send(taken(observation));
  }
  const Node node(bus, folder / "cam1", 8);
  node.courier->send(taken(20));
  FakeFusion fusion(bus);
  std::size_t confirmed = 0;
  while (confirmed < 21) {
    REQUIRE(fusion.eventually([&] { return fusion.heard.size() > confirmed; }));
    Imprint imprint;
    {
      const std::lock_guard lock(fusion.mutex);
      imprint = fusion.heard[confirmed];
    }
    REQUIRE(imprint.observation == confirmed);  // the oldest first
    fusion.confirm(imprint);
    ++confirmed;
  }
  REQUIRE(fusion.eventually([&] { return !fusion.reports.empty() && fusion.reports.back().waiting == 0; }));
  REQUIRE(std::distance(std::filesystem::directory_iterator(folder / "cam1"), {}) == 1);  // the lock
}

TEST_CASE("courier: what fusion refuses is given up and counted; another's receipt changes nothing") {
  const TemporaryFolder folder;
  const auto bus = make_memory_bus();
  FakeFusion fusion(bus);
  const Node node(bus, folder / "cam1", 7);
  node.courier->send(taken(0));
  node.courier->send(taken(1));
  // Perhaps twice: the node may hear of fusion after it has sent them.
  REQUIRE(fusion.eventually([&] { return !fusion.heard.empty() && fusion.heard.back().sequence == 2; }));
  REQUIRE(fusion.receipts->put(encode_receipt({"cam2", 7, 1, ""})));
  REQUIRE(fusion.receipts->put(encode_receipt({"cam1", 9, 1, ""})));
  REQUIRE(fusion.receipts->put(Bytes{1, 2, 3}));
  REQUIRE(fusion.receipts->put(encode_receipt({"cam1", 7, 2, "no such observation"})));
  std::this_thread::sleep_for(100ms);
  node.courier->report();
  REQUIRE(fusion.eventually([&] { return !fusion.reports.empty(); }));
  REQUIRE(fusion.reports.back().waiting == 1);
  REQUIRE(fusion.reports.back().oldest_waiting == 1);
  REQUIRE(fusion.reports.back().sequence == 2);
  REQUIRE(fusion.reports.back().refused == 1);
}

}  // namespace imprint
