// Publishes a known imprint ten times a second until its stdin ends, as a router on a free port of the loopback.
// Writes what it sends to the JSON file given, then one JSON line with endpoint and key to stdout.

#include <poll.h>
#include <unistd.h>

#include <fstream>
#include <iostream>

#include <nlohmann/json.hpp>

#include "lib/wire/keys.h"
#include "lib/wire/wire.h"
#include "tests/unit/lib/transport/plants.h"
#include "tests/unit/lib/wire/sample_imprint.h"

namespace {

using namespace imprint;

nlohmann::json curve_json(const ImprintCurve& curve) {
  return {{"offset_px", curve.offset_px}, {"weight", curve.weight}};
}

/// What the client shall find: the imprint as it was before it was encoded, with the contract's tolerances.
nlohmann::json expectation(const Imprint& imprint) {
  return {{"schema_version", 1},
          {"camera_id", imprint.camera_id},
          {"session", imprint.session},
          {"observation", imprint.observation},
          {"rotation_deg", imprint.rotation_deg},
          {"boot_id", imprint.boot_id},
          {"sequence", imprint.sequence},
          {"sensor_time_ns", imprint.sensor_time_ns},
          {"focal_length_px", imprint.focal_length_px},
          {"method", imprint.method},
          {"failure", ""},
          {"max_bytes", kMaxImprintBytes},
          {"offset_tolerance_px", 0.002},
          {"weight_tolerance", 0.5 / 255 + 1e-12},  // half a step of the weights
          {"curves",
           {{"upper", curve_json(imprint.upper)},
            {"lower", curve_json(imprint.lower)},
            {"axis", curve_json(imprint.axis)}}}};
}

bool stdin_ended(int wait_ms) {
  pollfd input{STDIN_FILENO, POLLIN | POLLHUP, 0};
  char byte = 0;
  return poll(&input, 1, wait_ms) > 0 && read(STDIN_FILENO, &byte, 1) <= 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: python_client_publisher EXPECT.json\n";
    return 2;
  }
  std::mt19937 random(20261122);
  // Filtered curves with steps, untrusted points among them.
  const Imprint imprint = test::sample_imprint(random, {0.05, 25.0, 8, 0.05, false});
  std::ofstream(argv[1]) << expectation(imprint);

  const std::string endpoint = "tcp/127.0.0.1:" + std::to_string(test::free_port());
  const auto transport = open_zenoh({.listen = {endpoint}, .router = true});
  const auto keys = Keys::of("test", "line");
  if (!transport || !keys) {
    std::cerr << (transport ? keys.error() : transport.error()).message << "\n";
    return 1;
  }
  const auto publisher = (*transport)->publish(keys->imprint(imprint.camera_id), {.traffic = Traffic::imprint});
  std::cout << nlohmann::json{{"endpoint", endpoint}, {"key", keys->imprint()}} << std::endl;
  while (publisher && !stdin_ended(100)) {
    if (auto sent = (*publisher)->put(encode_imprint(imprint)); !sent) {
      std::cerr << sent.error().message << "\n";
      return 1;
    }
  }
  return publisher ? 0 : 1;
}
