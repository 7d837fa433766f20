#include <sys/stat.h>

#include "cli/command.h"
#include "cli/command_line.h"
#include "lib/access/authority.h"
#include "lib/clock/wall_clock.h"

namespace imprint {
namespace {

constexpr int kMaxDays = 36'500;

struct CertsOptions {
  std::string folder = "certs";
  std::string plant = "plant";
  int authority_days = 7300;
  CertificateRequest request;
  std::string role = "camera";
  std::string name;
  std::string serial;
};

nlohmann::json listed(const IssuedCertificate& certificate) {
  nlohmann::json document = to_json(certificate);
  document["revoked"] = nullptr;
  if (certificate.revoked_ns != 0) document["revoked"] = utc_text(certificate.revoked_ns);
  return document;
}

int run_init(const CertsOptions& options, bool as_json) {
  if (const auto made = Authority::create(options.folder, options.plant, options.authority_days); !made)
    return fail(made.error());
  if (as_json) return print_json({{"folder", options.folder}, {"plant", options.plant}});
  std::cout << fmt::format(
      "{0}: authority of plant {1}\nKeep {0}/ca-key.pem to yourself: whoever has it can be any camera and any person.\n"
      "Next: imprint certs issue fusion --role fusion --host ADDRESS --dir {0}\n",
      options.folder, options.plant);
  return 0;
}

int run_issue(CertsOptions options, bool as_json) {
  const auto role = role_from_name(options.role);
  if (!role) return fail(role.error());
  options.request.role = *role;
  auto authority = Authority::open(options.folder);
  if (!authority) return fail(authority.error());
  const auto issued = authority->issue(options.request);
  if (!issued) return fail(issued.error());
  const std::string folder = authority->folder_of(issued->name).string();
  if (as_json) {
    nlohmann::json document = listed(*issued);
    document["folder"] = folder;
    return print_json(document);
  }
  std::cout << fmt::format("{0} {1}, valid until {2}\nTo it alone: {3}\nTo every fusion node, anew: {4}/access.json\n",
                           role_name(issued->role), issued->common_name, utc_text(issued->not_after_ns), folder,
                           options.folder);
  return 0;
}

int run_revoke(const CertsOptions& options, bool as_json) {
  auto authority = Authority::open(options.folder);
  if (!authority) return fail(authority.error());
  const auto revoked = authority->revoke(options.name, options.serial);
  if (!revoked) return fail(revoked.error());
  if (as_json) return print_json({{"name", options.name}, {"revoked", *revoked}});
  std::cout << fmt::format("{}: {} certificate(s) revoked; in force when {}/access.json is on the fusion nodes\n",
                           options.name, *revoked, options.folder);
  return 0;
}

int run_list(const CertsOptions& options, bool as_json) {
  const auto authority = Authority::open(options.folder);
  if (!authority) return fail(authority.error());
  nlohmann::json certificates = nlohmann::json::array();
  for (const IssuedCertificate& certificate : authority->list().certificates) {
    certificates.push_back(listed(certificate));
    if (as_json) continue;
    std::cout << fmt::format("{:<20} {:<9} {}/{} {} until {}{}\n", certificate.name, role_name(certificate.role),
                             certificate.site, certificate.line, certificate.serial, utc_text(certificate.not_after_ns),
                             certificate.revoked_ns == 0 ? "" : ", revoked " + utc_text(certificate.revoked_ns));
  }
  if (as_json) return print_json({{"plant", authority->list().plant}, {"certificates", certificates}});
  return 0;
}

// Keys are for their owner's eyes.
int privately(const std::function<int()>& run) {
  ::umask(0077);
  return run();
}

}  // namespace

void add_certs_command(Cli& cli) {
  auto options = std::make_shared<CertsOptions>();
  CLI::App* certs = cli.app.add_subcommand("certs", "the plant's certificates: who may do what (docs/security.md)");
  certs->require_subcommand(1);
  const auto add = [&](const char* name, const char* help, int (*run)(const CertsOptions&, bool)) {
    CLI::App* sub = cli.command(*certs, name, help,
                                [&cli, options, run] { return privately([&] { return run(*options, cli.json); }); });
    sub->add_option("--dir", options->folder, "folder of the plant's authority")->capture_default_str();
    return sub;
  };
  CLI::App* init = add("init", "makes the plant's authority", run_init);
  init->add_option("--plant", options->plant, "its name")->capture_default_str();
  init->add_option("--days", options->authority_days, "of validity")
      ->check(between(1, kMaxDays))
      ->capture_default_str();

  CLI::App* issue = add("issue", "signs a certificate for a camera's board, a fusion node or a person",
                        [](const CertsOptions& given, bool as_json) { return run_issue(given, as_json); });
  issue->add_option("name", options->request.name, "of a camera its id")->required();
  issue->add_option("--role", options->role, "camera, fusion, viewer, operator or engineer")->capture_default_str();
  issue->add_option("--site", options->request.site, "as in the configs")->capture_default_str();
  issue->add_option("--line", options->request.line, "as in the configs")->capture_default_str();
  issue->add_option("--host", options->request.hosts, "of a fusion node: name or address others connect to; repeat")
      ->expected(1)
      ->take_all();
  issue->add_option("--days", options->request.days, "of validity")->check(between(1, kMaxDays))->capture_default_str();
  issue->add_flag("--renew", options->request.renew, "although one of that name is valid, which stays so");

  CLI::App* revoke = add("revoke", "takes back what a certificate allowed", run_revoke);
  revoke->add_option("name", options->name, "whose")->required();
  revoke->add_option("--serial", options->serial, "only this one");

  add("list", "all certificates", run_list);
}

}  // namespace imprint
