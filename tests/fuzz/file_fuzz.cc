// Every file that a person or another program may hand us: file_fuzz KIND.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>

#include "fusion/fusion_config.h"
#include "lib/access/access_list.h"
#include "lib/access/user_list.h"
#include "lib/camera/camera_file.h"
#include "lib/rig/rig.h"
#include "lib/targets/target_field.h"
#include "lib/targets/target_library.h"
#include "node/node_config.h"
#include "tests/fuzz/fuzz.h"
#include "tests/unit/temporary_folder.h"

namespace imprint {
namespace {

using Path = std::filesystem::path;

struct Kind {
  std::vector<std::string> seeds;
  std::function<void(const Path&)> read;
};

void read_configs(const Path& path) {
  const auto table = parse_toml_file(path);
  if (!table) return;
  if (const auto node = read_node_config(path, *table)) (void)to_toml(*node);
  if (const auto fusion = read_fusion_config(path, *table)) (void)to_toml(*fusion);
}

const std::map<std::string, Kind>& kinds() {
  static const std::map<std::string, Kind> all = {
      {"config",
       {{"[node]\ncamera_id = \"cam1\"\nrig = \"rig.toml\"\nsite = \"plant\"\n[capture]\nsource = \"folder\"\npath = "
         "\".\"\n[exposure]\nauto = true\n"
         "min_us = 20.0\n[zenoh]\nconnect = [\"tcp/127.0.0.1:7447\"]\n[health]\nperiod_s = 5.0\nhousing_temperature = "
         "\"simulated\"\n[spool]\nmax_mb = 5\n",
         "[fusion]\nrig = \"rig.toml\"\ndeadline_s = 10.0\nmethod = \"best\"\n[zenoh]\nlisten = "
         "[\"tcp/127.0.0.1:7447\"]\n[page]\naddress = \"127.0.0.1\"\n"
         "port = 8080\n[alarm]\nmax_blur_px = 3.0\nrecords = 3\n"},
        read_configs}},
      {"library",
       {{R"({"schema": "imprint.library/1", "bits": 15, "min_distance": 4, "geometry": {"dot_radius": 1.0, "ring_inner_radius": 2.0,)"
         R"( "ring_outer_radius": 3.0}, "codes": [{"id": 1, "code": "000010110011101"}, {"id": 2, "code": "000000110011101"}]})"},
        [](const Path& path) { (void)read_target_library(path); }}},
      {"field",
       {{"id,x_mm,y_mm,z_mm\n1,0.0,0.0,0.0\n2,100.5,-3,1e2\n",
         "id,x_mm,y_mm,z_mm,sigma_mm\n1,0,0,0,0.05\n2,1,2,3,0.1\n"},
        [](const Path& path) { (void)read_target_field(path); }}},
      {"session",
       {{"rig = \"rig.toml\"\n[[observation]]\nrotation_deg = 0.0\n[observation.images]\ncam1 = \"a.png\"\ncam2 = "
         "\"b.png\"\n[[observation]]\n"
         "rotation_deg = 60.0\n[observation.images]\ncam1 = \"c.png\"\n"},
        [](const Path& path) { (void)read_session_file(path); }}},
      {"rig",
       {{"field = \"field.csv\"\nlibrary = \"library.json\"\n[[camera]]\nid = \"cam1\"\ncalibration = "
         "\"cam1.toml\"\n[forging]\n"
         "diameter_mm = [150.0, 340.0]\naxis_direction = [1.0, 0.0, 0.0]\nend_section_mm = 80.0\npolarity = "
         "\"bright\"\n",
         "[camera]\nid = \"cam1\"\nwidth_px = 4656\nheight_px = 3520\npixel_pitch_um = 3.8\nfocal_length_px = "
         "5722.79\nprincipal_point_px = [2367.8, 1736.88]\n"
         "[distortion]\nmodel = \"balanced\"\nr0 = 0.6666667\nradial = [0.1, 0.0, 0.0]\ntangential = [0.0, "
         "0.0]\naffine = [0.0, 0.0]\n"},
        [](const Path& path) {
          (void)read_rig(path);
          (void)read_camera_file(path);
        }}},
      {"access",
       {{R"({"schema": "imprint.access/1", "plant": "p", "certificates": [{"name": "cam1", "common_name": "cam1.0a", "serial": "0a", "role": "camera",)"
         R"( "site": "plant", "line": "L1", "not_after_ns": 5, "revoked_ns": 0}]})",
         R"({"schema": "imprint.users/1", "users": [{"name": "otto", "role": "operator", "hash": "$y$j9T$abc"}]})"},
        [](const Path& path) {
          if (const auto list = read_access_list(path)) (void)access_rules(*list);
          (void)read_user_list(path);
        }}}};
  return all;
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  using namespace imprint;
  const auto kind = kinds().find(argc > 1 ? argv[1] : "");
  if (kind == kinds().end()) {
    std::cerr << "file_fuzz: expected one of";
    for (const auto& [name, ignored] : kinds()) std::cerr << ' ' << name;
    std::cerr << '\n';
    return 2;
  }
  const TemporaryFolder folder;
  const std::filesystem::path file = folder / "input";
  const auto take = [&](std::span<const std::uint8_t> bytes) {
    std::ofstream(file, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    kind->second.read(file);
  };
  return fuzz({kind->first, kind->second.seeds, take}, argc - 1, argv + 1);
}
