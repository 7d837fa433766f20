#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

namespace imprint::paper {

/// Kinds of frames without coded targets: what a camera in a hall, a laboratory or an office sees. Look-alikes, targets
/// of no library, stand apart: some of them are nearer to a code than a soiled target is.
enum class Clutter { shapes, print, circuit, machines, gauges, hall, texture, grids, photographs, look_alikes };

struct NamedClutter {
  Clutter kind;
  std::string_view name;
};
inline constexpr std::array counted_clutter{
    NamedClutter{Clutter::shapes, "shapes"},     NamedClutter{Clutter::print, "print"},
    NamedClutter{Clutter::circuit, "circuit"},   NamedClutter{Clutter::machines, "machines"},
    NamedClutter{Clutter::gauges, "gauges"},     NamedClutter{Clutter::hall, "hall"},
    NamedClutter{Clutter::texture, "texture"},   NamedClutter{Clutter::grids, "grids"},
    NamedClutter{Clutter::photographs, "photos"}};
inline constexpr NamedClutter look_alikes{Clutter::look_alikes, "lookalikes"};

/// Photographs without the squares round their coded targets, to be cut into pieces.
struct PhotographPieces {
  std::vector<cv::Mat> pieces;  ///< square, 8 bit
};

/// Pieces of the CERN panel's photographs in which no coded target has a part, by the places in visible.csv. Empty
/// where the folder has no such file.
PhotographPieces cut_photographs(const std::filesystem::path& cern_panel);

/// A frame of 8 bit: things of one kind drawn with `seed`, seen through a lens of some blur in uneven light, with
/// noise. Photographs need pieces.
cv::Mat draw_clutter_frame(Clutter kind, int width, int height, std::uint64_t seed, const PhotographPieces& pieces);

/// The drawings behind it: 32-bit floats, black 0 to white 1, before lens, light and noise.
cv::Mat draw_print(int width, int height, cv::RNG& random);
cv::Mat draw_circuit(int width, int height, cv::RNG& random);
cv::Mat draw_grids(int width, int height, cv::RNG& random);
cv::Mat draw_machines(int width, int height, cv::RNG& random);
cv::Mat draw_gauges(int width, int height, cv::RNG& random);
cv::Mat draw_hall(int width, int height, cv::RNG& random);
cv::Mat draw_texture(int width, int height, cv::RNG& random);
cv::Mat draw_photographs(int width, int height, cv::RNG& random, const PhotographPieces& pieces);

}  // namespace imprint::paper
