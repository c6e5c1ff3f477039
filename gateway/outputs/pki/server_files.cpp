// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/server_files.h"

#include <openssl/err.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "config/model/network.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/whole_file.h"
#include "gateway/outputs/pki/demo_pki.h"
#include "transports/openssl.h"

namespace baudgate::pki {

using tls::ParseCertificates;
using tls::ParseKey;
using tls::PrivateKey;
using tls::ReadFile;

namespace {

namespace fs = std::filesystem;

constexpr Duration kAuthorityValidity = 10 * 365 * 24h;

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
                                                  const std::vector<ClientFiles>& clients,
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
  const auto write = [&](const std::string& name, const std::string& text,
                         fs::perms mode) -> Status {
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
                 "authority, which all browsers must then trust"};
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
  const Validity validity{now - kClocksDiffer, now + kServerValidity};
  const auto issue = [&](const std::string& name, const Result<Issued>& identity) -> Status {
    if (!identity) return Error{identity.error()};
    if (Status status = write(name + ".key", identity->key, kSecret); !status) return status;
    return write(name + ".pem", identity->certificate, kPublic);
  };
  if (Status status = issue("gateway", IssueServer(authority, names, validity)); !status) {
    return Error{status.error()};
  }
  for (const ClientFiles& client : clients) {
    const auto identity = IssueClient(authority, client.name, client.role, validity);
    if (Status status = issue(client.name, identity); !status) return Error{status.error()};
  }
  return written;
}

}  // namespace baudgate::pki
