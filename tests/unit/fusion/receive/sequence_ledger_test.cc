#include "fusion/receive/sequence_ledger.h"

#include <catch2/catch.hpp>

namespace imprint {
namespace {

std::string missing(const SequenceLedger& ledger) {
  std::vector<SequenceLedger::Range> ranges;
  for (const auto& gap : ledger.gaps()) ranges.push_back(gap.missing);
  return ranges_text(ranges);
}

}  // namespace

TEST_CASE("sequence ledger: a gap is named while it is open and gone when it is filled, in whatever order") {
  SequenceLedger ledger;
  CHECK(ledger.add(7, 1) == Place::next);
  CHECK(ledger.add(7, 2) == Place::next);
  CHECK(ledger.add(7, 6) == Place::ahead);
  CHECK(ledger.add(7, 9) == Place::ahead);
  CHECK(missing(ledger) == "3-5, 7-8");
  CHECK(ledger.missing() == 5);
  CHECK(ledger.add(7, 4) == Place::belated);
  CHECK(ledger.add(7, 4) == Place::repeated);
  CHECK(missing(ledger) == "3, 5, 7-8");
  for (const std::uint64_t sequence : {8, 3, 7, 5}) CHECK(ledger.add(7, sequence) == Place::belated);
  CHECK(missing(ledger).empty());
  CHECK(ledger.add(7, 10) == Place::next);
}

TEST_CASE("sequence ledger: what the node says it has made is missing until it comes") {
  SequenceLedger ledger;
  ledger.announce(7, 4, 3);  // the first two are in another database, the others wait in the node
  CHECK(missing(ledger) == "3-4");
  ledger.add(7, 4);
  ledger.add(7, 3);
  CHECK(missing(ledger).empty());
  ledger.announce(7, 5, 5);
  CHECK(missing(ledger) == "5");
}

TEST_CASE("sequence ledger: each start of the node counts for itself, and the first heard of is where it begins") {
  SequenceLedger ledger;
  CHECK(ledger.add(7, 40) == Place::next);
  CHECK(ledger.add(8, 1) == Place::next);
  CHECK(ledger.add(8, 3) == Place::ahead);
  REQUIRE(ledger.gaps().size() == 1);
  CHECK(ledger.gaps()[0].boot_id == 8);
  for (std::uint64_t boot = 100; boot < 200; ++boot) ledger.add(boot, 1);
  CHECK(ledger.gaps().empty());  // only the last starts are remembered
}

TEST_CASE("sequence ledger: a sender of odd numbers takes bounded memory and no time") {
  SequenceLedger ledger;
  for (std::uint64_t sequence = 1; sequence < 100'000; sequence += 2) ledger.add(7, sequence);
  ledger.announce(7, ~0ULL, 1);
  CHECK(ledger.gaps().size() == 16);
}

}  // namespace imprint
