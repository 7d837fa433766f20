#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "lib/result/result.h"

namespace imprint {

inline constexpr std::size_t kMaxIdBytes = 64;

/// Checks an id that becomes a chunk of a key (site, line, camera, session) and perhaps a file name:
/// 1 to 64 of A-Z a-z 0-9 . _ -, not beginning with '.' or '-'. Fails (invalid_input) naming `what` and the id.
Result<void> check_id(std::string_view what, std::string_view id);

/// The keys of one line, contract section 4. The ids given are taken as checked.
class Keys {
 public:
  static constexpr std::string_view kAny = "*";  ///< for every camera or every session

  /// Fails (invalid_input) when site or line is no id.
  static Result<Keys> of(std::string_view site, std::string_view line);

  [[nodiscard]] std::string imprint(std::string_view camera_id = kAny) const;
  [[nodiscard]] std::string health(std::string_view camera_id = kAny) const;
  [[nodiscard]] std::string alive(std::string_view camera_id = kAny) const;
  [[nodiscard]] std::string receipt(std::string_view camera_id) const;
  [[nodiscard]] std::string rest(std::string_view camera_id = kAny) const;
  [[nodiscard]] std::string delivery(std::string_view camera_id = kAny) const;
  /// `name`: config, log, crop, targets or calibration.
  [[nodiscard]] std::string service(std::string_view camera_id = kAny, std::string_view name = kAny) const;
  [[nodiscard]] std::string trigger() const;
  [[nodiscard]] std::string result(std::string_view session = kAny) const;
  /// `name`: status or result, answered by the fusion node.
  [[nodiscard]] std::string fusion_service(std::string_view name) const;
  [[nodiscard]] std::string fusion_alive() const;
  [[nodiscard]] std::string everything() const;  ///< all of the line

  /// The camera's id in a key of this line such as `.../cam/<id>/imprint`; none when it is no camera's key.
  [[nodiscard]] std::optional<std::string> camera_of(std::string_view key) const;

 private:
  explicit Keys(std::string root) : root_(std::move(root)) {}
  [[nodiscard]] std::string camera(std::string_view camera_id, std::string_view leaf) const;

  std::string root_;
};

}  // namespace imprint
