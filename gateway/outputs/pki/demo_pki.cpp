// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/demo_pki.h"

#include <fcntl.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <initializer_list>

#include "config/model/network.h"
#include "transports/openssl.h"
#include "transports/tls_context.h"

namespace baudgate::pki {

using tls::Bio;
using tls::Certificate;
using tls::Freed;
using tls::ParseCertificates;
using tls::ParseKey;
using tls::Pkcs7;
using tls::PrivateKey;
using tls::ReadFile;
using tls::Reading;
using tls::Written;

namespace {

constexpr int kSerialBytes = 16;

Error OpenSslError(const std::string& what) {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_get_error(), text.data(), text.size());
  ERR_clear_error();
  return Error{what + " could not be made: " + text.data()};
}

std::time_t Seconds(WallTime time) {
  return std::chrono::floor<std::chrono::seconds>(time.time_since_epoch()).count();
}

bool SetSerial(X509* certificate) {
  std::array<unsigned char, kSerialBytes> bytes{};
  if (RAND_bytes(bytes.data(), kSerialBytes) != 1) return false;
  bytes[0] &= 0x7F;  // clears the sign bit, because a serial number must be positive
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(
      BN_bin2bn(bytes.data(), kSerialBytes, nullptr));
  return BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool SetSubject(X509* certificate, const std::string& name) {
  return X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate), "CN", MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(name.data()),
                                    static_cast<int>(name.size()), -1, 0) == 1;
}

bool AddExtension(X509* certificate, X509* issuer, int which, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, which, value));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// The contents of a certificate that only TLS needs, not DDS.
struct TlsUse {
  std::string server_names{};  ///< subjectAltName; empty: the certificate is that of a client
  std::string role{};
  bool on = false;
};

bool AddTlsUse(X509* certificate, X509* issuer, const TlsUse& use) {
  if (!use.on) return true;
  const bool server = !use.server_names.empty();
  if (!AddExtension(certificate, issuer, NID_ext_key_usage,
                    server ? "serverAuth,clientAuth" : "clientAuth")) {
    return false;
  }
  if (server &&
      !AddExtension(certificate, issuer, NID_subject_alt_name, use.server_names.c_str())) {
    return false;
  }
  if (use.role.empty()) return true;
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::string value = "ASN1:UTF8String:" + use.role;
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf(nullptr, &context, tls::kRoleExtension, value.c_str()));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// Creates a key and a certificate that `issuer` signs. `issuer` null: the certificate is that of
/// an authority, and self-signed.
Result<Issued> Make(const std::string& name, const Validity& validity, X509* issuer,
                    EVP_PKEY* issuer_key, const TlsUse& use = {}) {
  const PrivateKey key(EVP_EC_gen("prime256v1"));
  const Certificate certificate(X509_new());
  X509* const raw = certificate.get();
  const bool authority = issuer == nullptr;
  if (authority) {
    issuer = raw;
    issuer_key = key.get();
  }
  const bool good = key && raw != nullptr && X509_set_version(raw, X509_VERSION_3) == 1 &&
                    SetSerial(raw) &&
                    ASN1_TIME_set(X509_getm_notBefore(raw), Seconds(validity.from)) != nullptr &&
                    ASN1_TIME_set(X509_getm_notAfter(raw), Seconds(validity.until)) != nullptr &&
                    X509_set_pubkey(raw, key.get()) == 1 && SetSubject(raw, name) &&
                    X509_set_issuer_name(raw, X509_get_subject_name(issuer)) == 1 &&
                    AddExtension(raw, issuer, NID_basic_constraints,
                                 authority ? "critical,CA:TRUE,pathlen:0" : "critical,CA:FALSE") &&
                    AddExtension(raw, issuer, NID_key_usage,
                                 authority ? "critical,keyCertSign,cRLSign,digitalSignature"
                                           : "critical,digitalSignature,keyAgreement") &&
                    AddExtension(raw, issuer, NID_subject_key_identifier, "hash") &&
                    AddExtension(raw, issuer, NID_authority_key_identifier, "keyid:always") &&
                    AddTlsUse(raw, issuer, use) && X509_sign(raw, issuer_key, EVP_sha256()) > 0;
  const Bio certificate_text(BIO_new(BIO_s_mem()));
  const Bio key_text(BIO_new(BIO_s_mem()));
  if (!good || PEM_write_bio_X509(certificate_text.get(), raw) != 1 ||
      PEM_write_bio_PKCS8PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr,
                                    nullptr) != 1) {
    return OpenSslError("the certificate of " + name);
  }
  return Issued{Written(certificate_text), Written(key_text)};
}

Result<Issued> IssueIdentity(const Issued& authority, const std::string& name,
                             const Validity& validity, const TlsUse& use = {}) {
  const auto certificates = ParseCertificates(authority.certificate);
  const PrivateKey key = ParseKey(authority.key, {});
  if (certificates.empty() || !key) return Error{"certificate or key of the authority is damaged"};
  return Make(name, validity, certificates.front().get(), key.get(), use);
}

}  // namespace

Result<Issued> MakeAuthority(const std::string& name, const Validity& validity) {
  return Make(name, validity, nullptr, nullptr);
}

Result<Issued> IssueServer(const Issued& authority, const std::vector<std::string>& names,
                           const Validity& validity) {
  std::string list;
  for (const std::string& name : names) {
    list +=
        (list.empty() ? "" : ",") + std::string(config::IsIpAddress(name) ? "IP:" : "DNS:") + name;
  }
  return IssueIdentity(authority, names.front(), validity, {.server_names = list, .on = true});
}

Result<Issued> IssueClient(const Issued& authority, const std::string& name,
                           const std::string& role, const Validity& validity) {
  return IssueIdentity(authority, name, validity, {.role = role, .on = true});
}

Result<std::string> SignDocument(const Issued& authority, const std::string& xml) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const auto certificates = ParseCertificates(authority.certificate);
  const PrivateKey key = ParseKey(authority.key, {});
  if (certificates.empty() || !key) return Error{"certificate or key of the authority is damaged"};
  const Bio from = Reading(xml);
  const Bio to(BIO_new(BIO_s_mem()));
  const Pkcs7 signature(
      PKCS7_sign(certificates.front().get(), key.get(), nullptr, from.get(), kFlags));
  if (!signature || SMIME_write_PKCS7(to.get(), signature.get(), from.get(), kFlags) != 1) {
    return OpenSslError("a signature");
  }
  return Written(to);
}

namespace {

std::string Head(const std::string& schema) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
         "<dds xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"\n"
         "     xsi:noNamespaceSchemaLocation=\"http://www.omg.org/spec/DDS-SECURITY/20170901/" +
         schema + "\">\n";
}

/// All domains up to 230, the highest number that Cyclone DDS accepts.
constexpr char kAllDomains[] =
    "      <domains>\n"
    "        <id_range><min>0</min><max>230</max></id_range>\n"
    "      </domains>\n";

std::string Topics(const std::string& tag, std::initializer_list<const char*> topics) {
  std::string text = "        <" + tag + ">\n          <topics>";
  for (const char* topic : topics) text += std::string("<topic>") + topic + "</topic>";
  return text + "</topics>\n        </" + tag + ">\n";
}

/// Returns the topics that a participant is allowed to use. A gateway must not publish write
/// requests, so that its key cannot command other gateways.
std::string Rights(Part part) {
  if (part == Part::publish) {
    return Topics("publish", {"baudgate/[!w]*", "baudgate/write_reply"}) +
           Topics("subscribe", {"baudgate/write"});
  }
  const std::string subscribe = Topics("subscribe", {"baudgate/*"});
  return part == Part::write ? Topics("publish", {"baudgate/write"}) + subscribe : subscribe;
}

/// Returns e.g. "2026-11-22T20:00:00", in UTC.
std::string Time(WallTime time) { return FormatWallTime(time).substr(0, 19); }

}  // namespace

std::string Governance() {
  return Head("omg_shared_ca_governance.xsd") +
         "  <domain_access_rules>\n"
         "    <domain_rule>\n" +
         kAllDomains +
         "      <allow_unauthenticated_participants>false</allow_unauthenticated_participants>\n"
         "      <enable_join_access_control>true</enable_join_access_control>\n"
         "      <discovery_protection_kind>ENCRYPT</discovery_protection_kind>\n"
         "      <liveliness_protection_kind>ENCRYPT</liveliness_protection_kind>\n"
         "      <rtps_protection_kind>ENCRYPT</rtps_protection_kind>\n"
         "      <topic_access_rules>\n"
         "        <topic_rule>\n"
         "          <topic_expression>baudgate/*</topic_expression>\n"
         "          <enable_discovery_protection>true</enable_discovery_protection>\n"
         "          <enable_liveliness_protection>true</enable_liveliness_protection>\n"
         "          <enable_read_access_control>true</enable_read_access_control>\n"
         "          <enable_write_access_control>true</enable_write_access_control>\n"
         "          <metadata_protection_kind>NONE</metadata_protection_kind>\n"
         "          <data_protection_kind>ENCRYPT</data_protection_kind>\n"
         "        </topic_rule>\n"
         "      </topic_access_rules>\n"
         "    </domain_rule>\n"
         "  </domain_access_rules>\n"
         "</dds>\n";
}

std::string Permissions(const std::string& name, Part part, WallTime from, WallTime until) {
  return Head("omg_shared_ca_permissions.xsd") + "  <permissions>\n    <grant name=\"" + name +
         "\">\n      <subject_name>CN=" + name +
         "</subject_name>\n"
         "      <validity>\n        <not_before>" +
         Time(from) + "</not_before>\n        <not_after>" + Time(until) +
         "</not_after>\n      </validity>\n"
         "      <allow_rule>\n" +
         kAllDomains + Rights(part) +
         "      </allow_rule>\n"
         "      <default>DENY</default>\n"
         "    </grant>\n"
         "  </permissions>\n"
         "</dds>\n";
}

namespace {

namespace fs = std::filesystem;

Status WriteNew(const fs::path& path, const std::string& text, mode_t mode) {
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
  const bool good =
      file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  const int error = errno;
  if (file >= 0 && ::close(file) == 0 && good) return {};
  return Error{path.string() + ": " + std::strerror(good ? errno : error)};
}

Status MakeFolder(const fs::path& path) {
  std::error_code error;
  if (fs::create_directories(path, error) && !error) return {};
  return Error{path.string() + ": " + (error ? error.message() : "is there already")};
}

class DemoPki {
 public:
  DemoPki(const DemoPkiOptions& options, WallTime now)
      : options_(options),
        root_(options.directory),
        validity_{now - kClocksDiffer, now + options.validity} {}

  Result<std::vector<std::string>> Write() {
    for (const std::string& name : options_.gateways) {
      if (fs::exists(root_ / name)) return Error{(root_ / name).string() + " is there already"};
    }
    if (const Status status = FindAuthority(); !status) return Error{status.error()};
    for (const std::string& name : options_.gateways) {
      if (const Status status = Add(name, Part::publish); !status) return Error{status.error()};
    }
    for (const auto& [name, count, part] :
         {Numbered{"subscriber-", options_.subscribers, Part::subscribe},
          Numbered{"writer-", options_.writers, Part::write}}) {
      if (const Status status = AddNumbered(name, count, part); !status) {
        return Error{status.error()};
      }
    }
    return made_;
  }

 private:
  struct Numbered {
    const char* name;
    int count;
    Part part;
  };

  Status AddNumbered(const std::string& name, int count, Part part) {
    int number = 0;
    for (int left = count; left > 0; --left) {
      do ++number;
      while (fs::exists(root_ / (name + std::to_string(number))));
      if (Status status = Add(name + std::to_string(number), part); !status) return status;
    }
    return {};
  }

  Status FindAuthority() {
    const fs::path folder = root_ / "ca";
    if (fs::exists(folder)) {
      const auto certificate = ReadFile(folder / "ca.pem");
      const auto key = ReadFile(folder / "key.pem");
      if (!certificate) return Error{(folder / "ca.pem").string() + " " + certificate.error()};
      if (!key) return Error{(folder / "key.pem").string() + " " + key.error()};
      authority_ = {*certificate, *key};
      return {};
    }
    // The authority is valid longer, because identities that are issued later must not outlive it.
    const Validity longer{validity_.from,
                          validity_.until + std::max<Duration>(options_.validity, 365 * 24h)};
    auto made = MakeAuthority("baudgate DDS authority", longer);
    if (!made) return Error{made.error()};
    authority_ = std::move(*made);
    if (Status status = MakeFolder(folder); !status) return status;
    made_.push_back(folder);
    if (Status status = WriteNew(folder / "key.pem", authority_.key, 0600); !status) return status;
    return WriteNew(folder / "ca.pem", authority_.certificate, 0644);
  }

  Status Add(const std::string& name, Part part) {
    const auto identity = IssueIdentity(authority_, name, validity_);
    if (!identity) return Error{identity.error()};
    const auto governance = SignDocument(authority_, Governance());
    if (!governance) return Error{governance.error()};
    const auto permissions =
        SignDocument(authority_, Permissions(name, part, validity_.from, validity_.until));
    if (!permissions) return Error{permissions.error()};
    const fs::path folder = root_ / name;
    if (Status status = MakeFolder(folder); !status) return status;
    made_.push_back(folder);
    const struct {
      const char* file;
      const std::string& text;
      mode_t mode;
    } kFiles[] = {{"key.pem", identity->key, 0600},
                  {"identity.pem", identity->certificate, 0644},
                  {"ca.pem", authority_.certificate, 0644},
                  {"governance.p7s", *governance, 0644},
                  {"permissions.p7s", *permissions, 0644}};
    for (const auto& [file, text, mode] : kFiles) {
      if (Status status = WriteNew(folder / file, text, mode); !status) return status;
    }
    return {};
  }

  const DemoPkiOptions& options_;
  const fs::path root_;
  const Validity validity_;
  Issued authority_;
  std::vector<std::string> made_;
};

}  // namespace

Result<std::vector<std::string>> WriteDemoPki(const DemoPkiOptions& options, WallTime now) {
  return DemoPki(options, now).Write();
}

}  // namespace baudgate::pki
