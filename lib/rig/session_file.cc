#include "lib/rig/session_file.h"

#include <algorithm>

#include "lib/config/toml_file.h"
#include "lib/config/unknown_keys.h"

namespace imprint {

Result<SessionFile> read_session_file(const std::filesystem::path& path) {
  std::vector<std::string> ignored;
  return read_session_file(path, ignored);
}

Result<SessionFile> read_session_file(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  const auto table = parse_toml_file(path);
  if (!table) return pass_on(table.error());
  TomlReader read(path, *table);
  SessionFile session;
  session.rig = read.path("rig");
  note_unknown_keys(path, *table, "", {"rig", "observation"}, warnings);
  int number = 0;
  for (const toml::table* entry : read.tables("observation")) {
    TomlReader read_entry(path, *entry, fmt::format("observation[{}].", number++));
    SessionObservation observation;
    observation.rotation_deg = read_entry.number("rotation_deg", 0.0);
    note_unknown_keys(path, *entry, fmt::format("observation[{}].", number - 1), {"rotation_deg", "images"}, warnings);
    const auto images = entry->at_path("images");
    if (!images.is_table()) {
      read_entry.fault("images", "missing, expected the table [observation.images] with one file a camera");
    } else {
      TomlReader read_images(path, *images.as_table(), fmt::format("observation[{}].images.", number - 1));
      for (const auto& [camera, file] : *images.as_table()) {
        const auto image = read_images.path(camera.str());
        const auto same = std::ranges::find(observation.images, image, [](const auto& known) { return known.second; });
        if (same != observation.images.end()) {
          read_images.fault(camera.str(), fmt::format("expected an image of its own, found that of {}", same->first));
        }
        observation.images[std::string(camera.str())] = image;
      }
      if (read_images.error()) return pass_on(*read_images.error());
    }
    if (read_entry.error()) return pass_on(*read_entry.error());
    session.observations.push_back(std::move(observation));
  }
  if (read.error()) return pass_on(*read.error());
  if (session.observations.empty()) {
    return invalid_input("{}: expected at least one [[observation]], found none", path.string());
  }
  return session;
}

}  // namespace imprint
