// What is wrong with a configuration, and where: gathered while files are read, shown all at once.
// Written by the readers of config/, printed by gateway/tools/cli/offline/check.h. Mark is where
// something stands in its file, and Keys where the keys of one map stand.
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

// Where something of the configuration stands in its file.

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

struct Problem {
  Mark mark;
  std::string message;   ///< one line: what is wrong and what would be right; never a secret
  bool warning = false;  ///< the configuration can be used nevertheless
};

/// "file:line:column: error: message"; only the file where no line is known.
std::string ToString(const Problem& problem);

bool HasError(const std::vector<Problem>& problems);

/// Collects problems; the same one at the same place counts once, and beyond kMost they are
/// dropped.
class Problems {
 public:
  static constexpr std::size_t kMost = 500;

  /// A key whose value no message may show, not even where a slip made both one text.
  void AddSecret(std::string_view key) { secrets_.emplace(key); }
  bool IsSecret(const std::string& key) const { return secrets_.contains(key); }
  /// QuotedKey, and of a secret's key with something behind it only the former.
  std::string ShownKey(const std::string& key) const;

  void Error(const Mark& mark, std::string message) { Add(mark, std::move(message), false); }
  void Warning(const Mark& mark, std::string message) { Add(mark, std::move(message), true); }

  bool has_error() const { return HasError(problems_); }
  bool HasErrorIn(const std::string& file) const;
  /// In the order of the files and of the places in them.
  std::vector<Problem> Sorted() const;

 private:
  void Add(const Mark& mark, std::string message, bool warning);

  std::set<std::string> secrets_;
  std::vector<Problem> problems_;
  std::vector<std::string> files_;
  std::set<std::tuple<std::string, int, int, std::string>> seen_;
};

}  // namespace baudgate::config
