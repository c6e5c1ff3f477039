// `Sheet` contains a device's settings at one time, from the running gateway or from a file.
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
  std::string item;   ///< the device's name of the setting: "S21"
  /// The value in the point's unit; empty: unknown.
  std::optional<std::string> value;
  std::string unit;
  double scale = 1;    ///< `value` divided by the device's number; includes the configured `ratios`
  bool known = false;  ///< true: `value` is the device's present value, not an older one
  std::string quality;  ///< "good", "uncertain: last usable", …
  std::optional<Duration> age;
  // The following members are not stored in files.
  bool writable = false;
  std::optional<double> resolution;  ///< smallest difference of two values, in the point's unit
  config::Mark mark;
};

struct Sheet {
  std::string gateway;
  std::string line;
  std::string device;
  std::string protocol;
  std::string profile;
  std::string designation;  ///< the type that the device reports, "SPAJ 140 C"; empty: unknown
  std::string time;         ///< when the sheet was read; ISO 8601, UTC
  std::vector<Setting> settings;
  config::Mark mark;

  std::string target() const { return line + "." + device; }
  const Setting* Find(const std::string& point) const;
  /// Returns the age of the oldest known value; empty: no value is known.
  std::optional<Duration> oldest() const;
};

/// Reads the settings of LINE.DEVICE from the gateway. Returns the exit code. A failure is printed
/// on `err`.
int AskSheet(const std::string& socket, const std::string& target, Sheet& sheet, std::ostream& err);

/// Both formats can be read by ReadSheet, because JSON is a subset of YAML.
std::string ToYaml(const Sheet& sheet);
std::string ToJson(const Sheet& sheet);

/// Reads a file of `settings dump`, possibly edited. The error has one line for each problem,
/// "file:line:column: error: …".
Result<Sheet> ReadSheet(const std::string& path);

struct Difference {
  const Setting* filed = nullptr;
  const Setting* now = nullptr;
};

struct Comparison {
  std::vector<Difference> different;  ///< in the order of the file
  /// One sentence for each setting that is missing or unknown in the file or in the device.
  std::vector<std::string> open;
  /// How many of the `open` settings have a value in the file, but no known value in the device.
  std::size_t unread = 0;

  bool same() const { return different.empty() && open.empty(); }
};

/// Checks that profile, designation, items and units are equal. The error contains the position in
/// the file.
Status CheckFit(const Sheet& file, const Sheet& now);

/// The sheets must outlive the result.
Comparison Compare(const Sheet& file, const Sheet& now);

/// True if two values are equal: whole numbers exactly, other numbers within the precision of a
/// float32. Example: true for "0.90" and "0.9". `resolution`: see Setting.
bool IsSameValue(const std::string& a, const std::string& b, std::optional<double> resolution = {});

}  // namespace baudgate::settings
