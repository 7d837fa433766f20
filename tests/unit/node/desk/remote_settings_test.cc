#include "node/service/remote_settings.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using Lines = std::vector<std::string>;

template <class Settings>
std::string value_of(Settings&& settings) {
  toml::table table = toml::parse("[exposure]\nauto = true\n");
  REQUIRE(settings.lay_over(table));
  return table.at_path("exposure.auto").value_or(true) ? "own" : "from afar";
}

}  // namespace

TEST_CASE("settings: on trial for one start, kept when that start accepts them") {
  const TemporaryFolder folder;
  REQUIRE(RemoteSettings::open(folder.path())->propose({"exposure.auto=false"}));
  auto trial = RemoteSettings::open(folder.path());
  REQUIRE(value_of(*trial) == "from afar");
  REQUIRE(trial->on_trial());
  REQUIRE(trial->accept());
  auto later = RemoteSettings::open(folder.path());
  REQUIRE(value_of(*later) == "from afar");
  REQUIRE_FALSE(later->on_trial());
  REQUIRE(later->kept() == Lines{"exposure.auto=false"});
}

TEST_CASE("settings: a start that ends while it tries them is their end, and says so") {
  const TemporaryFolder folder;
  REQUIRE(RemoteSettings::open(folder.path())->propose({"exposure.auto=false"}));
  REQUIRE(value_of(*RemoteSettings::open(folder.path())) == "from afar");
  auto next = RemoteSettings::open(folder.path());  // the one before was killed
  REQUIRE(value_of(*next) == "own");
  REQUIRE_FALSE(next->on_trial());
  REQUIRE_FALSE(next->refused().empty());
  REQUIRE(value_of(*RemoteSettings::open(folder.path())) == "own");
}

TEST_CASE("settings: rolled back, the earlier ones stand") {
  const TemporaryFolder folder;
  REQUIRE(RemoteSettings::open(folder.path())->propose({"exposure.auto=false"}));
  auto first = RemoteSettings::open(folder.path());
  value_of(*first);
  REQUIRE(first->accept());
  REQUIRE(first->propose({"exposure.auto=true"}));
  auto second = RemoteSettings::open(folder.path());
  REQUIRE(value_of(*second) == "own");
  second->roll_back("fusion was not found");
  auto third = RemoteSettings::open(folder.path());
  REQUIRE(value_of(*third) == "from afar");
  REQUIRE(third->refused() == "fusion was not found");
}

TEST_CASE("settings: the newer of one key replaces the older; what makes another node of it is refused") {
  const TemporaryFolder folder;
  const auto settings = RemoteSettings::open(folder.path());
  REQUIRE(*settings->with({"spool.max_mb=1", "health.period_s=2", "spool.max_mb=3"}) ==
          Lines{"health.period_s=2", "spool.max_mb=3"});
  for (const char* assignment : {"node.camera_id=cam2", "node.site=x", "node.data_dir=/x", "zenoh.identity=/x",
                                 "zenoh.insecure=true", "exposure.auto", "=1", "auto=1", "a.b=1\nnode.site=x"})
    REQUIRE_FALSE(settings->with({assignment}));
}

}  // namespace imprint
