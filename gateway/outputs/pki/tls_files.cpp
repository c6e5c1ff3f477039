// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/tls_files.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "config/model/network.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/trusted_file.h"
#include "gateway/base/whole_file.h"
#include "gateway/outputs/pki/demo_pki.h"
#include "gateway/outputs/pki/openssl.h"

namespace baudgate::pki {
namespace {

namespace fs = std::filesystem;

constexpr Duration kSoon = 30 * 24h;
constexpr Duration kAuthorityValidity = 10 * 365 * 24h;

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

Result<TlsTexts> ReadTls(const TlsFiles& files) {
  TlsTexts texts;
  const auto certificate = CertificatesIn(files.certificate);
  if (!certificate) return Error{certificate.error()};
  const auto key = KeyIn(files.key);
  if (!key) return Error{key.error()};
  const auto chain = ParseCertificates(*certificate);
  if (X509_check_private_key(chain.front().get(), ParseKey(*key, {}).get()) != 1) {
    ERR_clear_error();
    return Error{"the key " + files.key + " does not belong to the certificate " +
                 files.certificate +
                 "; the certificate of the gateway must be the first in that file"};
  }
  texts.until = WallTime::max();
  for (const Certificate& one : chain) {
    texts.until = std::min(texts.until, TimeOf(X509_get0_notAfter(one.get())));
  }
  if (!files.client_ca.empty()) {
    auto authorities = CertificatesIn(files.client_ca);
    if (!authorities) return Error{authorities.error()};
    texts.client_ca = std::move(*authorities);
  }
  texts.certificate = *certificate;
  texts.key = *key;
  return texts;
}

std::string EndsSoon(const std::string& file, WallTime until, WallTime now) {
  if (until - now > kSoon) return {};
  return fmt::format("the certificate {} {} on {}; renew it", file,
                     until <= now ? "has ended" : "ends", DayOf(until));
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

namespace {

/// True for an address, or a host name as in RFC 1123; the first label may be "*".
bool IsServerName(std::string_view name) {
  if (config::IsIpAddress(std::string(name))) return true;
  if (name.starts_with("*.")) name.remove_prefix(2);
  const auto fits = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '.';
  };
  const bool only_digits = name.find_first_not_of("0123456789.") == std::string_view::npos;
  return !name.empty() && name.size() <= 253 && !only_digits && std::ranges::all_of(name, fits);
}

}  // namespace

Result<std::vector<std::string>> WriteServerFiles(const std::string& folder,
                                                  const std::vector<std::string>& names,
                                                  WallTime now) {
  const fs::path root(folder);
  for (const std::string& name : names) {
    if (!IsServerName(name)) {
      return Error{"'" + name +
                   "' is not a host name or an address; write for example "
                   "gate.example.com or 10.0.0.7"};
    }
  }
  std::error_code error;
  fs::create_directories(root, error);
  if (error) return Error{folder + ": " + error.message()};
  std::vector<std::string> written;
  const auto write = [&](const char* name, const std::string& text, fs::perms mode) -> Status {
    const fs::path file = root / name;
    if (const int failed = WriteWhole(file, text); failed != 0) {
      return Error{file.string() + ": " + SystemTrouble(failed)};
    }
    fs::permissions(file, mode, error);  // owner and group stay those of the file before
    written.push_back(file.string());
    return {};
  };
  constexpr fs::perms kSecret =
      fs::perms::owner_read | fs::perms::owner_write | fs::perms::group_read;
  constexpr fs::perms kPublic = kSecret | fs::perms::others_read;
  Issued authority;
  if (fs::exists(root / "ca.key")) {
    const auto key = ReadFile(root / "ca.key");
    const auto certificate = ReadFile(root / "ca.pem");
    if (!key) return Error{(root / "ca.key").string() + " " + key.error()};
    if (!certificate) return Error{(root / "ca.pem").string() + " " + certificate.error()};
    authority = {*certificate, *key};
    const auto parsed = ParseCertificates(*certificate);
    const PrivateKey its_key = ParseKey(*key, {});
    if (parsed.empty() || !its_key ||
        X509_check_private_key(parsed.front().get(), its_key.get()) != 1) {
      ERR_clear_error();
      return Error{(root / "ca.key").string() + " does not belong to " +
                   (root / "ca.pem").string() + "; restore the two files of one authority"};
    }
  } else if (fs::exists(root / "ca.pem")) {
    return Error{(root / "ca.key").string() +
                 " is missing: put the key of the authority back, or remove ca.pem to make a new "
                 "authority, which all browsers must then trust anew"};
  } else {
    auto made =
        MakeAuthority("baudgate authority", {now - kClocksDiffer, now + kAuthorityValidity});
    if (!made) return Error{made.error()};
    authority = std::move(*made);
    if (Status status = write("ca.key", authority.key, fs::perms::owner_read); !status) {
      return Error{status.error()};
    }
    if (Status status = write("ca.pem", authority.certificate, kPublic); !status) {
      return Error{status.error()};
    }
  }
  const auto identity = IssueServer(authority, names, {now - kClocksDiffer, now + kServerValidity});
  if (!identity) return Error{identity.error()};
  if (Status status = write("gateway.key", identity->key, kSecret); !status) {
    return Error{status.error()};
  }
  if (Status status = write("gateway.pem", identity->certificate, kPublic); !status) {
    return Error{status.error()};
  }
  return written;
}

}  // namespace baudgate::pki
