// The settings of one device at one time, as the running gateway tells them or as a file keeps
// them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/mark.h"
#include "gateway/base/result.h"
#include "gateway/tools/cli/client/control_client.h"

namespace baudgate::settings {

struct Setting {
  std::string point;  ///< "main_phase_low_current"
  std::string item;   ///< in the device's own words: "S21"
  /// In units of the point; empty: not known.
  std::optional<std::string> value;
  std::string unit;
  double scale = 1;     ///< of its value to what the device says, `ratios` included
  bool known = false;   ///< `value` is what the device holds, not what it once held
  std::string quality;  ///< "good", "uncertain: last usable", …
  std::optional<Duration> age;
  // Not kept in files:
  bool writable = false;
  std::optional<double> resolution;  ///< the least by which two values differ; in its unit
  config::Mark mark;                 ///< of its row in a file
};

struct Sheet {
  std::string gateway;
  std::string line;
  std::string device;
  std::string protocol;
  std::string profile;
  std::string designation;  ///< what the device calls itself; empty: not known
  std::string time;         ///< ISO 8601, UTC
  std::vector<Setting> settings;
  config::Mark mark;  ///< of the file

  std::string target() const { return line + "." + device; }
  /// Null: none of that name.
  const Setting* Find(const std::string& point) const;
  /// Since the oldest known value was read; empty: none is known.
  std::optional<Duration> oldest() const;
};

/// What the gateway says of LINE.DEVICE now. The exit code: 0, or what was told on `err`.
int AskSheet(const std::string& socket, const std::string& target, Sheet& sheet, std::ostream& err);

/// Both are read again by ReadSheet: JSON is YAML, too.
std::string ToYaml(const Sheet& sheet);
std::string ToJson(const Sheet& sheet);

/// A file that `settings dump` has written, and perhaps a person has changed. The error has one
/// line for each problem, "file:line:column: error: …".
Result<Sheet> ReadSheet(const std::string& path);

}  // namespace baudgate::settings
