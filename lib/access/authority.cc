#include "lib/access/authority.h"

#include <algorithm>
#include <cstdio>
#include <memory>

#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include "lib/clock/wall_clock.h"
#include "lib/config/atomic_file.h"
#include "lib/wire/keys.h"

namespace imprint {
namespace {

constexpr std::size_t kMaxNameBytes = 48;  // a common name has 64 at most
constexpr int kSerialBytes = 16;
constexpr std::size_t kSerialInName = 8;        // hexadecimal digits of it in the common name
constexpr long kSecondsADay = 24L * 60L * 60L;  // a board's clock may be behind that of the authority by a day
constexpr long kX509Version3 = 2;

template <auto Free>
struct Freed {
  void operator()(auto* object) const { Free(object); }
};
using Key = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using Memory = std::unique_ptr<BIO, Freed<BIO_free>>;
using Number = std::unique_ptr<BIGNUM, Freed<BN_free>>;
using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;

std::string hex(std::span<const unsigned char> bytes) {
  std::string text;
  for (const unsigned char byte : bytes) text += fmt::format("{:02x}", byte);
  return text;
}

std::string text_of(BIO* memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory, &data);
  return {data, static_cast<std::size_t>(size)};
}

std::string pem_of(X509* certificate) {
  const Memory memory(BIO_new(BIO_s_mem()));
  PEM_write_bio_X509(memory.get(), certificate);
  return text_of(memory.get());
}

std::string pem_of(EVP_PKEY* key) {
  const Memory memory(BIO_new(BIO_s_mem()));
  PEM_write_bio_PKCS8PrivateKey(memory.get(), key, nullptr, nullptr, 0, nullptr, nullptr);
  return text_of(memory.get());
}

// A key is its owner's alone, wherever the folder is copied to.
Result<void> write_key(const std::filesystem::path& path, const std::string& pem) {
  if (auto written = write_file_atomically(path, pem); !written) return written;
  std::error_code failed;
  std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write, failed);
  if (failed) return job_failed("{}: cannot be made private: {}", path.string(), failed.message());
  return {};
}

struct Draft {
  std::string common_name;
  std::string serial;  // hexadecimal
  int days = 0;
  std::vector<std::pair<int, std::string>> extensions;  // OpenSSL's number and text of each
};

Result<std::string> new_serial() {
  unsigned char bytes[kSerialBytes];
  if (RAND_bytes(bytes, kSerialBytes) != 1) return job_failed("certificate: no random numbers to be had");
  bytes[0] = static_cast<unsigned char>((bytes[0] & 0x7FU) | 0x40U);  // positive, of full length
  return hex(bytes);
}

bool add_extension(X509* certificate, X509* issuer, int number, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const Extension extension(X509V3_EXT_conf_nid(nullptr, &context, number, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

// `issuer` null: signed by itself. False when OpenSSL refuses any of it.
bool fill(X509* certificate, const Draft& draft, EVP_PKEY* subject_key, X509* issuer, EVP_PKEY* issuer_key) {
  BIGNUM* parsed = nullptr;
  if (BN_hex2bn(&parsed, draft.serial.c_str()) == 0) return false;
  const Number serial(parsed);
  const auto* name = reinterpret_cast<const unsigned char*>(draft.common_name.c_str());
  bool done = X509_set_version(certificate, kX509Version3) == 1 &&
              BN_to_ASN1_INTEGER(serial.get(), X509_get_serialNumber(certificate)) != nullptr &&
              X509_gmtime_adj(X509_getm_notBefore(certificate), -kSecondsADay) != nullptr &&
              X509_time_adj_ex(X509_getm_notAfter(certificate), draft.days, 0, nullptr) != nullptr &&
              X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate), "CN", MBSTRING_UTF8, name, -1, -1, 0) == 1;
  X509* signer = issuer != nullptr ? issuer : certificate;
  done = done && X509_set_issuer_name(certificate, X509_get_subject_name(signer)) == 1 &&
         X509_set_pubkey(certificate, subject_key) == 1;
  for (const auto& [number, value] : draft.extensions) done = done && add_extension(certificate, signer, number, value);
  return done && X509_sign(certificate, issuer_key, EVP_sha256()) > 0;
}

struct Signed {
  std::string certificate;
  std::string key;
};

Result<Signed> sign(const Draft& draft, X509* issuer, EVP_PKEY* issuer_key) {
  const Key key(EVP_EC_gen("P-256"));
  const Certificate certificate(X509_new());
  if (!key || !certificate ||
      !fill(certificate.get(), draft, key.get(), issuer, issuer_key != nullptr ? issuer_key : key.get()))
    return job_failed("certificate {}: OpenSSL could not make it", draft.common_name);
  return Signed{pem_of(certificate.get()), pem_of(key.get())};
}

// DNS names and addresses as OpenSSL wants them: "DNS:fusion.plant,IP:10.0.0.5".
Result<std::string> alternative_names(const std::vector<std::string>& hosts) {
  std::string names;
  for (const std::string& host : hosts) {
    const bool plain = !host.empty() && host.find_first_not_of(
                                            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                            "0123456789.:-") == std::string::npos;
    if (!plain) return invalid_input("host \"{}\": expected a name or an address such as 10.0.0.5", host);
    const bool address =
        host.find(':') != std::string::npos || host.find_first_not_of("0123456789.") == std::string::npos;
    names += (names.empty() ? "" : ",") + std::string(address ? "IP:" : "DNS:") + host;
  }
  return names;
}

Result<Draft> draft_of(const CertificateRequest& request) {
  auto serial = new_serial();
  if (!serial) return pass_on(serial.error());
  const auto names = alternative_names(request.hosts);
  if (!names) return pass_on(names.error());
  // A camera or a person must not be taken for a fusion node: only that may be a server.
  const char* usage = request.role == Role::fusion ? "serverAuth,clientAuth" : "clientAuth";
  Draft draft{.common_name = request.name + '.' + serial->substr(0, kSerialInName),
              .serial = *serial,
              .days = request.days,
              .extensions = {{NID_basic_constraints, "critical,CA:FALSE"},
                             {NID_key_usage, "critical,digitalSignature"},
                             {NID_ext_key_usage, usage}}};
  if (!names->empty()) draft.extensions.emplace_back(NID_subject_alt_name, *names);
  return draft;
}

Result<void> check(const CertificateRequest& request) {
  if (auto valid = check_id("certificate name", request.name); !valid) return valid;
  if (request.name.size() > kMaxNameBytes)
    return invalid_input("certificate name {}: expected at most {} characters", request.name, kMaxNameBytes);
  if (auto keys = Keys::of(request.site, request.line); !keys) return pass_on(keys.error());
  if (request.role == Role::fusion && request.hosts.empty())
    return invalid_input("certificate {}: a fusion node needs --host, the name or address others connect to",
                         request.name);
  return {};
}

}  // namespace

Result<void> Authority::create(const std::filesystem::path& folder, const std::string& plant, int days) {
  std::error_code failed;
  if (std::filesystem::exists(folder / "ca.pem", failed))
    return invalid_input("{}: holds an authority already; a second one would not know its certificates",
                         folder.string());
  if (auto valid = check_id("plant", plant); !valid) return valid;
  std::filesystem::create_directories(folder, failed);
  if (failed) return job_failed("{}: cannot be made: {}", folder.string(), failed.message());
  auto serial = new_serial();
  if (!serial) return pass_on(serial.error());
  const Draft draft{.common_name = plant.substr(0, kMaxNameBytes) + " authority",
                    .serial = *serial,
                    .days = days,
                    .extensions = {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
                                   {NID_key_usage, "critical,keyCertSign,cRLSign"},
                                   {NID_subject_key_identifier, "hash"}}};
  const auto made = sign(draft, nullptr, nullptr);
  if (!made) return pass_on(made.error());
  if (auto written = write_key(folder / "ca-key.pem", made->key); !written) return written;
  if (auto written = write_access_list(folder / "access.json", {.plant = plant, .certificates = {}}); !written)
    return written;
  return write_file_atomically(folder / "ca.pem", made->certificate);  // last: it says that there is an authority
}

Result<Authority> Authority::open(const std::filesystem::path& folder) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder / "ca.pem", ignored))
    return invalid_input("{}: no authority there; make one with `imprint certs init`", folder.string());
  auto list = read_access_list(folder / "access.json");
  if (!list) return pass_on(list.error());
  return Authority(folder, std::move(*list));
}

Result<IssuedCertificate> Authority::issue(const CertificateRequest& request) {
  if (auto valid = check(request); !valid) return pass_on(valid.error());
  const std::int64_t now_ns = wall_clock_ns();
  const bool has_one = std::ranges::any_of(list_.certificates, [&](const IssuedCertificate& other) {
    return other.name == request.name && other.revoked_ns == 0 && other.not_after_ns > now_ns;
  });
  if (has_one && !request.renew)
    return invalid_input(
        "certificate {}: there is a valid one; revoke it first, or --renew and revoke the old one later", request.name);
  const auto ca_text = read_file(folder_ / "ca.pem");
  if (!ca_text) return pass_on(ca_text.error());
  const auto key_text = read_file(folder_ / "ca-key.pem");
  if (!key_text) return pass_on(key_text.error());
  const Memory ca_memory(BIO_new_mem_buf(ca_text->data(), static_cast<int>(ca_text->size())));
  const Memory key_memory(BIO_new_mem_buf(key_text->data(), static_cast<int>(key_text->size())));
  const Certificate ca(PEM_read_bio_X509(ca_memory.get(), nullptr, nullptr, nullptr));
  const Key ca_key(PEM_read_bio_PrivateKey(key_memory.get(), nullptr, nullptr, nullptr));
  if (!ca || !ca_key || X509_check_private_key(ca.get(), ca_key.get()) != 1)
    return invalid_input("{}: ca.pem and ca-key.pem: expected a certificate and its key", folder_.string());

  const auto draft = draft_of(request);
  if (!draft) return pass_on(draft.error());
  const auto made = sign(*draft, ca.get(), ca_key.get());
  if (!made) return pass_on(made.error());
  IssuedCertificate certificate{.name = request.name,
                                .common_name = draft->common_name,
                                .serial = draft->serial,
                                .role = request.role,
                                .site = request.site,
                                .line = request.role == Role::fusion ? "" : request.line,
                                .not_after_ns = now_ns + 1'000'000'000LL * kSecondsADay * request.days};
  const std::filesystem::path out = folder_of(request.name);
  std::error_code failed;
  std::filesystem::create_directories(out, failed);
  if (failed) return job_failed("{}: cannot be made: {}", out.string(), failed.message());
  list_.certificates.push_back(certificate);
  if (auto written = write_key(out / "key.pem", made->key); !written) return pass_on(written.error());
  for (const auto& [name, text] : {std::pair{"cert.pem", &made->certificate}, {"ca.pem", &*ca_text}}) {
    if (auto written = write_file_atomically(out / name, *text); !written) return pass_on(written.error());
  }
  if (auto written = write_access_list(folder_ / "access.json", list_); !written) return pass_on(written.error());
  return certificate;
}

Result<int> Authority::revoke(const std::string& name, const std::string& serial) {
  int revoked = 0;
  for (IssuedCertificate& certificate : list_.certificates) {
    if (certificate.name != name || certificate.revoked_ns != 0) continue;
    if (!serial.empty() && certificate.serial != serial) continue;
    certificate.revoked_ns = wall_clock_ns();
    ++revoked;
  }
  if (revoked == 0)
    return invalid_input("certificate {}{}: there is none that is not revoked; see `imprint certs list`", name,
                         serial.empty() ? "" : " " + serial);
  if (auto written = write_access_list(folder_ / "access.json", list_); !written) return pass_on(written.error());
  return revoked;
}

}  // namespace imprint
