#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include <httplib.h>

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/fleet_update.h"
#include "cli/line_link.h"
#include "lib/service/document_reader.h"

namespace imprint {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr auto kLook = seconds(2);  // between two looks at a board that changes
// A board fetches a thin bundle's pieces from the store beside it: RAUC takes its address from the bundle's.
constexpr const char* kBundlePath = "/bundle.raucb";
constexpr const char* kThinBundlePath = "/bundle.thin.raucb";
constexpr const char* kThinStorePath = "/bundle.thin.castr";

struct FleetOptions {
  LineOptions line;
  std::vector<std::string> cameras;
  std::string bundle;
  std::string version;
  std::string serve;  // host:port
  double timeout_s = 20.0;
  int board_timeout_s = 1200;
};

milliseconds timeout_of(double timeout_s) { return milliseconds(static_cast<std::int64_t>(1000.0 * timeout_s)); }

/// Boards of a running line, asked over Zenoh.
class LineBoards final : public Boards {
 public:
  LineBoards(const LineLink& link, double timeout_s) : link_(link), timeout_(timeout_of(timeout_s)) {}

  BoardState state(const std::string& camera_id) override {
    BoardState state;
    state.camera_id = camera_id;
    const auto bytes = ask(camera_id, "firmware", "");
    const json found = bytes ? json::parse(*bytes, nullptr, false) : json();
    if (!found.is_object()) {
      state.fault = bytes ? "answered with something that is no JSON" : bytes.error().message;
      return state;
    }
    state.version = found.value("image_version", "");
    state.slot = found.value("slot", "");
    state.slot_good = found.value("slot_good", false);
    state.update = found.value("update", "");
    state.rolled_back = found.value("rolled_back", "");
    return state;
  }

  Result<void> want(const std::string& camera_id, const std::string& wish) override {
    if (const auto taken = ask(camera_id, "update", wish); !taken)
      return job_failed("{}: {}", camera_id, taken.error().message);
    return {};
  }

  void pause() override { std::this_thread::sleep_for(kLook); }
  std::chrono::steady_clock::time_point now() override { return std::chrono::steady_clock::now(); }

 private:
  [[nodiscard]] Result<Bytes> ask(const std::string& camera_id, const std::string& service,
                                  const std::string& payload) const {
    return read_document(link_.transport(), link_.keys().service(camera_id, service), "",
                         Bytes(payload.begin(), payload.end()), timeout_);
  }

  const LineLink& link_;
  milliseconds timeout_;
};

/// Serves the bundle to the boards while they are changed.
class BundleServer {
 public:
  BundleServer() = default;
  BundleServer(const BundleServer&) = delete;
  BundleServer& operator=(const BundleServer&) = delete;
  ~BundleServer() {
    server_.stop();
    if (thread_.joinable()) thread_.join();
  }

  /// Gives the bundle's address.
  Result<std::string> start(const std::string& bundle, const std::string& address) {
    const auto colon = address.rfind(':');
    if (colon == std::string::npos) return invalid_input("--serve: expected HOST:PORT, found \"{}\"", address);
    const std::string host = address.substr(0, colon);
    const int port = std::atoi(address.c_str() + colon + 1);
    std::error_code failed;
    const auto size = std::filesystem::file_size(bundle, failed);
    if (failed) return invalid_input("{}: {}", bundle, failed.message());
    const bool thin = bundle.ends_with(".thin.raucb");
    const auto store = std::filesystem::path(bundle).replace_extension(".castr");
    if (thin && !server_.set_mount_point(kThinStorePath, store.string()))
      return invalid_input("{}: expected the store of its pieces beside it, {} is no folder", bundle, store.string());
    server_.set_logger(
        [this](const httplib::Request&, const httplib::Response& response) { sent_bytes_ += response.body.size(); });
    server_.Get(thin ? kThinBundlePath : kBundlePath,
                [this, bundle, size](const httplib::Request&, httplib::Response& response) {
                  auto file = std::make_shared<std::ifstream>(bundle, std::ios::binary);
                  response.set_content_provider(
                      size, "application/octet-stream",
                      [this, file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                        std::vector<char> piece(std::min<std::size_t>(length, 1 << 16));
                        file->seekg(static_cast<std::streamoff>(offset));
                        file->read(piece.data(), static_cast<std::streamsize>(piece.size()));
                        sent_bytes_ += static_cast<std::uint64_t>(file->gcount());
                        return file->gcount() > 0 && sink.write(piece.data(), static_cast<std::size_t>(file->gcount()));
                      });
                });
    if (port < 1 || port > 65'535 || !server_.bind_to_port("0.0.0.0", port))
      return job_failed("--serve: port {} cannot be opened", address.substr(colon + 1));
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    return fmt::format("http://{}:{}{}", host, port, thin ? kThinBundlePath : kBundlePath);
  }

  [[nodiscard]] double sent_mb() const { return 1e-6 * static_cast<double>(sent_bytes_.load()); }

 private:
  std::atomic<std::uint64_t> sent_bytes_{0};
  httplib::Server server_;
  std::thread thread_;
};

json to_json(const BoardState& state) {
  return {{"camera", state.camera_id},    {"image_version", state.version}, {"slot", state.slot},
          {"slot_good", state.slot_good}, {"update", state.update},         {"rolled_back", state.rolled_back},
          {"fault", state.fault}};
}

// Those named, or all of the line that are there.
Result<std::vector<std::string>> cameras_of(const LineLink& link, const FleetOptions& options) {
  if (!options.cameras.empty()) return options.cameras;
  const auto status = link.ask("status", "", timeout_of(options.timeout_s));
  if (!status) return pass_on(status.error());
  std::vector<std::string> cameras;
  for (const json& camera : status->value("cameras", json::array()))
    if (camera.value("alive", false)) cameras.push_back(camera.value("id", ""));
  if (cameras.empty()) return job_failed("no camera of {}/{} is connected", options.line.site, options.line.line);
  return cameras;
}

int run_status(const FleetOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const auto cameras = cameras_of(*link, options);
  if (!cameras) return fail(cameras.error());
  LineBoards boards(*link, options.timeout_s);
  json all = json::array();
  bool complete = true;
  for (const std::string& camera : *cameras) {
    const BoardState state = boards.state(camera);
    complete = complete && state.fault.empty();
    all.push_back(to_json(state));
    if (as_json) continue;
    const std::string image = state.slot.empty() ? "no board image"
                                                 : fmt::format("{} from slot {}{}", state.version, state.slot,
                                                               state.slot_good ? ", good" : ", not judged yet");
    std::cout << fmt::format("{:<10} {}{}{}\n", camera, state.fault.empty() ? image : state.fault,
                             state.update.empty() ? "" : "; " + state.update,
                             state.rolled_back.empty() ? "" : "; rolled back: " + state.rolled_back);
  }
  if (as_json) print_json({{"boards", all}});
  return complete ? 0 : 1;
}

int change(const FleetOptions& options, const FleetChange& change, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const auto cameras = cameras_of(*link, options);
  if (!cameras) return fail(cameras.error());
  LineBoards boards(*link, options.timeout_s);
  const auto done = change_fleet(boards, *cameras, change, [&](const std::string& line) { std::cerr << line << '\n'; });
  if (as_json) {
    json all = json::array();
    for (const std::string& camera : *cameras) all.push_back(to_json(boards.state(camera)));
    print_json({{"boards", all}, {"error", done ? "" : done.error().message}});
  }
  return done ? 0 : fail(done.error());
}

int run_update(const FleetOptions& options, bool as_json) {
  BundleServer server;
  const auto address = server.start(options.bundle, options.serve);
  if (!address) return fail(address.error());
  const int status = change(options, {*address, options.version, seconds(options.board_timeout_s)}, as_json);
  std::cerr << fmt::format("{:.1f} MB were fetched\n", server.sent_mb());
  return status;
}

}  // namespace

void add_fleet_command(Cli& cli) {
  auto options = std::make_shared<FleetOptions>();
  CLI::App* fleet =
      cli.app.add_subcommand("fleet", "the boards' images: what they run, update, rollback (docs/boards.md)");
  fleet->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, int (*run)(const FleetOptions&, bool)) {
    CLI::App* sub = cli.command(*fleet, name, help, [&cli, options, run] { return run(*options, cli.json); });
    add_line_options(*sub, options->line);
    sub->add_option("--camera", options->cameras, "only this board, or these in this order; repeat")
        ->expected(1)
        ->take_all();
    sub->add_option("--timeout", options->timeout_s, "s to wait for an answer")
        ->check(between(0.1, 600))
        ->capture_default_str();
    return sub;
  };
  add("status", "which image each board runs", run_status);
  CLI::App* update = add("update", "one board after the other, the next only when the one before is good", run_update);
  update->add_option("--bundle", options->bundle, "signed bundle of ./dev image")->required();
  update->add_option("--version", options->version, "the image it holds")->required();
  update->add_option("--serve", options->serve, "HOST:PORT at which the boards reach this machine")->required();
  CLI::App* rollback =
      add("rollback", "back to the other slot, one board after the other", [](const FleetOptions& given, bool as_json) {
        return change(given, {"rollback", "", seconds(given.board_timeout_s)}, as_json);
      });
  for (CLI::App* sub : {update, rollback})
    sub->add_option("--board-timeout", options->board_timeout_s, "s in which a board must be good")
        ->check(between(10, 86'400))
        ->capture_default_str();
}

}  // namespace imprint
