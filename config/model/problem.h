// `Problems` collects the errors and warnings of a configuration with their positions, while files
// are read. The readers of config/ add problems, gateway/tools/cli/offline/check.h prints them.
// Mark is a position in a file, and Keys contains the positions of one map's keys.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "config/model/fields.h"

namespace baudgate::config {

/// A position in a file, for messages: "file:line:column". Line 0: there is no file.
struct Mark {
  Shared<std::string> file;
  int line = 0;
  int column = 0;

  std::string ToString() const;
};

/// The keys of one map of a file with their positions, so that a check of the struct that was read
/// from the map can report where a wrong key is. Empty for a struct that comes from no file.
///
///     - name: feeder-1      map: 7:3, values: { name: 7:9, poll: 8:9 }
///       poll: 1s
struct Keys {
  Mark map;
  std::map<std::string, Mark, std::less<>> values;

  bool Has(std::string_view key) const { return values.find(key) != values.end(); }
  /// Returns the position of the value of `key`; the position of the map if the key is absent.
  const Mark& MarkOf(std::string_view key) const;
};

struct Problem {
  Mark mark;
  std::string message;   ///< one line with the fault and the remedy; never contains a secret
  bool warning = false;  ///< true: the configuration can be used nevertheless
};

/// Returns "file:line:column: error: message"; only the file if no line is known.
std::string ToString(const Problem& problem);

bool HasError(const std::vector<Problem>& problems);

/// Collects problems. The same problem at the same position is added once, and problems beyond
/// kMost are dropped.
class Problems {
 public:
  static constexpr std::size_t kMost = 500;

  /// Registers a key whose value must not appear in any message, even if a typing error merges key
  /// and value into one text.
  void AddSecret(std::string_view key) { secrets_.emplace(key); }
  bool IsSecret(const std::string& key) const { return secrets_.contains(key); }
  /// Returns the key in quotes, for messages. If the text begins with a secret key, the part behind
  /// that key is hidden.
  std::string ShownKey(const std::string& key) const;

  void Error(const Mark& mark, std::string message) { Add(mark, std::move(message), false); }
  void Warning(const Mark& mark, std::string message) { Add(mark, std::move(message), true); }

  bool has_error() const { return HasError(problems_); }
  bool HasErrorIn(const std::string& file) const;
  /// Returns the problems in the order of the files and of the positions in them.
  std::vector<Problem> Sorted() const;

 private:
  void Add(const Mark& mark, std::string message, bool warning);

  std::set<std::string> secrets_;
  std::vector<Problem> problems_;
  std::vector<std::string> files_;
  std::set<std::tuple<std::string, int, int, std::string>> seen_;
};

}  // namespace baudgate::config
