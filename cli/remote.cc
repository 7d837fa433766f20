#include <fstream>
#include <thread>

#include "cli/command.h"
#include "cli/command_line.h"
#include "cli/line_link.h"
#include "lib/config/atomic_file.h"
#include "lib/config/toml_file.h"
#include "lib/service/document_reader.h"

namespace imprint {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

struct RemoteOptions {
  LineOptions line;
  std::string camera;
  double timeout_s = 30.0;
  int lines = 40;
  std::string region;
  int target = 0;
  bool has_target = false;
  int bytes = 3600;
  bool stretch = false;
  std::string out;
  std::string key;
  std::vector<std::string> assignments;
  bool check = false;
  double wait_s = 90.0;
};

milliseconds timeout_of(double seconds) { return milliseconds(static_cast<std::int64_t>(seconds * 1000.0)); }

Result<Bytes> ask(const LineLink& link, const RemoteOptions& options, const std::string& service,
                  const std::string& parameters, const std::string& payload = "") {
  const Bytes bytes(payload.begin(), payload.end());
  return read_document(link.transport(), link.keys().service(options.camera, service), parameters, bytes,
                       timeout_of(options.timeout_s));
}

Result<json> ask_json(const LineLink& link, const RemoteOptions& options, const std::string& service,
                      const std::string& parameters = "", const std::string& payload = "") {
  const auto document = ask(link, options, service, parameters, payload);
  if (!document) return pass_on(document.error());
  auto parsed = json::parse(*document, nullptr, false);
  if (!parsed.is_object())
    return job_failed("camera {} answered {} with something that is no JSON", options.camera, service);
  return parsed;
}

int run_log(const RemoteOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const std::string key =
      options.camera.empty() ? link->keys().fusion_service("log") : link->keys().service(options.camera, "log");
  const auto text =
      read_document(link->transport(), key, fmt::format("lines={}", options.lines), {}, timeout_of(options.timeout_s));
  if (!text) return fail(text.error());
  const std::string log(text->begin(), text->end());
  if (as_json) return print_json({{"of", options.camera.empty() ? "fusion" : options.camera}, {"log", log}});
  std::cout << log;
  return 0;
}

std::string crop_parameters(const RemoteOptions& options) {
  std::string parameters = fmt::format("bytes={}", options.bytes);
  if (!options.region.empty()) parameters += ";region=" + options.region;
  if (options.has_target) parameters += fmt::format(";target={}", options.target);
  if (options.stretch) parameters += ";stretch=1";
  return parameters;
}

int run_peek(const RemoteOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const auto begin = steady_clock::now();
  const auto document = ask(*link, options, "crop", crop_parameters(options));
  if (!document) return fail(document.error());
  const std::chrono::duration<double> took = steady_clock::now() - begin;
  const auto line_end = std::ranges::find(*document, '\n');
  json about = json::parse(document->begin(), line_end, nullptr, false);
  if (!about.is_object() || line_end == document->end())
    return fail({ErrorKind::job_failed, fmt::format("camera {} sent no picture", options.camera)});
  const std::string jpeg(line_end + 1, document->end());
  const std::string out = options.out.empty() ? options.camera + ".jpg" : options.out;
  if (const auto written = write_file_atomically(out, jpeg); !written) return fail(written.error());
  about["file"] = out;
  about["bytes"] = jpeg.size();
  about["took_s"] = took.count();
  if (as_json) return print_json(about);
  std::cout << fmt::format("{}: {} of {}, {} x {} px at ({}, {}), scale {:.2f}, {} bytes in {:.1f} s\n", out,
                           about["what"].get<std::string>(), options.camera, about["width_px"].get<int>(),
                           about["height_px"].get<int>(), about["x_px"].get<int>(), about["y_px"].get<int>(),
                           about["scale"].get<double>(), jpeg.size(), took.count());
  return 0;
}

int run_get(const RemoteOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const auto document = ask_json(*link, options, "config");
  if (!document) return fail(document.error());
  const std::string text = document->value("config", "");
  if (options.key.empty()) {
    if (as_json) return print_json(*document);
    std::cout << text;
    return 0;
  }
  try {
    const toml::table table = toml::parse(text);
    const auto value = table.at_path(options.key);
    if (!value)
      return fail(
          {ErrorKind::invalid_input, fmt::format("camera {}: no key {} in its config", options.camera, options.key)});
    std::ostringstream shown;
    shown << value;
    if (as_json) return print_json({{"camera", options.camera}, {"key", options.key}, {"value", shown.str()}});
    std::cout << shown.str() << '\n';
  } catch (const toml::parse_error& error) {
    return fail(
        {ErrorKind::job_failed, fmt::format("camera {}: its config cannot be read: {}", options.camera, error.what())});
  }
  return 0;
}

// The node starts anew with them; whether it came back with them or without.
Result<void> await_trial(const LineLink& link, RemoteOptions options, const json& wanted) {
  const auto until = steady_clock::now() + timeout_of(options.wait_s);
  options.timeout_s = std::min(options.timeout_s, 5.0);
  while (steady_clock::now() < until) {
    std::this_thread::sleep_for(milliseconds(300));
    const auto now = ask_json(link, options, "config");
    if (!now || now->value("on_trial", true)) continue;
    if (now->value("settings", json()) == wanted) return {};
    return job_failed("camera {}: rolled back: {}", options.camera, now->value("refused", ""));
  }
  return job_failed("camera {}: not heard within {:.0f} s; it rolls the settings back when it does not find fusion",
                    options.camera, options.wait_s);
}

int run_set(const RemoteOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  std::string payload;
  for (const std::string& assignment : options.assignments) payload += assignment + "\n";
  const auto answer = ask_json(*link, options, "configure", options.check ? "check=1" : "", payload);
  if (!answer) return fail(answer.error());
  const json settings = answer->value("settings", json());
  if (!options.check) {
    if (const auto done = await_trial(*link, options, settings); !done) return fail(done.error());
  }
  if (as_json) return print_json({{"camera", options.camera}, {"settings", settings}, {"applied", !options.check}});
  std::cout << fmt::format("camera {}: {}\n", options.camera,
                           options.check ? "these settings would do" : "in force, the node is back");
  return 0;
}

int run_bundle(const RemoteOptions& options, bool as_json) {
  const auto link = LineLink::open(options.line);
  if (!link) return fail(link.error());
  const auto document = ask(*link, options, "bundle", "");
  if (!document) return fail(document.error());
  const std::string out = options.out.empty() ? options.camera + "-bundle.json.gz" : options.out;
  if (const auto written =
          write_file_atomically(out, {reinterpret_cast<const char*>(document->data()), document->size()});
      !written)
    return fail(written.error());
  if (as_json) return print_json({{"file", out}, {"bytes", document->size()}});
  std::cout << fmt::format("{}: {} bytes\n", out, document->size());
  return 0;
}

}  // namespace

void add_remote_commands(Cli& cli) {
  auto options = std::make_shared<RemoteOptions>();
  const auto add = [&](CLI::App& parent, const char* name, const char* help, int (*run)(const RemoteOptions&, bool),
                       bool camera_required = true) {
    CLI::App* sub = cli.command(parent, name, help, [&cli, options, run] { return run(*options, cli.json); });
    add_line_options(*sub, options->line);
    sub->add_option("--timeout", options->timeout_s, "s for the whole answer")
        ->check(between(0.1, 3600))
        ->capture_default_str();
    sub->add_option("camera", options->camera,
                    camera_required ? "which camera's node" : "which camera's node; without it fusion")
        ->required(camera_required);
    return sub;
  };
  add(cli.app, "log", "the last lines of a node's log, or of fusion's", run_log, false)
      ->add_option("--lines", options->lines, "how many")
      ->check(between(1, 500))
      ->capture_default_str();

  CLI::App* peek =
      add(cli.app, "peek", "a part of a camera's last frame, small enough for a thin link; the rims without more",
          run_peek);
  auto* region = peek->add_option("--region", options->region, "x,y,width,height in px of the frame");
  auto* target = peek->add_option_function<int>(
      "--target",
      [options](int id) {
        options->target = id;
        options->has_target = true;
      },
      "around the coded target of this id");
  target->excludes(region);
  peek->add_option("--bytes", options->bytes, "the picture's size at most")
      ->check(between(500, 65'536))
      ->capture_default_str();
  peek->add_flag("--stretch", options->stretch, "spread the grey levels that are there");
  peek->add_option("--out", options->out, "the JPEG; default: CAMERA.jpg");

  CLI::App* config = cli.app.add_subcommand("config", "a node's settings from afar");
  config->require_subcommand(1);
  add(*config, "get", "the settings in force, or one of them", run_get)->add_option("key", options->key, "section.key");
  CLI::App* set =
      add(*config, "set", "checks settings, starts the node anew with them, rolls them back if it does not come back",
          run_set);
  set->add_option("assignments", options->assignments, "section.key=value")->required();
  set->add_flag("--check", options->check, "only whether they would do");
  set->add_option("--wait", options->wait_s, "s for the node to come back")
      ->check(between(1, 3600))
      ->capture_default_str();

  add(cli.app, "bundle", "config, log and machine of a node in one file, for whoever helps", run_bundle)
      ->add_option("--out", options->out, "the file; default: CAMERA-bundle.json.gz");
}

}  // namespace imprint
