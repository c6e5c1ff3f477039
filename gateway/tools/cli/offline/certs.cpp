// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/certs.h"

#include <unistd.h>

#include <array>
#include <filesystem>

#include "config/checks/uniques.h"
#include "gateway/outputs/pki/demo_pki.h"
#include "gateway/outputs/pki/security_check.h"
#include "gateway/outputs/pki/server_files.h"
#include "transports/tls_files.h"

namespace baudgate::tools {

std::string CheckDdsSecurity(const config::Config& config, WallTime now,
                             std::vector<config::Problem>& problems) {
  const config::DdsSecurity& security = config.dds.security;
  if (!config.dds.enabled || !security.on()) return {};
  const pki::SecurityReport report = pki::CheckSecurity(security, now);
  for (const pki::Finding& finding : report.findings) {
    problems.push_back({security.keys.MarkOf(finding.key), finding.key + ": " + finding.sentence,
                        finding.warning});
  }
  return report.subject + ", until " + FormatWallTime(report.valid_until).substr(0, 10) +
         (report.messages_protected ? "" : "; the governance file leaves messages unprotected");
}

namespace {

namespace fs = std::filesystem;

constexpr int kDone = 0;
constexpr int kBadName = 2;
constexpr int kNotWritten = 4;

}  // namespace

int RunCerts(const CertsOptions& options, std::ostream& out, std::ostream& err) {
  std::error_code error;
  const std::string folder = fs::absolute(options.directory, error).lexically_normal().string();
  pki::DemoPkiOptions demo;
  demo.directory = folder;
  demo.gateways = options.gateways;
  demo.subscribers = options.subscribers.value_or(0);
  demo.writers = options.writers;
  if (demo.gateways.empty() && demo.subscribers == 0 && demo.writers == 0) {
    if (fs::exists(fs::path(folder) / "ca", error)) {
      err << "certs: " << folder
          << " already contains a certificate authority; add the identities to issue: "
          << "--gateway NAME, --subscribers N or --writers N\n";
      return kNotWritten;
    }
    demo.gateways = {"baudgate"};
    demo.subscribers = options.subscribers.value_or(1);
  }
  for (const std::string& name : demo.gateways) {
    if (const Status status = config::CheckName(name); !status) {
      err << "certs: --gateway: " << status.error() << '\n';
      return kBadName;
    }
  }
  const auto made = pki::WriteDemoPki(demo, ReadClocks().wall);
  if (!made) {
    err << "certs: " << made.error() << "; no file is overwritten\n";
    return kNotWritten;
  }
  out << "made, valid for 5 years:\n";
  for (const std::string& one : *made) out << "  " << one << '\n';
  for (const std::string& name : demo.gateways) {
    out << "configuration of the gateway " << name
        << ":\n  dds: { security: " << (fs::path(folder) / name).string() << " }\n";
  }
  if (demo.subscribers > 0) {
    out << "a subscriber: baudgate watch --security "
        << (*made)[made->size() - 1 - static_cast<std::size_t>(demo.writers)] << '\n';
  }
  out << "Keep " << folder
      << "/ca/key.pem secret and apart: everybody who has this file can issue identities.\n";
  return kDone;
}

namespace {

/// Returns the clients that get a certificate of the gateway's authority.
std::vector<pki::ClientFiles> ClientsOf(ServerCertsOptions::Use use) {
  switch (use) {
    case ServerCertsOptions::Use::web:
      break;
    case ServerCertsOptions::Use::modbus:
      return {{"viewer", "viewer"}, {"operator", "operator"}};
    case ServerCertsOptions::Use::ports:
      return {{"client"}};
  }
  return {};
}

/// Prints what to write into the configuration, and what the clients need.
void PrintUse(const std::string& folder, ServerCertsOptions::Use use, std::ostream& out) {
  const std::string files =
      "certificate: " + folder + "/gateway.pem, key: " + folder + "/gateway.key";
  out << "configuration of the gateway:\n  ";
  switch (use) {
    case ServerCertsOptions::Use::web:
      out << "web: { " << files << " }\nLet browsers trust " << folder << "/ca.pem";
      break;
    case ServerCertsOptions::Use::modbus:
      out << "modbus:\n    listen:\n      - { at: \"0.0.0.0:802\", protocol: tls,\n          "
          << files << ",\n          ca: " << folder
          << "/ca.pem }\nClients need ca.pem, and viewer.pem with viewer.key to read, or "
             "operator.pem with operator.key to write as well";
      break;
    case ServerCertsOptions::Use::ports:
      out << "serial_server: { at: \"0.0.0.0:4001\", " << files << ",\n    client_ca: " << folder
          << "/ca.pem }\nClients need ca.pem, client.pem and client.key";
      break;
  }
  out << ". Keep " << folder
      << "/ca.key secret and apart. The same command renews the certificates.\n";
}

}  // namespace

int RunServerCerts(const ServerCertsOptions& options, std::ostream& out, std::ostream& err) {
  std::error_code error;
  fs::path path = fs::absolute(options.directory, error).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();  // "DIR/"
  const std::string folder = path.string();
  std::vector<std::string> names = options.names;
  if (names.empty()) names = tls::NamesIn(folder + "/gateway.pem");
  if (names.empty()) {
    std::array<char, 256> host{};
    if (::gethostname(host.data(), host.size() - 1) == 0) names.emplace_back(host.data());
    names.insert(names.end(), {"localhost", "127.0.0.1"});
  }
  const auto made = pki::WriteServerFiles(folder, names, ClientsOf(options.use), ReadClocks().wall);
  if (!made) {
    err << "certs: " << made.error() << '\n';
    return kNotWritten;
  }
  out << "made, valid for 2 years, for";
  for (const std::string& name : names) out << ' ' << name;
  out << ":\n";
  for (const std::string& one : *made) out << "  " << one << '\n';
  PrintUse(folder, options.use, out);
  return kDone;
}

}  // namespace baudgate::tools
