// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/security_check.h"

#include <openssl/err.h>
#include <openssl/x509_vfy.h>
#include <sys/stat.h>

#include <algorithm>
#include <ctime>
#include <optional>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "transports/openssl.h"

namespace baudgate::pki {

using tls::Bio;
using tls::Certificate;
using tls::ParseCertificates;
using tls::ParseKey;
using tls::Pkcs7;
using tls::PrivateKey;
using tls::ReadFile;
using tls::Reading;
using tls::Store;
using tls::StoreContext;
using tls::SubjectOf;
using tls::TimeOf;
using tls::Written;

namespace {

using config::DdsSecurity;

/// A certificate causes a warning if it ends within this time.
constexpr Duration kWarnBefore = 60 * 24h;

std::string Day(WallTime time) { return FormatWallTime(time).substr(0, 10); }

std::vector<std::string> Elements(const std::string& xml, const std::string& tag) {
  std::vector<std::string> found;
  const std::string begin = "<" + tag + ">";
  for (std::size_t at = xml.find(begin); at != std::string::npos; at = xml.find(begin, at)) {
    at += begin.size();
    const std::size_t end = xml.find("</" + tag + ">", at);
    if (end == std::string::npos) break;
    found.emplace_back(Trim(std::string_view(xml).substr(at, end - at)));
  }
  return found;
}

/// Returns the text of a signed S/MIME document; nothing: none of `signers` has signed it.
std::optional<std::string> Verified(const std::string& smime,
                                    const std::vector<Certificate>& signers) {
  const Bio from = Reading(smime);
  BIO* raw = nullptr;
  const Pkcs7 signature(SMIME_read_PKCS7(from.get(), &raw));
  const Bio document(raw);
  STACK_OF(X509)* stack = sk_X509_new_null();
  for (const Certificate& signer : signers) sk_X509_push(stack, signer.get());
  const Bio to(BIO_new(BIO_s_mem()));
  const bool good =
      signature && PKCS7_verify(signature.get(), stack, nullptr, document.get(), to.get(),
                                PKCS7_TEXT | PKCS7_NOVERIFY | PKCS7_NOINTERN) == 1;
  sk_X509_free(stack);
  ERR_clear_error();
  if (!good) return std::nullopt;
  return Written(to);
}

class Checker {
 public:
  Checker(const DdsSecurity& security, WallTime now) : security_(security), now_(now) {}

  SecurityReport Check() {
    const auto authorities = Certificates("ca", security_.ca);
    std::vector<Certificate> others;
    if (!security_.permissions_ca.empty()) {
      others = Certificates("permissions_ca", security_.permissions_ca);
    }
    const auto& signers = security_.permissions_ca.empty() ? authorities : others;
    const auto identities = Certificates("identity", security_.identity);
    if (!identities.empty()) CheckIdentity(identities.front(), authorities);
    CheckKey(identities);
    CheckGovernance(signers);
    CheckPermissions(signers);
    return std::move(report_);
  }

 private:
  void Wrong(const std::string& key, const std::string& file, const std::string& why) {
    report_.findings.push_back({key, file + " " + why, false});
  }
  void Warn(const std::string& key, const std::string& file, const std::string& why) {
    report_.findings.push_back({key, file + " " + why, true});
  }

  std::optional<std::string> Read(const std::string& key, const std::string& file) {
    auto text = ReadFile(file);
    if (text) return std::move(*text);
    Wrong(key, file, text.error());
    return std::nullopt;
  }

  std::vector<Certificate> Certificates(const std::string& key, const std::string& file) {
    const auto text = Read(key, file);
    if (!text) return {};
    auto found = ParseCertificates(*text);
    if (found.empty()) Wrong(key, file, "contains no certificate in PEM form");
    for (const Certificate& one : found) CheckTimes(key, file, one);
    return found;
  }

  void CheckTimes(const std::string& key, const std::string& file, const Certificate& one) {
    const WallTime from = TimeOf(X509_get0_notBefore(one.get()));
    const WallTime until = TimeOf(X509_get0_notAfter(one.get()));
    if (now_ < from) {
      Wrong(key, file, "is not valid before " + FormatWallTime(from) + "; is the clock right?");
    } else if (now_ > until) {
      Wrong(key, file, "expired on " + Day(until) + "; have a new one issued");
    } else if (until - now_ < kWarnBefore) {
      Warn(key, file, "expires on " + Day(until) + "; have a new one issued");
    }
  }

  void CheckIdentity(const Certificate& identity, const std::vector<Certificate>& authorities) {
    report_.subject = SubjectOf(identity);
    report_.valid_until = TimeOf(X509_get0_notAfter(identity.get()));
    if (authorities.empty()) return;
    const Store store(X509_STORE_new());
    for (const Certificate& one : authorities) X509_STORE_add_cert(store.get(), one.get());
    const StoreContext context(X509_STORE_CTX_new());
    X509_STORE_CTX_init(context.get(), store.get(), identity.get(), nullptr);
    // Only the issuer is checked here, because CheckTimes has checked the times.
    X509_VERIFY_PARAM_set_flags(X509_STORE_CTX_get0_param(context.get()),
                                X509_V_FLAG_NO_CHECK_TIME);
    if (X509_verify_cert(context.get()) == 1) return;
    const int code = X509_STORE_CTX_get_error(context.get());
    Wrong("identity", security_.identity,
          "was not issued by " + security_.ca + " (" + X509_verify_cert_error_string(code) +
              "); both must come from one authority");
    ERR_clear_error();
  }

  void CheckKey(const std::vector<Certificate>& identities) {
    if (!security_.password_file.empty()) {
      const auto password = Read("password_file", security_.password_file);
      if (password) report_.password = password->substr(0, password->find_first_of("\r\n"));
    }
    const auto text = Read("key", security_.key);
    if (!text) return;
    struct ::stat about {};
    if (::stat(security_.key.c_str(), &about) == 0 && (about.st_mode & (S_IROTH | S_IWOTH)) != 0) {
      Warn("key", security_.key,
           "can be read or changed by every user; run: chmod o= " + security_.key);
    }
    const PrivateKey key = ParseKey(*text, report_.password);
    if (!key) {
      const bool locked = text->find("ENCRYPTED") != std::string::npos;
      return Wrong("key", security_.key,
                   !locked ? "contains no private key in PEM form"
                   : security_.password_file.empty()
                       ? "is encrypted; set password_file"
                       : "is encrypted, and the password in password_file is wrong");
    }
    if (identities.empty()) return;
    if (X509_check_private_key(identities.front().get(), key.get()) != 1) {
      Wrong("key", security_.key, "is not the key of " + security_.identity);
    }
    ERR_clear_error();
  }

  std::optional<std::string> Document(const std::string& key, const std::string& file,
                                      const std::vector<Certificate>& signers) {
    const auto text = Read(key, file);
    if (!text || signers.empty()) return std::nullopt;
    auto document = Verified(*text, signers);
    if (!document) {
      Wrong(key, file,
            "is not signed by " + security_.signer() +
                ", or was changed since; sign it again (openssl smime -sign -text)");
    }
    return document;
  }

  void CheckGovernance(const std::vector<Certificate>& signers) {
    const auto xml = Document("governance", security_.governance, signers);
    if (!xml) return;
    const auto kinds = Elements(*xml, "rtps_protection_kind");
    report_.messages_protected = !kinds.empty() && std::ranges::find(kinds, "NONE") == kinds.end();
    if (kinds.empty())
      Wrong("governance", security_.governance,
            "is not a governance document (it has no rtps_protection_kind)");
  }

  void CheckPermissions(const std::vector<Certificate>& signers) {
    const auto xml = Document("permissions", security_.permissions, signers);
    if (!xml || report_.subject.empty()) return;
    const auto names = Elements(*xml, "subject_name");
    const auto at = std::ranges::find(names, report_.subject);
    if (at == names.end()) {
      return Warn("permissions", security_.permissions,
                  "has no grant for " + report_.subject + ", the subject of " + security_.identity);
    }
    const auto ends = Elements(*xml, "not_after");
    const auto index = static_cast<std::size_t>(at - names.begin());
    if (ends.size() != names.size()) return;
    std::tm parts{};
    if (::strptime(ends[index].c_str(), "%Y-%m-%dT%H:%M:%S", &parts) == nullptr) return;
    const WallTime until{std::chrono::seconds(::timegm(&parts))};
    if (now_ > until) {
      Wrong("permissions", security_.permissions,
            "expired on " + Day(until) + "; have a new file signed");
    } else if (until - now_ < kWarnBefore) {
      Warn("permissions", security_.permissions,
           "expires on " + Day(until) + "; have a new file signed");
    }
  }

  const DdsSecurity& security_;
  const WallTime now_;
  SecurityReport report_;
};

}  // namespace

std::string SecurityReport::FirstError() const {
  const auto at = std::ranges::find(findings, false, &Finding::warning);
  return at == findings.end() ? std::string() : at->key + ": " + at->sentence;
}

SecurityReport CheckSecurity(const DdsSecurity& security, WallTime now) {
  return Checker(security, now).Check();
}

}  // namespace baudgate::pki
