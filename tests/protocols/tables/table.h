// Tables of what the references say of a device: test data in <protocol>/<profile>.table, typed in
// from the references and never from the profiles. A twin and a conversation both read the profile,
// so a profile row that names the wrong item agrees with itself; here it disagrees with the table.
//
//   # comment
//   option | over | +999999 | certain | 7.2, own command table      an option that the profile sets
//   # point | read | write | type | unit | scale | offset | sentinels | access | standing | source
//   current_l1 | I1 | - | float32 | xIn | 1 | 0 | - | r | certain | 15.1: current L1, 0...63 x In
//
// '-' stands for nothing. `type` string(9) asks for a text of at least 9 bytes, string for any
// text. `standing`: certain; inferred, where the reference marks a part of the row so or leaves it
// to a conclusion; unsourced, where it is silent or contradicts itself.
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
  std::string write;  ///< empty: nothing, or as read
  std::string type;
  std::string unit;
  double scale = 1;
  double offset = 0;
  std::vector<double> sentinels;
  std::string access;  ///< "r", "w", "rw"
  Standing standing = Standing::certain;
};

struct TableOption {
  std::string name;
  std::string value;  ///< of lists: the items, "a, b"; a profile's item may go on behind a blank
  Standing standing = Standing::certain;
};

struct Table {
  std::vector<TableRow> rows;
  std::vector<TableOption> options;

  /// Rows and options of that standing.
  int Count(Standing standing) const;
};

/// Reads a table's text. What it does not understand, and a point named twice, is added to
/// `problems` as a sentence that names `file` and the line.
Table ReadTable(std::string_view text, const std::string& file, std::vector<std::string>& problems);

/// Every difference as a sentence that names the profile, the point (or option) and the field.
std::vector<std::string> Differences(const config::Profile& profile, const Table& table);

}  // namespace baudgate::testing
