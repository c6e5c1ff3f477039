// SPDX-License-Identifier: Apache-2.0
#include "config/options.h"

#include "config/catalog/option_values.h"

namespace baudgate::config {
namespace {

std::optional<OptionValue> ReadTexts(const YamlNode& node, const std::string& name,
                                     Problems& problems) {
  std::vector<std::string> texts;
  for (const YamlNode& element : ReadList(node, name, 1000, problems)) {
    if (auto text = ReadText(element, name, problems)) texts.push_back(std::move(*text));
  }
  return texts;
}

std::optional<OptionValue> ReadPairs(const YamlNode& node, const std::string& name,
                                     Problems& problems) {
  Pairs pairs;
  for (const Entry& entry : ReadEntries(node, name, problems)) {
    if (auto text = ReadText(entry.value, name, problems)) pairs[entry.key] = std::move(*text);
  }
  return pairs;
}

std::optional<OptionValue> ReadOption(const YamlNode& node, const OptionSpec& spec,
                                      const Protocol& protocol, Problems& problems) {
  const std::string name(spec.name);
  if (spec.kind == OptionSpec::Kind::description) {
    return DescriptionRef{protocol.describe(node, problems)};
  }
  if (spec.kind == OptionSpec::Kind::pairs && node.kind() == YamlNode::Kind::map) {
    return ReadPairs(node, name, problems);
  }
  if (spec.kind == OptionSpec::Kind::texts && node.kind() == YamlNode::Kind::list) {
    return ReadTexts(node, name, problems);
  }
  const auto text = ReadText(node, name, problems);
  if (!text) return std::nullopt;
  // A text is taken as it stands, commas and all; only where a list is meant they separate.
  auto value = ParseOption(spec, *text);
  if (value) return std::move(*value);
  problems.Error(node.mark(), name + ": " + value.error());
  return std::nullopt;
}

/// Lists and pairs as `--set` takes them.
std::string WrittenText(const YamlNode& node, const OptionValue& value) {
  if (const auto* pairs = std::get_if<Pairs>(&value)) {
    std::string joined;
    for (const auto& [word, text] : *pairs) {
      joined += (joined.empty() ? "" : ",") + word + "=" + text;
    }
    return joined;
  }
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  if (texts == nullptr) return std::string(node.text());
  std::string joined;
  for (const std::string& text : *texts) joined += (joined.empty() ? "" : ",") + text;
  return joined;
}

}  // namespace

Options ReadOptions(MapReader& map, const Protocol& protocol, OptionSpec::Scope scope) {
  Options options;
  for (const OptionSpec& spec : protocol.options) {
    if (spec.scope != scope) {
      map.Refuse(spec.name, "'" + std::string(spec.name) + "' belongs to the " +
                                (scope == OptionSpec::Scope::line ? "devices, not to the line"
                                                                  : "line, not to its devices"));
      continue;
    }
    const auto node = map.Get(spec.name);
    if (!node) continue;
    if (auto value = ReadOption(*node, spec, protocol, map.problems())) {
      const bool shown = !spec.secret && spec.kind != OptionSpec::Kind::description;
      if (shown) options.SetWritten(std::string(spec.name), WrittenText(*node, *value));
      options.Set(std::string(spec.name), std::move(*value));
    }
  }
  return options;
}

}  // namespace baudgate::config
