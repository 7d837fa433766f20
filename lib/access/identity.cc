#include "lib/access/identity.h"

#include <array>
#include <cstdio>
#include <memory>

#include <openssl/pem.h>
#include <openssl/x509.h>

namespace imprint {

std::string certificate_name(const std::filesystem::path& identity) {
  constexpr const char* kUnknown = "(none)";
  const std::unique_ptr<FILE, int (*)(FILE*)> file(std::fopen((identity / "cert.pem").c_str(), "r"), std::fclose);
  if (!file) return kUnknown;
  const std::unique_ptr<X509, void (*)(X509*)> certificate(PEM_read_X509(file.get(), nullptr, nullptr, nullptr),
                                                           X509_free);
  std::array<char, 65> name{};  // at most 64 characters, RFC 5280
  if (!certificate || X509_NAME_get_text_by_NID(X509_get_subject_name(certificate.get()), NID_commonName, name.data(),
                                                static_cast<int>(name.size())) < 0)
    return kUnknown;
  return name.data();
}

}  // namespace imprint
