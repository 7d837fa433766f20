// Every message that comes over the network.
#include "lib/wire/wire.h"
#include "tests/fuzz/fuzz.h"

namespace imprint {
namespace {

std::string text_of(const std::vector<std::uint8_t>& bytes) { return {bytes.begin(), bytes.end()}; }

Imprint good_imprint() {
  Imprint imprint;
  imprint.camera_id = "cam1";
  imprint.session = "S-1";
  imprint.method = "best";
  imprint.grid.start_px = -900.0;
  imprint.grid.step_px = 3.6;
  for (ImprintCurve* curve : {&imprint.upper, &imprint.lower, &imprint.axis}) {
    for (std::size_t i = 0; i < kImprintStations; ++i) {
      curve->offset_px.push_back(100.0 + 0.01 * static_cast<double>((i * i) % 97));
      curve->weight.push_back(i % 7 == 0 ? 0.0 : 0.5);
    }
  }
  return imprint;
}

void take(std::span<const std::uint8_t> bytes) {
  if (const auto imprint = decode_imprint(bytes)) (void)encode_imprint(*imprint);
  if (const auto trigger = decode_trigger(bytes)) (void)encode_trigger(*trigger);
  if (const auto health = decode_health(bytes)) (void)encode_health(*health);
  if (const auto receipt = decode_receipt(bytes)) (void)encode_receipt(*receipt);
  if (const auto delivery = decode_delivery(bytes)) (void)encode_delivery(*delivery);
  if (const auto question = decode_clock_question(bytes)) (void)encode_clock_question(*question);
  if (const auto reading = decode_clock_reading(bytes)) (void)encode_clock_reading(*reading);
  if (const auto chunk = decode_chunk(bytes)) (void)encode_chunk(*chunk);
  if (const auto result = decode_result(bytes)) (void)encode_result(*result);
}

}  // namespace
}  // namespace imprint

int main(int argc, char** argv) {
  using namespace imprint;
  Health health;
  health.camera_id = "cam1";
  health.housing_temperature_c = 41.0;
  return fuzz({"wire",
               {text_of(encode_imprint(good_imprint())), text_of(encode_health(health)),
                text_of(encode_trigger({.session = "S-1", .observation = 3, .rotation_deg = 60.0})),
                text_of(encode_receipt({"cam1", 7, 8, "why"})), text_of(encode_chunk({1, 10, 2, {3, 4}})),
                text_of(encode_result({"S-1", true, "", R"({"length_mm": 1})"}))},
               take},
              argc, argv);
}
