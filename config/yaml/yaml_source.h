// `YamlNode` is a node of a parsed YAML text together with its position. The text comes from a file
// or from memory; config/yaml_reader reads the nodes. ParseYaml catches the exceptions of parsing;
// later access to a node can still throw.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <yaml-cpp/yaml.h>

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/fields.h"
#include "config/model/line.h"
#include "config/model/problem.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// A line and a column of the text, counted from 1; 0: unknown.
struct Position {
  int line = 0;
  int column = 0;
};

class Source {
 public:
  Source(std::string name, std::string text);

  const std::string& name() const { return *name_; }
  /// Converts a position of yaml-cpp, which counts bytes, to columns in characters, as editors
  /// count.
  Position At(const YAML::Mark& mark) const;
  Mark MarkAt(Position place) const { return {name_, place.line, place.column}; }
  /// Returns a line without its line end; empty beyond the text. Lines count from 1.
  std::string_view Line(int line) const;
  int lines() const { return static_cast<int>(line_starts_.size()); }
  const std::string& text() const { return text_; }

 private:
  Shared<std::string> name_;
  std::string text_;
  std::vector<std::size_t> line_starts_;
};

/// A node and its source. Copies are cheap and share the tree. Assignment makes this object refer
/// to another node and does not change the tree, unlike assignment of YAML::Node.
class YamlNode {
 public:
  enum class Kind { null, scalar, list, map };

  YamlNode(const YAML::Node& node, std::shared_ptr<const Source> source,
           std::optional<Position> key = {});
  YamlNode(const YamlNode&) = default;
  YamlNode& operator=(const YamlNode& other);

  Kind kind() const;
  /// Returns the text of a scalar as written, without quotes.
  const std::string& text() const { return node_.Scalar(); }
  /// Returns the position of the value; if there is no value, the position of its key.
  Position place() const { return place_; }
  Mark mark() const { return source_->MarkAt(place_); }

  const YAML::Node& yaml() const { return node_; }
  const std::shared_ptr<const Source>& source() const { return source_; }

 private:
  YAML::Node node_;
  std::shared_ptr<const Source> source_;
  Position place_;
};

/// Parses `text` and returns its root; on an error reports one problem and returns nothing. Texts
/// beyond 4 MiB or 200,000 nodes are refused before the tree is built, so a hostile text takes at
/// most some 100 MB for a moment; yaml-cpp refuses nesting beyond a few hundred levels.
std::optional<YamlNode> ParseYaml(std::string name, std::string text, Problems& problems);

/// Returns the content of a file; an error if it cannot be read or exceeds 4 MiB.
Result<std::string> ReadWholeFile(const std::string& path);

}  // namespace baudgate::config
