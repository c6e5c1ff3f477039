// `baudgate settings dump | compare | restore`: write a relay's settings into a file, compare the
// file with the relay, and write the file's values back; see docs/settings.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <set>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/tools/cli/settings/sheet.h"

namespace baudgate::settings {

// The result of a write. The gateway treats it like the writes of all clients: permission, limits,
// queue, audit.
struct WriteReport {
  std::string end;     ///< name of the WriteEnd: "ok", "refused", …; "unknown": no answer
  std::string reason;  ///< why the write failed, as one sentence; empty: the write succeeded
  bool read_back = false;

  bool done() const { return end == "ok"; }
};

class PointWriter {
 public:
  virtual ~PointWriter() = default;
  /// `point`: LINE.DEVICE.POINT. `value`: in the point's unit.
  virtual WriteReport Write(const std::string& point, const std::string& value) = 0;
  /// Returns why the write would be denied now; empty: the write would be allowed. Does not write.
  virtual std::optional<std::string> WhyNot(const std::string& point, const std::string& value) = 0;
};

/// `SocketWriter` writes through the control socket at `path`; empty: the only running gateway is
/// used.
class SocketWriter final : public PointWriter {
 public:
  explicit SocketWriter(std::string path) : path_(std::move(path)) {}
  WriteReport Write(const std::string& point, const std::string& value) override;
  std::optional<std::string> WhyNot(const std::string& point, const std::string& value) override;

 private:
  std::string path_;
};

}  // namespace baudgate::settings

namespace baudgate::tools {

struct SettingsOptions {
  std::string target;  ///< LINE.DEVICE
  std::string file;    ///< path of the file; empty, for dump: standard output
  bool json = false;
  bool confirm = false;  ///< for restore; false: nothing is written
  std::string socket;    ///< path of the control socket; empty: the only running gateway is used
  /// For restore: how long to wait until the written values were read back.
  Duration patience = std::chrono::seconds(10);
};

// Exit codes: 0 the device has the values of the file; 2 wrong usage; 3 the file has errors or is
// from another device, settings differ or are unknown, or the restore has stopped; 4 no gateway
// answers, or the file cannot be written.
int RunSettingsDump(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsCompare(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsRestore(const SettingsOptions& options, settings::PointWriter& writer,
                       std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools

namespace baudgate::settings {

std::string Count(std::size_t count);

/// `denied`: writable points that the gateway does not allow to be written.
void PrintTable(const std::vector<Difference>& differences, const std::set<std::string>& denied,
                std::ostream& out);

}  // namespace baudgate::settings
