#include "node/service/board_update.h"

#include <algorithm>
#include <cctype>

#include <nlohmann/json.hpp>

#include "lib/config/atomic_file.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxAddressBytes = 500;

// The file's one line; empty when there is none.
std::string line_of(const std::filesystem::path& path) {
  auto text = read_file(path);
  if (!text) return {};
  text->resize(std::min(text->size(), text->find('\n')));
  return std::move(*text);
}

bool is_bundle_address(std::string_view text) {
  const bool web = text.starts_with("http://") || text.starts_with("https://");
  const auto plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
           std::string_view(":/._+-~%").find(c) != std::string_view::npos;
  };
  return web && text.size() <= kMaxAddressBytes && std::ranges::all_of(text, plain);
}

}  // namespace

// The kernel's command line is hidden from the node; the board has written down what it says.
std::string BoardUpdate::slot() const { return line_of(root_ / "run/imprint/slot"); }

Result<Bytes> BoardUpdate::status() const {
  const std::string text = nlohmann::json{{"schema", "imprint.firmware/1"},
                                          {"image_version", line_of(root_ / "etc/imprint-version")},
                                          {"slot", slot()},
                                          {"slot_good", line_of(root_ / "run/imprint/slot-state") == "good"},
                                          {"update", line_of(data_dir_ / "update-state")},
                                          {"rolled_back", line_of(data_dir_ / "rolled-back")}}
                               .dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  return Bytes(text.begin(), text.end());
}

Result<Bytes> BoardUpdate::want(std::string_view wish) const {
  if (wish != "rollback" && !is_bundle_address(wish))
    return invalid_input("expected the address of a bundle (http://...) or rollback, found \"{}\"",
                         wish.substr(0, kMaxAddressBytes));
  if (slot().empty()) return job_failed("this machine runs no board image: there is nothing to update");
  if (line_of(data_dir_ / "update-state").starts_with("installing"))
    return job_failed("an update is being installed at this moment");
  if (auto asked = write_file_atomically(data_dir_ / "update-state", "asked for\n"); !asked)  // no old answer stays
    return pass_on(asked.error());
  if (auto written = write_file_atomically(data_dir_ / "update-wanted", std::string(wish) + "\n"); !written)
    return pass_on(written.error());
  return status();
}

}  // namespace imprint
