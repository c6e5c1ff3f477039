// SPDX-License-Identifier: Apache-2.0
#include "config/yaml/yaml_reader.h"

#include <algorithm>
#include <map>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

// The limit is above any real map; it bounds the work that aliases of a hostile file can cause.
constexpr std::size_t kMostKeys = 1000;

/// The merge key "<<: *common" is an error, so keys that it would add are not reported as missing.
constexpr std::string_view kMerge = "<<";

std::string_view Describe(YamlNode::Kind kind) {
  switch (kind) {
    case YamlNode::Kind::null:
      return "nothing";
    case YamlNode::Kind::scalar:
      return "a single value";
    case YamlNode::Kind::list:
      return "a list";
    case YamlNode::Kind::map:
      return "a map";
  }
  return "nothing";
}

bool ExpectScalar(const YamlNode& node, const std::string& what, Problems& problems) {
  const std::string& tag = node.yaml().Tag();
  if (tag.size() > 1 && tag.front() == '!') {
    problems.Error(node.mark(), what + ": a value that begins with '!' needs quotes");
    return false;
  }
  if (node.kind() == YamlNode::Kind::scalar) return true;
  problems.Error(node.mark(),
                 what + ": expected a single value, found " + std::string(Describe(node.kind())));
  return false;
}

bool BeginsWithDigit(std::string_view text) {
  return !text.empty() && text.front() >= '0' && text.front() <= '9';
}

std::string Allowed(std::int64_t least, std::int64_t most) {
  return "allowed: " + std::to_string(least) + "…" + std::to_string(most);
}

/// Returns true if the node is a single value without a leading zero; else reports a problem.
bool ExpectNumber(const YamlNode& node, const std::string& what, Problems& problems) {
  if (!ExpectScalar(node, what, problems)) return false;
  const std::string why = WhyLeadingZero(node.text());
  if (!why.empty()) problems.Error(node.mark(), what + ": " + Quoted(node.text()) + " " + why);
  return why.empty();
}

}  // namespace

std::vector<Entry> ReadEntries(const YamlNode& map, const std::string& what, Problems& problems) {
  std::vector<Entry> entries;
  if (map.kind() != YamlNode::Kind::map) {
    problems.Error(map.mark(), what + ": expected a map (key: value), found " +
                                   std::string(Describe(map.kind())));
    return entries;
  }
  std::map<std::string, Position> first;
  for (const auto& pair : map.yaml()) {
    const YamlNode key(pair.first, map.source());
    if (entries.size() == kMostKeys) {
      problems.Error(key.mark(),
                     what + ": has too many keys; at most " + std::to_string(kMostKeys));
      break;
    }
    if (key.kind() != YamlNode::Kind::scalar) {
      problems.Error(key.mark(), what + ": a key must be a single word");
      continue;
    }
    if (key.text() == kMerge) {
      problems.Error(key.mark(), what + ": '<<' (merge) is not supported; write its keys out");
    }
    const auto [earlier, is_new] = first.emplace(key.text(), key.place());
    if (!is_new) {
      problems.Error(key.mark(), "key " + problems.ShownKey(key.text()) + " occurs twice in " +
                                     what + "; first in line " +
                                     std::to_string(earlier->second.line));
      continue;
    }
    entries.push_back({key.text(), key.place(), YamlNode(pair.second, map.source(), key.place())});
  }
  return entries;
}

std::vector<YamlNode> ReadList(const YamlNode& list, const std::string& what, std::size_t most,
                               Problems& problems) {
  std::vector<YamlNode> elements;
  if (list.kind() != YamlNode::Kind::list) {
    problems.Error(list.mark(),
                   what + ": expected a list, found " + std::string(Describe(list.kind())));
    return elements;
  }
  for (const auto& element : list.yaml()) {
    if (elements.size() == most) {
      problems.Error(list.mark(), what + ": more than " + std::to_string(most) +
                                      " entries are not possible; remove some");
      break;
    }
    elements.emplace_back(element, list.source());
  }
  return elements;
}

std::optional<std::string> ReadText(const YamlNode& node, const std::string& what,
                                    Problems& problems) {
  if (!ExpectScalar(node, what, problems)) return std::nullopt;
  return node.text();
}

std::optional<bool> ReadFlag(const YamlNode& node, const std::string& what, Problems& problems) {
  if (!ExpectScalar(node, what, problems)) return std::nullopt;
  for (const std::string_view yes : {"true", "yes", "on"}) {
    if (node.text() == yes) return true;
  }
  for (const std::string_view no : {"false", "no", "off"}) {
    if (node.text() == no) return false;
  }
  problems.Error(node.mark(), what + ": " + Quoted(node.text()) + " is neither true nor false");
  return std::nullopt;
}

std::optional<Decimal> ReadNumber(const YamlNode& node, const std::string& what,
                                  Problems& problems) {
  if (!ExpectNumber(node, what, problems)) return std::nullopt;
  const auto value = Decimal::Parse(node.text());
  if (!value) {
    const std::string meant = WithDecimalPoint(node.text());
    problems.Error(node.mark(),
                   what + ": " + Quoted(node.text()) +
                       (meant.empty() ? " is not a decimal number; write for example 0.001"
                                      : " has a decimal comma; write " + meant));
  }
  return value;
}

std::optional<std::int64_t> ReadInteger(const YamlNode& node, const std::string& what,
                                        std::int64_t least, std::int64_t most, Problems& problems) {
  if (!ExpectNumber(node, what, problems)) return std::nullopt;
  const std::string quoted = Quoted(node.text());
  const auto value = ParseInteger<std::int64_t>(node.text());
  if (!value) {
    problems.Error(node.mark(),
                   what + ": " + quoted + " is not a whole number; " + Allowed(least, most));
    return std::nullopt;
  }
  if (*value < least || *value > most) {
    problems.Error(node.mark(), what + ": " + quoted + " is out of range; " + Allowed(least, most));
    return std::nullopt;
  }
  return value;
}

std::optional<Duration> ReadDuration(const YamlNode& node, const std::string& what, Duration least,
                                     Duration most, Problems& problems) {
  if (!ExpectNumber(node, what, problems)) return std::nullopt;
  const auto value = ParseDuration(node.text());
  if (!value) {
    problems.Error(node.mark(), what + ": " + value.error());
    return std::nullopt;
  }
  if (*value < least || *value > most) {
    problems.Error(node.mark(), what + ": " + Quoted(node.text()) + " is out of range; allowed: " +
                                    FormatDuration(least) + "…" + FormatDuration(most));
    return std::nullopt;
  }
  return *value;
}

std::optional<std::size_t> ReadChoice(const YamlNode& node, const std::string& what,
                                      std::span<const std::string_view> allowed,
                                      Problems& problems) {
  if (!ExpectScalar(node, what, problems)) return std::nullopt;
  const auto found = std::find(allowed.begin(), allowed.end(), node.text());
  if (found != allowed.end()) return static_cast<std::size_t>(found - allowed.begin());
  problems.Error(node.mark(), what + ": " + Quoted(node.text()) + " is unknown;" +
                                  DidYouMean(node.text(), allowed) + " allowed: " + Join(allowed));
  return std::nullopt;
}

MapReader::MapReader(const YamlNode& map, std::string what, Problems& problems)
    : entries_(ReadEntries(map, what, problems)),
      mark_(map.mark()),
      what_(std::move(what)),
      problems_(problems) {}

MapReader::MapReader(std::vector<Entry> entries, Mark mark, std::string what, Problems& problems)
    : entries_(std::move(entries)),
      mark_(std::move(mark)),
      what_(std::move(what)),
      problems_(problems) {}

const Entry* MapReader::Find(std::string_view key) const {
  const auto found = std::find_if(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.key == key; });
  return found == entries_.end() ? nullptr : &*found;
}

void MapReader::Allow(std::string_view key) {
  if (std::find(allowed_.begin(), allowed_.end(), key) == allowed_.end()) {
    allowed_.emplace_back(key);
  }
}

std::optional<YamlNode> MapReader::Get(std::string_view key) {
  Allow(key);
  const Entry* entry = Find(key);
  if (!entry) return std::nullopt;
  if (entry->value.kind() != YamlNode::Kind::null) return entry->value;
  const std::string_view line = entry->value.source()->Line(entry->place.line);
  const bool comment = line.find(": #") != std::string_view::npos;
  const bool anchor = line.find(entry->key + ": &") != std::string_view::npos;
  problems_.Error(
      entry->value.mark(),
      entry->key + ": has no value; " +
          (comment  ? "text after '#' is a comment; put a value that begins with '#' in quotes"
           : anchor ? "put a value that begins with '&' in quotes"
                    : "write a value or remove the key"));
  return std::nullopt;
}

std::optional<YamlNode> MapReader::Need(std::string_view key, std::string_view example) {
  if (!Find(key) && !Find(kMerge)) {
    problems_.Error(mark_, what_ + " needs '" + std::string(key) + "'; for example " +
                               std::string(key) + ": " + std::string(example));
  }
  return Get(key);
}

void MapReader::Refuse(std::string_view key, const std::string& message) {
  const Entry* entry = Find(key);
  if (!entry) return;
  problems_.Error(entry->value.source()->MarkAt(entry->place), message);
  std::erase_if(entries_, [&](const Entry& other) { return other.key == key; });
}

Mark MapReader::MarkOf(std::string_view key) const {
  const Entry* entry = Find(key);
  return entry ? entry->value.mark() : mark_;
}

Keys MapReader::keys() const {
  Keys keys{mark_, {}};
  for (const Entry& entry : entries_) keys.values.emplace(entry.key, entry.value.mark());
  return keys;
}

std::optional<std::string> MapReader::Text(std::string_view key) {
  const auto node = Get(key);
  if (!node) return std::nullopt;
  return ReadText(*node, std::string(key), problems_);
}

std::optional<std::string> MapReader::Label(std::string_view key) {
  auto text = Text(key);
  const auto is_control = [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || static_cast<unsigned char>(c) == 0x7F;
  };
  if (!text || std::none_of(text->begin(), text->end(), is_control)) return text;
  problems_.Error(MarkOf(key), std::string(key) + ": control characters are not allowed");
  return std::nullopt;
}

std::optional<bool> MapReader::Flag(std::string_view key) {
  const auto node = Get(key);
  if (!node) return std::nullopt;
  return ReadFlag(*node, std::string(key), problems_);
}

std::optional<Decimal> MapReader::Number(std::string_view key) {
  const auto node = Get(key);
  if (!node) return std::nullopt;
  return ReadNumber(*node, std::string(key), problems_);
}

std::optional<Duration> MapReader::Time(std::string_view key, Duration least, Duration most) {
  const auto node = Get(key);
  if (!node) return std::nullopt;
  return ReadDuration(*node, std::string(key), least, most, problems_);
}

void MapReader::Finish() {
  if (allow_all_) return;
  const std::vector<std::string_view> allowed(allowed_.begin(), allowed_.end());
  std::string before;
  for (const Entry& entry : entries_) {
    const std::string behind = std::exchange(before, entry.key);
    if (std::find(allowed.begin(), allowed.end(), entry.key) != allowed.end()) continue;
    if (entry.key == kMerge) continue;  // already reported by ReadEntries
    const Mark mark = entry.value.source()->MarkAt(entry.place);
    // RET in "{ password: SEC,RET }" is a key without a value, and a part of the secret.
    if (problems_.IsSecret(behind) && entry.value.kind() == YamlNode::Kind::null) {
      problems_.Error(mark, "a key without a value follows '" + behind + "' in " + what_ +
                                "; put a value that contains a comma in quotes");
      continue;
    }
    if (BeginsWithDigit(entry.key) && entry.value.kind() == YamlNode::Kind::null) {
      problems_.Error(mark, "a number without a key follows '" + behind + "' in " + what_ +
                                "; write decimals with a point, not a comma: 1.5s");
      continue;
    }
    const std::string missing = MissingMark(entry.key);
    problems_.Error(mark, "unknown key " + problems_.ShownKey(entry.key) + " in " + what_ + ";" +
                              (missing.empty() ? DidYouMean(entry.key, allowed) : missing) +
                              " allowed: " + Join(allowed));
  }
}

}  // namespace baudgate::config
