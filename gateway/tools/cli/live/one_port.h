// `baudgate bridge` and `baudgate read --port`: each runs a temporary gateway for one port.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <ostream>
#include <string>
#include <system_error>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "gateway/base/result.h"

namespace baudgate::tools {

class ScratchDirectory {
 public:
  /// Creates a temporary directory that only this user can read. `command` is a part of its name.
  explicit ScratchDirectory(const std::string& command) {
    const std::string name = "baudgate-" + command + "-XXXXXX";
    std::string form = (std::filesystem::temp_directory_path() / name).string();
    if (mkdtemp(form.data()) != nullptr) path_ = form;
  }
  ~ScratchDirectory() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
  }
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;

  /// The path of the directory; empty: the directory could not be created.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// `baudgate bridge`: runs a Modbus TCP gateway for one port, without a configuration file.
struct BridgeOptions {
  std::string port;  ///< the port: /dev/…, or tcp://host:port
  /// Serial settings: "19200", "8E1"; empty: the protocol's default.
  std::vector<std::string> serial;
  std::string protocol = "modbus_rtu";
  std::string listen = "127.0.0.1:1502";
  std::vector<std::string> allow;  ///< networks of clients; required if `listen` is not loopback
  bool read_only = false;
};

/// Runs until SIGTERM or SIGINT. Exit codes: 0 stopped; 2 `listen` is not an address, or is not
/// loopback while `allow` is empty; 3 a value is not permitted in a configuration; 4 `listen`
/// cannot be opened, or no temporary folder can be made.
int RunBridge(const BridgeOptions& options, const config::Catalog& catalog, std::ostream& err);

// `baudgate read --port …`: reads a device once, without a configuration or a running gateway.
struct ReadPortOptions {
  std::string port;  ///< the port: /dev/…, or tcp://host:port
  std::string profile;
  std::string protocol;  ///< empty: the protocol that has this profile
  std::string address;
  std::string serial;                ///< serial settings: "9600 7E1"; empty: the protocol's default
  std::vector<std::string> options;  ///< protocol options, "key=value"
  std::string point;                 ///< name of the point; empty: all points
  bool json = false;
};

/// Prints the same as `baudgate read` with a running gateway. Exit codes: 0 all points were read; 1
/// some points were not read; 2 unknown point; 3 invalid values; 4 the port cannot be opened.
int RunReadPort(const ReadPortOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate::tools
