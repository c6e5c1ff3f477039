// SPDX-License-Identifier: Apache-2.0
#include "transports/tls_files.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "gateway/base/trusted_file.h"
#include "transports/openssl.h"

namespace baudgate::tls {
namespace {

constexpr Duration kSoon = 30 * 24h;

std::string DayOf(WallTime time) { return FormatWallTime(time).substr(0, 10); }

/// Returns the certificates of a file; an error if it has none.
Result<std::string> CertificatesIn(const std::string& file) {
  const auto text = ReadFile(file);
  if (!text) return Error{file + " " + text.error()};
  if (ParseCertificates(*text).empty()) return Error{file + " contains no certificate in PEM form"};
  return *text;
}

Result<std::string> KeyIn(const std::string& file) {
  if (std::string why = WhyNotTrusted(file); !why.empty()) return Error{"the key " + why};
  struct stat its {};
  if (::stat(file.c_str(), &its) == 0 && (its.st_mode & S_IRWXO) != 0) {
    return Error{"the key " + file +
                 " can be read or changed by every user; run: chmod o= " + file};
  }
  const auto text = ReadFile(file);
  if (!text) return Error{"the key " + file + " " + text.error()};
  if (!ParseKey(*text, {}))
    return Error{file + " contains no private key in PEM form without password"};
  return *text;
}

}  // namespace

Result<TlsTexts> ReadTls(const config::TlsFiles& files) {
  TlsTexts texts{.until = WallTime::max()};
  const auto see_end = [&texts](const std::vector<Certificate>& certificates,
                                const std::string& file) {
    for (const Certificate& one : certificates) {
      const WallTime until = TimeOf(X509_get0_notAfter(one.get()));
      if (until >= texts.until) continue;
      texts.until = until;
      texts.ends_first = file;
    }
  };
  if (!files.certificate.empty()) {
    auto certificate = CertificatesIn(files.certificate);
    if (!certificate) return Error{certificate.error()};
    auto key = KeyIn(files.key);
    if (!key) return Error{key.error()};
    const auto chain = ParseCertificates(*certificate);
    if (X509_check_private_key(chain.front().get(), ParseKey(*key, {}).get()) != 1) {
      ERR_clear_error();
      return Error{"the key " + files.key + " does not belong to the certificate " +
                   files.certificate +
                   "; the certificate of the gateway must be the first in that file"};
    }
    see_end(chain, files.certificate);
    texts.certificate = std::move(*certificate);
    texts.key = std::move(*key);
  }
  if (!files.authorities.empty()) {
    auto authorities = CertificatesIn(files.authorities);
    if (!authorities) return Error{authorities.error()};
    see_end(ParseCertificates(*authorities), files.authorities);
    texts.authorities = std::move(*authorities);
  }
  return texts;
}

std::string EndsSoon(const TlsTexts& texts, WallTime now) {
  if (texts.ends_first.empty() || texts.until - now > kSoon) return {};
  return fmt::format("the certificate {} {} on {}; renew it", texts.ends_first,
                     texts.until <= now ? "has ended" : "ends", DayOf(texts.until));
}

std::vector<std::string> NamesIn(const std::string& certificate) {
  const auto text = ReadFile(certificate);
  const auto found = text ? ParseCertificates(*text) : std::vector<Certificate>();
  if (found.empty()) return {};
  using Names = std::unique_ptr<GENERAL_NAMES, Freed<GENERAL_NAMES_free>>;
  const Names names(static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(found.front().get(), NID_subject_alt_name, nullptr, nullptr)));
  std::vector<std::string> texts;
  for (int i = 0; names && i < sk_GENERAL_NAME_num(names.get()); ++i) {
    const GENERAL_NAME* const name = sk_GENERAL_NAME_value(names.get(), i);
    const unsigned char* const data = ASN1_STRING_get0_data(name->d.ia5);
    const int size = ASN1_STRING_length(name->d.ia5);
    std::array<char, INET6_ADDRSTRLEN> address{};
    if (name->type == GEN_DNS) {
      texts.emplace_back(reinterpret_cast<const char*>(data), static_cast<std::size_t>(size));
    } else if (name->type == GEN_IPADD &&
               ::inet_ntop(size == 4 ? AF_INET : AF_INET6, data, address.data(), address.size())) {
      texts.emplace_back(address.data());
    }
  }
  return texts;
}

}  // namespace baudgate::tls
