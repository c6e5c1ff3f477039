// ScratchDirectory is a directory of a command's own, gone when the command ends. PortConfig makes
// a configuration of one port, and RunBridge and RunReadPort are commands that use it.
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
  /// In the temporary directory, readable by nobody else. `command` is part of its name.
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

  /// Empty: it could not be made.
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// `baudgate bridge`: a Modbus TCP gateway for one port, in one line.
struct BridgeOptions {
  std::string port;                 ///< /dev/…, or tcp://host:port
  std::vector<std::string> serial;  ///< "19200", "8E1"; empty: the protocol's
  std::string protocol = "modbus_rtu";
  std::string listen = "127.0.0.1:1502";
  std::vector<std::string> allow;  ///< networks; needed beyond loopback
  bool read_only = false;
};

/// Until SIGTERM or SIGINT. Exit codes: 0 stopped, 2 it would listen beyond loopback for everybody,
/// 3 words that no configuration could have, 4 it cannot listen.
int RunBridge(const BridgeOptions& options, const config::Catalog& catalog, std::ostream& err);

// `baudgate read --port …`: one look at a device, without a file and without a running gateway.
struct ReadPortOptions {
  std::string port;  ///< /dev/…, or tcp://host:port
  std::string profile;
  std::string protocol;  ///< empty: the one whose profile it is
  std::string address;
  std::string serial;                ///< "9600 7E1"; empty: the protocol's
  std::vector<std::string> options;  ///< of the protocol, "key=value"
  std::string point;                 ///< empty: all
  bool json = false;
};

/// What `baudgate read` prints of a running gateway. Exit codes: 0 all was read; 1 the device did
/// not answer; 2 there is no such point; 3 bad words; 4 the port cannot be opened.
int RunReadPort(const ReadPortOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err);

}  // namespace baudgate::tools
