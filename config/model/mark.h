// Where something of the configuration stands in its file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "config/model/shared.h"

namespace baudgate::config {

/// Where something stands in a file, for messages: "file:line:column". Line 0 = not from a file.
struct Mark {
  Shared<std::string> file;
  int line = 0;
  int column = 0;

  std::string ToString() const;
};

/// The keys that stand in one map of a file, so that a check of the struct that was read from it
/// can name the place of the key that is wrong. Of a struct that comes from no file: none.
///
///     - name: feeder-1      map: 7:3, values: { name: 7:9, poll: 8:9 }
///       poll: 1s
struct Keys {
  Mark map;
  std::map<std::string, Mark, std::less<>> values;

  bool Has(std::string_view key) const { return values.find(key) != values.end(); }
  /// Where the value of `key` stands; the map itself when it is absent.
  const Mark& MarkOf(std::string_view key) const;
};

}  // namespace baudgate::config
