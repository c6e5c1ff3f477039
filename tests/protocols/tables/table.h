// Reads tables with the facts about a device from its reference: <protocol>/<profile>.table, copied
// from the reference and never from the profile. A simulated device and a conversation both read
// the profile, so a wrong profile row agrees with itself; the table shows the difference.
//
//   # comment
//   option | over | +999999 | certain | 7.2, own command table      an option that the profile sets
//   # point | read | write | type | unit | scale | offset | sentinels | access | standing | source
//   current_l1 | I1 | - | float32 | xIn | 1 | 0 | - | r | certain | 15.1: current L1, 0...63 x In
//
// '-' is an empty cell. `type` string(9) requires a text of at least 9 bytes, string any text.
// `standing`: certain; inferred, if the reference marks a part of the row as inferred or only
// implies it; unsourced, if the reference does not mention it or contradicts itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/model/device.h"

namespace baudgate::testing {

enum class Standing { certain, inferred, unsourced };

struct TableRow {
  std::string point;
  std::string read;
  std::string write;  ///< empty: the point is not writable, or its `write` equals its `read`
  std::string type;
  std::string unit;
  double scale = 1;
  double offset = 0;
  std::vector<double> sentinels;
  std::string access;  ///< "r": read only, "w": write only, "rw": both
  Standing standing = Standing::certain;
};

struct TableOption {
  std::string name;
  std::string value;  ///< A list is written as "a, b". An item in a profile can have more text
                      ///< after a blank.
  Standing standing = Standing::certain;
};

struct Table {
  std::vector<TableRow> rows;
  std::vector<TableOption> options;

  int Count(Standing standing) const;
};

/// Adds a sentence to `problems` for each unreadable line and each point that occurs twice.
Table ReadTable(std::string_view text, const std::string& file, std::vector<std::string>& problems);

/// Returns each difference as a sentence with the profile, the point or option, and the field.
std::vector<std::string> Differences(const config::Profile& profile, const Table& table);

}  // namespace baudgate::testing
