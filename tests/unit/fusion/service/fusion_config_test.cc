#include "fusion/fusion_config.h"

#include <catch2/catch.hpp>

#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

Result<FusionConfig> read(const TemporaryFolder& folder, const std::string& text) {
  const auto path = folder.write("fusion.toml", text);
  const auto table = parse_toml_file(path);
  REQUIRE(table);
  return read_fusion_config(path, *table);
}

std::string fault(const std::string& text) {
  const TemporaryFolder folder;
  const auto config = read(folder, text);
  REQUIRE_FALSE(config);
  REQUIRE(config.error().exit_status() == 2);
  return config.error().message;
}

}  // namespace

TEST_CASE("fusion config: the rig is enough; it routes on this machine only and the page is this machine's only") {
  const TemporaryFolder folder;
  const auto config = read(folder, "[fusion]\nrig = \"rig.toml\"\n");
  REQUIRE(config);
  REQUIRE(config->zenoh.router);
  REQUIRE(config->zenoh.listen == std::vector<std::string>{"tcp/127.0.0.1:7447"});
  REQUIRE(config->page.address == "127.0.0.1");
  REQUIRE(config->database == folder / "imprint.db");
  REQUIRE(config->result_dir.empty());
}

TEST_CASE("fusion config: what is printed reads back as the same config") {
  const TemporaryFolder folder;
  const auto config = read(folder,
                           "[fusion]\nrig = \"rig.toml\"\nresult_dir = \"out\"\ndeadline_s = 2.5\n[page]\nport = 0\n"
                           "[rest]\naccept = true\nobservations = 3\nlead_ms = 250.0\n");
  REQUIRE(config);
  const auto again = read(folder, to_toml(*config));
  REQUIRE(again);
  REQUIRE(to_toml(*again) == to_toml(*config));
  REQUIRE(again->assembler.deadline_s == 2.5);
  REQUIRE(again->result_dir == folder / "out");
  REQUIRE(again->geometry == GeometryMethod::joint);
  REQUIRE(again->rest.accept);
  REQUIRE(again->rest.plan.observations == 3);
  REQUIRE(again->rest.lead_ms == 250.0);
}

#ifdef IMPRINT_POSTGRESQL
TEST_CASE("fusion config: where histories go is a connection string without a password") {
  const TemporaryFolder folder;
  const std::string rig = "[fusion]\nrig = \"r\"\n[history]\npostgresql = ";
  const auto config = read(folder, rig + "\"postgresql://imprint@db.plant/imprint\"\n");
  REQUIRE(config);
  CHECK(read(folder, to_toml(*config))->postgresql == "postgresql://imprint@db.plant/imprint");
  CHECK(read(folder, rig + "\"service=plant dbname=imprint\"\n"));
  const auto refused = fault(rig + "\"postgresql://imprint:hot-steel@db.plant/imprint\"\n");
  CHECK(refused.find("fusion.toml:4: history.postgresql: a password does not belong here") != std::string::npos);
  CHECK(refused.find("hot-steel") == std::string::npos);
  CHECK(fault(rig + "\"db.plant\"\n").find("expected postgresql://") != std::string::npos);
}
#else
TEST_CASE("fusion config: a program without PostgreSQL says so when histories are to go there") {
  CHECK(fault("[fusion]\nrig = \"r\"\n[history]\npostgresql = \"postgresql:///imprint\"\n")
            .find("built without PostgreSQL") != std::string::npos);
}
#endif

TEST_CASE("fusion config: a fault names the file, the line and the key") {
  REQUIRE(
      fault("[fusion]\nrig = \"r\"\ndeadline_s = 0\n").find("fusion.toml:3: fusion.deadline_s: expected more than 0") !=
      std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\n[page]\nport = 99999999999\n")
              .find("fusion.toml:4: page.port: expected 0 to 65535, found 99999999999") != std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\nsite = \"a/b\"\n").find("fusion.toml:3: fusion.site") != std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\ndead_line_s = 3\n").find("fusion.toml:3: fusion.dead_line_s: unknown key") !=
          std::string::npos);
  REQUIRE(
      fault("[fusion]\nrig = \"r\"\ngeometry = \"middle\"\n").find("fusion.geometry: expected one of joint, thesis") !=
      std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\n[rest]\nobservations = 0\n").find("observations: expected 1 to 64") !=
          std::string::npos);
  REQUIRE(fault("rig = \"r\"\n").find("unknown key") != std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\n[zenoh]\nlisten = [7447]\n").find("zenoh.listen: expected a list of texts") !=
          std::string::npos);
  REQUIRE(fault("[fusion]\nrig = \"r\"\n[zenoh]\nlisten = []\n").find("zenoh.listen") != std::string::npos);
}

}  // namespace imprint
