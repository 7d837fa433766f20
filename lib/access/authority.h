#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "lib/access/access_list.h"
#include "lib/result/result.h"

namespace imprint {

/// What a certificate is asked for.
struct CertificateRequest {
  std::string name;
  Role role = Role::camera;
  std::string site = "plant";
  std::string line = "L1";
  std::vector<std::string> hosts{};  ///< names and addresses under which others connect to it: of a fusion node
  int days = 1825;                   ///< of validity; ours: five years, a board's life in the heat
  bool renew = false;                ///< although one of that name is valid; that one stays so until it is revoked
};

/// A plant's own certificate authority in a folder: `ca.pem`, `ca-key.pem`, `access.json`, and `issued/<name>/` with
/// what goes to each board (`ca.pem`, `cert.pem`, `key.pem`). Keys are ECDSA P-256, made by OpenSSL.
class Authority {
 public:
  /// Makes a new one. Fails (invalid_input) when the folder holds one already.
  static Result<void> create(const std::filesystem::path& folder, const std::string& plant, int days);
  static Result<Authority> open(const std::filesystem::path& folder);

  /// Signs, writes the folder of the board and notes the certificate in the access list. Fails (invalid_input) on a
  /// name that is no id or longer than 48 bytes, and when one of that name is still valid.
  Result<IssuedCertificate> issue(const CertificateRequest& request);
  /// Revokes the certificates of a name, or only that with the serial number; gives how many.
  Result<int> revoke(const std::string& name, const std::string& serial);

  [[nodiscard]] const AccessList& list() const { return list_; }
  [[nodiscard]] std::filesystem::path folder_of(const std::string& name) const { return folder_ / "issued" / name; }

 private:
  Authority(std::filesystem::path folder, AccessList list) : folder_(std::move(folder)), list_(std::move(list)) {}

  std::filesystem::path folder_;
  AccessList list_;
};

}  // namespace imprint
