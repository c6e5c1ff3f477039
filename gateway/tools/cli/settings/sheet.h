// The settings of one device at one time, as the running gateway tells them or as a file keeps
// them. Comparison compares a file with the device.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/problem.h"
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

// What a file of settings says against what the device has now. Pure.

/// Both sides are known, and say different things.
struct Difference {
  const Setting* filed = nullptr;  ///< in the sheet of the file
  const Setting* now = nullptr;    ///< in that of the device
};

struct Comparison {
  std::vector<Difference> different;  ///< in the order of the file
  /// One sentence each: what could not be compared, because a side does not have or know it.
  std::vector<std::string> open;
  std::size_t unread = 0;  ///< of these, settings of the file that the device has not told of late

  bool same() const { return different.empty() && open.empty(); }
};

/// Whether the file can be that of this device: the same profile, the same designation, the same
/// items in the same units. The error names the place in the file.
Status CheckFit(const Sheet& file, const Sheet& now);

/// Both sheets outlive the comparison.
Comparison Compare(const Sheet& file, const Sheet& now);

/// "0.90" is 0.9; 12345678 is not 12345679. `resolution`: Setting::resolution.
bool IsSameValue(const std::string& a, const std::string& b, std::optional<double> resolution = {});

}  // namespace baudgate::settings
