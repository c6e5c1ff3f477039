// `MapReader` and the functions here read YAML nodes as typed values and collect problems instead
// of stopping at the first: unknown and duplicate keys, wrong kinds, numbers out of range.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include "config/model/fields.h"
#include "config/model/problem.h"
#include "config/yaml/yaml_source.h"
#include "gateway/base/time.h"

namespace baudgate::config {

struct Entry {
  std::string key;
  Position place;
  YamlNode value;
};

/// Returns the entries of a map. Reports a node that is not a map, keys that are not texts, and
/// duplicate keys (which yaml-cpp accepts silently); the first duplicate is used. `what` names the
/// map in messages: "device 'feeder-1'".
std::vector<Entry> ReadEntries(const YamlNode& map, const std::string& what, Problems& problems);

/// Returns at most `most` elements of a list; a longer list, or a node that is not a list, is a
/// problem.
std::vector<YamlNode> ReadList(const YamlNode& list, const std::string& what, std::size_t most,
                               Problems& problems);

// These functions read a scalar of one kind. On an error they return nothing and report one problem
// that begins with `what`.
std::optional<std::string> ReadText(const YamlNode& node, const std::string& what,
                                    Problems& problems);
std::optional<bool> ReadFlag(const YamlNode& node, const std::string& what, Problems& problems);
std::optional<Decimal> ReadNumber(const YamlNode& node, const std::string& what,
                                  Problems& problems);
std::optional<std::int64_t> ReadInteger(const YamlNode& node, const std::string& what,
                                        std::int64_t least, std::int64_t most, Problems& problems);
std::optional<Duration> ReadDuration(const YamlNode& node, const std::string& what, Duration least,
                                     Duration most, Problems& problems);
/// Reads a word, and returns its index in `allowed`.
std::optional<std::size_t> ReadChoice(const YamlNode& node, const std::string& what,
                                      std::span<const std::string_view> allowed,
                                      Problems& problems);

template <typename Parse>
auto ReadParsed(const YamlNode& node, const std::string& what, Problems& problems, Parse parse)
    -> std::optional<std::remove_cvref_t<decltype(parse(std::string()).value())>> {
  const auto text = ReadText(node, what, problems);
  if (!text) return std::nullopt;
  auto value = parse(*text);
  if (value) return std::move(*value);
  problems.Error(node.mark(), what + ": " + value.error());
  return std::nullopt;
}

/// Reads a word and returns its meaning; `words` is a list of Word.
template <typename Words>
auto ReadWord(const YamlNode& node, const std::string& what, const Words& words, Problems& problems)
    -> std::optional<std::remove_cvref_t<decltype(words[0].meaning)>> {
  std::vector<std::string_view> names;
  for (const auto& one : words) names.push_back(one.word);
  const auto index = ReadChoice(node, what, names, problems);
  if (!index) return std::nullopt;
  return words[*index].meaning;
}

template <typename T, typename U>
bool Assign(T& target, std::optional<U> value) {
  if (value) target = std::move(*value);
  return value.has_value();
}

/// MapReader reads a map key by key. Each requested key becomes an allowed key; Finish reports all
/// other keys.
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

  /// Returns the value of `key`; nothing if the key is absent, or has no value, which is reported
  /// as a problem.
  std::optional<YamlNode> Get(std::string_view key);
  /// Like Get, but an absent key is a problem; the message shows `example`.
  std::optional<YamlNode> Need(std::string_view key, std::string_view example);
  /// Reports `message` if the key is present, because the key is not allowed in this map.
  void Refuse(std::string_view key, const std::string& message);
  /// Allows all keys, because the protocol that defines them is unknown.
  void AllowAll() { allow_all_ = true; }
  /// Returns the position of the value of `key`; the position of the map if the key is absent.
  Mark MarkOf(std::string_view key) const;
  Keys keys() const;

  std::optional<std::string> Text(std::string_view key);
  /// Reads a text for people; control characters are errors.
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
  template <typename Words>
  auto OneOf(std::string_view key, const Words& words)
      -> std::optional<std::remove_cvref_t<decltype(words[0].meaning)>> {
    const auto node = Get(key);
    if (!node) return std::nullopt;
    return ReadWord(*node, std::string(key), words, problems_);
  }

  /// Reads a field's key as a word, a flag, a number or time in its range, or a text.
  template <auto kMember, typename T = typename Field<kMember>::Value>
  requires std::is_enum_v<T> || std::integral<T> || std::same_as<T, Duration> ||
      std::same_as<T, Decimal> || std::same_as<T, std::string>
          std::optional<T> Value(const Field<kMember>& field) {
    const std::string_view key = field.key.substr(field.key.rfind('.') + 1);
    if (!field.words.empty()) return OneOf(key, field.words);
    if constexpr (std::same_as<T, bool>) {
      return Flag(key);
    } else if constexpr (std::integral<T>) {
      return Integer<T>(key, field.least, field.most);
    } else if constexpr (std::same_as<T, Duration>) {
      return Time(key, field.least, field.most);
    } else if constexpr (std::same_as<T, Decimal>) {
      return Number(key);
    } else if constexpr (std::same_as<T, std::string>) {
      return Text(key);
    }
    return std::nullopt;
  }
  /// Reads the keys of these fields of `its`, in this order. Absent keys leave their members
  /// unchanged. Returns true if all keys were present and valid.
  template <auto... kMembers, typename T>
  bool Read(T& its) {
    bool given = true;
    const auto visit = [&]<typename Wanted>(std::type_identity<Wanted>) {
      VisitFields(&its, [&](auto field) {
        if constexpr (std::same_as<decltype(field), Wanted>) {
          given &= Assign(its.*field.member, Value(field));
        }
      });
    };
    (visit(std::type_identity<Field<kMembers>>()), ...);
    return given;
  }
  /// Reads the keys of all fields with `help`, which are those in the table of keys.
  template <typename T>
  void ReadAll(T& its) {
    VisitFields(&its, [&](auto field) {
      if constexpr (requires { Value(field); }) {
        if (!field.help.empty()) Assign(its.*field.member, Value(field));
      }
    });
  }

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

}  // namespace baudgate::config
