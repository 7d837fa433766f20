#include "fusion/fusion_line.h"

#include <system_error>
#include <vector>

#include "fusion/fusion_pipeline.h"
#include "lib/log/log.h"
#include "lib/service/log_document.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

// A folder, or a name that is free.
Result<void> check_result_dir(const FusionConfig& config) {
  std::error_code ignored;
  if (config.result_dir.empty() || std::filesystem::is_directory(config.result_dir, ignored)) return {};
  if (!std::filesystem::exists(config.result_dir, ignored)) return {};
  return invalid_input("fusion.result_dir: {}: expected a folder, found a file", config.result_dir.string());
}

}  // namespace

Result<std::unique_ptr<FusionLine>> FusionLine::read(FusionConfig config) {
  auto rig = read_rig(config.rig);
  if (!rig) return pass_on(rig.error());
  if (auto checked = check_result_dir(config); !checked) return pass_on(checked.error());
  return std::unique_ptr<FusionLine>(new FusionLine(std::move(config), std::move(*rig)));
}

Result<void> FusionLine::check() const { return SessionStore::check(config_.database); }

Result<void> FusionLine::open() {
  for (const std::string& warning : rig_.warnings) spdlog::warn("{}", warning);
  auto store = SessionStore::open(config_.database);
  if (!store) return pass_on(store.error());
  store_ = std::move(*store);
  std::vector<std::string> camera_ids;
  for (const CameraModel& camera : rig_.cameras) camera_ids.push_back(camera.id);
  board_ = std::make_unique<LineBoard>(LineBoard::Identity{config_.site, config_.line, config_.method, IMPRINT_VERSION},
                                       camera_ids, std::chrono::steady_clock::now(), config_.alarms);
  if (!config_.postgresql.empty())
    history_ = std::make_unique<HistoryExport>(postgres_copy(config_.postgresql), config_.site, config_.line, *store_,
                                               *board_);
  auto page = PageServer::start(config_.page, *board_, *store_, control_);
  if (!page) return pass_on(page.error());
  page_ = std::move(*page);
  spdlog::info("page of {} {}://{}:{}/", name(), config_.page.identity.empty() ? "http" : "https", config_.page.address,
               page_->port());
  if (config_.plc.input.empty()) return {};
  auto plc = PlcInput::start(config_.plc, control_);
  if (!plc) return pass_on(plc.error());
  plc_ = std::move(*plc);
  return {};
}

Result<void> FusionLine::connect(Transport& transport) {
  const auto keys = Keys::of(config_.site, config_.line);
  if (!keys) return pass_on(keys.error());
  service_.emplace(config_, rig_, transport, *store_, *board_,
                   [geometry = config_.geometry](const auto& observations, const ForgingSpec& forging,
                                                 std::string session, std::string method) {
                     return fuse(observations, forging, std::move(session), std::move(method), geometry);
                   });
  if (auto started = service_->start(); !started) return pass_on(started.error());
  auto desk = DocumentDesk::open(transport, {{keys->fusion_service("log"), log_document}});
  if (!desk) return pass_on(desk.error());
  desk_ = std::move(*desk);
  control_.connect([this](const Trigger& trigger) { return service_->fire(trigger); });
  spdlog::info("fusion of {} ready, {} cameras", name(), rig_.cameras.size());
  return {};
}

void FusionLine::disconnect() {
  if (!service_) return;
  control_.disconnect();
  desk_.reset();
  service_->stop();
  service_.reset();
  for (const CameraModel& camera : rig_.cameras) board_->set_alive(camera.id, false);  // who is let in again says so
}

}  // namespace imprint
