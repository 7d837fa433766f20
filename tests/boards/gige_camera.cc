// A GigE Vision camera that shows one picture: gige_camera INTERFACE SERIAL PICTURE [LOST_PER_MILLE]. Runs until it is
// killed. Aravis' own fake camera, its sensor made as large as the picture.
#include <arv.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>

#include "node/capture/image_file.h"

int main(int argc, char** argv) {
  if (argc < 4) {
    std::cerr << "usage: gige_camera INTERFACE SERIAL PICTURE [LOST_PER_MILLE]\n";
    return 2;
  }
  const auto picture = imprint::read_image(argv[3], nullptr);
  if (!picture || picture->image.depth() != CV_8U) {
    std::cerr << "gige_camera: " << (picture ? "expected 8 bit" : picture.error().message) << '\n';
    return 2;
  }
  const double lost_ratio = argc > 4 ? 0.001 * std::atof(argv[4]) : 0.0;
  auto* camera = ARV_GV_FAKE_CAMERA(g_object_new(ARV_TYPE_GV_FAKE_CAMERA, "interface-name", argv[1], "serial-number",
                                                 argv[2], "gvsp-lost-ratio", lost_ratio, nullptr));
  if (arv_gv_fake_camera_is_running(camera) == 0) {
    std::cerr << "gige_camera: cannot serve on " << argv[1] << '\n';
    return 1;
  }
  ArvFakeCamera* sensor = arv_gv_fake_camera_get_fake_camera(camera);
  arv_fake_camera_write_register(sensor, ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH,
                                 static_cast<guint32>(picture->image.cols));
  arv_fake_camera_write_register(sensor, ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT,
                                 static_cast<guint32>(picture->image.rows));
  arv_fake_camera_set_fill_pattern(
      sensor,
      [](ArvBuffer* buffer, void* shown, guint32, guint32, ArvPixelFormat) {
        const auto& image = *static_cast<const cv::Mat*>(shown);
        auto* bytes = static_cast<std::uint8_t*>(const_cast<void*>(arv_buffer_get_data(buffer, nullptr)));
        const std::size_t pixels = static_cast<std::size_t>(arv_buffer_get_image_width(buffer)) *
                                   static_cast<std::size_t>(arv_buffer_get_image_height(buffer));
        std::copy_n(image.data, std::min(pixels, image.total()), bytes);
      },
      const_cast<cv::Mat*>(&picture->image));
  std::cout << "serving " << argv[2] << std::endl;
  while (true) g_usleep(1'000'000);
}
