// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/demo_pki.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "gateway/outputs/pki/demo_authority.h"
#include "gateway/outputs/pki/demo_documents.h"
#include "gateway/outputs/pki/openssl.h"

namespace baudgate::pki {
namespace {

namespace fs = std::filesystem;

// Clocks differ, and Fast DDS takes the times of permissions for local ones.
constexpr Duration kClocksDiffer = 24h;

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
    // Identities that are issued later do not outlive it.
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
