// Typed access to YAML nodes that gathers problems instead of stopping at the first: unknown and
// duplicate keys, wrong kinds, numbers out of range. Nodes come from config/yaml_source; values go
// to the readers of lines, outputs and points.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/problem.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/time.h"

namespace baudgate::config {

/// One key of a map, and what stands there.
struct Entry {
  std::string key;
  Position place;  ///< of the key
  YamlNode value;
};

/// The entries of a map. Reports what is no map, keys that are no text, and duplicates (which
/// yaml-cpp accepts silently); the first of two wins. `what` names the map: "device 'feeder-1'".
std::vector<Entry> ReadEntries(const YamlNode& map, const std::string& what, Problems& problems);

/// The elements of a list, at most `most`; a problem when it is no list or longer.
std::vector<YamlNode> ReadList(const YamlNode& list, const std::string& what, std::size_t most,
                               Problems& problems);

// A scalar as a value of one kind, or nothing and one problem that begins with `what`.
std::optional<std::string> ReadText(const YamlNode& node, const std::string& what,
                                    Problems& problems);
std::optional<bool> ReadFlag(const YamlNode& node, const std::string& what, Problems& problems);
std::optional<Decimal> ReadNumber(const YamlNode& node, const std::string& what,
                                  Problems& problems);
std::optional<std::int64_t> ReadInteger(const YamlNode& node, const std::string& what,
                                        std::int64_t least, std::int64_t most, Problems& problems);
std::optional<Duration> ReadDuration(const YamlNode& node, const std::string& what, Duration least,
                                     Duration most, Problems& problems);
/// The index in `allowed`.
std::optional<std::size_t> ReadChoice(const YamlNode& node, const std::string& what,
                                      std::span<const std::string_view> allowed,
                                      Problems& problems);

/// A word of the configuration and what it stands for.
template <typename T>
struct Word {
  std::string_view word;
  T meaning;
};

template <typename T, std::size_t kCount>
std::optional<T> ReadWord(const YamlNode& node, const std::string& what,
                          const std::array<Word<T>, kCount>& words, Problems& problems) {
  std::array<std::string_view, kCount> names;
  for (std::size_t i = 0; i < kCount; ++i) names[i] = words[i].word;
  const auto index = ReadChoice(node, what, names, problems);
  if (!index) return std::nullopt;
  return words[*index].meaning;
}

/// Reads a map key by key. Every key that is asked for is thereby allowed; Finish reports the rest.
class MapReader {
 public:
  /// `what` names the map in messages: "line 'bay-1'".
  MapReader(const YamlNode& map, std::string what, Problems& problems);
  MapReader(std::vector<Entry> entries, Mark mark, std::string what, Problems& problems);

  const std::string& what() const { return what_; }
  void Rename(std::string what) { what_ = std::move(what); }
  Mark mark() const { return mark_; }
  bool Has(std::string_view key) const { return Find(key) != nullptr; }
  Problems& problems() const { return problems_; }

  /// The value of `key`; nothing when the key is absent or has no value (which is a problem).
  std::optional<YamlNode> Get(std::string_view key);
  /// Get, and a problem when the key is absent.
  std::optional<YamlNode> Need(std::string_view key, std::string_view example);
  /// A key that is known but cannot stand here: `message` says why.
  void Refuse(std::string_view key, const std::string& message);
  /// Keys that cannot be judged, because what would allow them is unknown itself.
  void AllowAll() { allow_all_ = true; }
  /// Where the value of `key` stands; the map itself when it is absent.
  Mark MarkOf(std::string_view key) const;
  /// The places of all keys, for checks of what was read.
  Keys keys() const;

  std::optional<std::string> Text(std::string_view key);
  /// A text that is shown to people: without control characters.
  std::optional<std::string> Label(std::string_view key);
  std::optional<bool> Flag(std::string_view key);
  std::optional<Decimal> Number(std::string_view key);
  std::optional<Duration> Time(std::string_view key, Duration least, Duration most);
  template <std::integral T>
  std::optional<T> Integer(std::string_view key, T least, T most) {
    const auto node = Get(key);
    if (!node) return std::nullopt;
    const auto value = ReadInteger(*node, std::string(key), static_cast<std::int64_t>(least),
                                   static_cast<std::int64_t>(most), problems_);
    if (!value) return std::nullopt;
    return static_cast<T>(*value);
  }
  template <typename T, std::size_t kCount>
  std::optional<T> OneOf(std::string_view key, const std::array<Word<T>, kCount>& words) {
    const auto node = Get(key);
    if (!node) return std::nullopt;
    return ReadWord(*node, std::string(key), words, problems_);
  }

  /// Reports every key that was not asked for.
  void Finish();

 private:
  const Entry* Find(std::string_view key) const;
  void Allow(std::string_view key);

  std::vector<Entry> entries_;
  std::vector<std::string> allowed_;
  Mark mark_;
  std::string what_;
  Problems& problems_;
  bool allow_all_ = false;
};

/// Puts what was read where it belongs, and leaves the default where nothing was.
template <typename T, typename U>
void Assign(T& target, std::optional<U> value) {
  if (value) target = std::move(*value);
}

}  // namespace baudgate::config
