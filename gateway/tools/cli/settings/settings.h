// `baudgate settings dump | compare | restore`: the settings of a relay into a file, the file
// against the relay, and back into it. docs/settings.md has it for users. PointWriter writes one
// point of `restore`.
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

// Write this point, and tell what became of it: what `baudgate settings restore` needs of a running
// gateway. The writes take the same way as all others: permission, limits, queue, audit.
struct WriteReport {
  std::string end;     ///< WriteEnd as a word: "ok", "refused", …; "unknown" without an answer
  std::string reason;  ///< one sentence; empty when ok
  bool read_back = false;  ///< the device shows what was written

  bool done() const { return end == "ok"; }
};

class PointWriter {
 public:
  virtual ~PointWriter() = default;
  /// `point`: LINE.DEVICE.POINT; `value` in its unit.
  virtual WriteReport Write(const std::string& point, const std::string& value) = 0;
  /// Why that would be denied now, in one sentence; empty: it may be written. Writes nothing.
  virtual std::optional<std::string> WhyNot(const std::string& point, const std::string& value) = 0;
};

/// Through the control socket at `path`; empty: the gateway in the default places.
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
  std::string file;    ///< of dump: empty is standard output
  bool json = false;
  bool confirm = false;                          ///< of restore: without it nothing is written
  std::string socket;                            ///< empty: the gateway in the default places
  Duration patience = std::chrono::seconds(10);  ///< of restore: with the read-back
};

// Exit codes: 0, and the device has what the file says; 2 wrong usage; 3 the file is bad or another
// device's, settings differ or are not known, or the restore has stopped; 4 no gateway answers, or
// the file cannot be written.
int RunSettingsDump(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsCompare(const SettingsOptions& options, std::ostream& out, std::ostream& err);
int RunSettingsRestore(const SettingsOptions& options, settings::PointWriter& writer,
                       std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools

namespace baudgate::settings {

// What the commands of `baudgate settings` share: both sides read, and differences shown.

/// "1 setting", "2 settings".
std::string Count(std::size_t count);

/// `denied`: points that may not be written, though they can.
void PrintTable(const std::vector<Difference>& differences, const std::set<std::string>& denied,
                std::ostream& out);

}  // namespace baudgate::settings
