#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "lib/result/result.h"
#include "lib/transport/transport.h"

namespace imprint {

/// What a node tells of the image its board runs, and how it passes on the wish for another: the node itself may
/// nothing but measure, so it leaves a line for the board's own service, which installs only what the plant has signed.
class BoardUpdate {
 public:
  /// `data_dir` is the node's; `root` that of the file system, another one in tests.
  explicit BoardUpdate(std::filesystem::path data_dir, std::filesystem::path root = "/")
      : data_dir_(std::move(data_dir)), root_(std::move(root)) {}

  /// `{"image_version", "slot", "slot_good", "update", "rolled_back"}`: which image from which slot, whether it has
  /// been judged good since this start, what became of the last wish, why the board went back to this slot. Of a
  /// machine that runs no image the first two are empty.
  [[nodiscard]] Result<Bytes> status() const;

  /// Takes the address of a bundle (http, https) or "rollback". Fails (invalid_input, job_failed) on anything else, on
  /// a machine that runs no image, and while one is being installed.
  Result<Bytes> want(std::string_view wish) const;

 private:
  [[nodiscard]] std::string slot() const;
  std::filesystem::path data_dir_;
  std::filesystem::path root_;
};

}  // namespace imprint
