// One YAML text, parsed: its nodes, and where each of them stands. Bytes come from a file or from
// memory; nodes go to config/yaml_reader. The only place that sees what yaml-cpp throws.
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

/// A place in a source, counted from 1; 0 = nowhere.
struct Position {
  int line = 0;
  int column = 0;
};

class Source {
 public:
  Source(std::string name, std::string text);

  const std::string& name() const { return *name_; }
  /// Columns count characters, as editors do, where yaml-cpp counts bytes.
  Position At(const YAML::Mark& mark) const;
  Mark MarkAt(Position place) const { return {name_, place.line, place.column}; }
  /// Without its line end; empty beyond the text. Lines count from 1.
  std::string_view Line(int line) const;
  int lines() const { return static_cast<int>(line_starts_.size()); }
  const std::string& text() const { return text_; }

 private:
  Shared<std::string> name_;
  std::string text_;
  std::vector<std::size_t> line_starts_;
};

/// A node and its source. Copies are cheap and share the tree, which is not changed: assignment
/// makes this one refer to another node, where that of YAML::Node would write into the tree.
class YamlNode {
 public:
  enum class Kind { null, scalar, list, map };

  YamlNode(const YAML::Node& node, std::shared_ptr<const Source> source,
           std::optional<Position> key = {});
  YamlNode(const YamlNode&) = default;
  YamlNode& operator=(const YamlNode& other);

  Kind kind() const;
  /// The text of a scalar as written, without its quotes.
  const std::string& text() const { return node_.Scalar(); }
  /// The place of the value, or of its key where there is no value.
  Position place() const { return place_; }
  Mark mark() const { return source_->MarkAt(place_); }

  const YAML::Node& yaml() const { return node_; }
  const std::shared_ptr<const Source>& source() const { return source_; }

 private:
  YAML::Node node_;
  std::shared_ptr<const Source> source_;
  Position place_;
};

/// The root of `text`, or nothing and one problem. Texts beyond 16 MiB are refused; yaml-cpp itself
/// refuses nesting beyond a few hundred levels.
std::optional<YamlNode> ParseYaml(std::string name, std::string text, Problems& problems);

/// The content of a file; an error when it cannot be read or is too large.
Result<std::string> ReadWholeFile(const std::string& path);

}  // namespace baudgate::config
