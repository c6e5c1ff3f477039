// SPDX-License-Identifier: Apache-2.0
#include "tests/support/transcript_script.h"

#include <gtest/gtest.h>

#include <fstream>
#include <utility>

#include "config/catalog/option_values.h"
#include "config/loader.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate {
namespace {

std::vector<std::string> Words(std::string_view text) {
  std::vector<std::string> words;
  bool quoted = false;
  bool inside = false;
  for (const char c : text) {
    const bool blank = c == ' ' && !quoted;
    if (c == '"') quoted = !quoted;
    if (!blank && !inside) words.emplace_back();
    inside = !blank;
    if (!blank && c != '"') words.back() += c;
  }
  return words;
}

std::pair<std::string, std::string> KeyAndValue(const std::string& word) {
  const auto equals = word.find('=');
  if (equals == std::string::npos) return {word, ""};
  return {word.substr(0, equals), word.substr(equals + 1)};
}

std::optional<config::Type> TypeOf(std::string_view name) {
  for (int type = 0; type <= static_cast<int>(config::Type::string); ++type) {
    if (Name(static_cast<config::Type>(type)) == name) return static_cast<config::Type>(type);
  }
  return std::nullopt;
}

std::optional<Value> ValueOf(config::Type type, const std::string& text) {
  if (type == config::Type::string) return Value{text};
  if (text == "true" || text == "false") return Value{text == "true"};
  if (const auto whole = ParseInteger<std::int64_t>(text)) return Value{*whole};
  if (const auto number = ParseDecimal(text)) return Value{*number};
  return std::nullopt;
}

class Reader {
 public:
  Reader(const protocols::Protocol& protocol, const std::string& path)
      : protocol_(protocol), path_(path) {
    script_.device.name = "device";
    script_.device.protocol = protocol.name;
    script_.device.options = config::DefaultOptions(protocol);
    script_.line.protocol = protocol.name;
    script_.line.options = script_.device.options;
  }

  TranscriptScript Read() {
    std::ifstream file(path_);
    if (!file) Fail("cannot be read");
    for (std::string text; std::getline(file, text);) {
      ++line_;
      const std::string_view trimmed = Trim(text);
      if (trimmed.empty() || trimmed.front() == '#') continue;
      if (trimmed.starts_with("device:")) {
        Device(Words(trimmed.substr(7)));
      } else if (trimmed.starts_with("point:")) {
        Point(Words(trimmed.substr(6)));
      } else if (trimmed.starts_with("write:")) {
        Write(Words(trimmed.substr(6)));
      } else if (trimmed == "events:") {
        Begin(protocols::Task{.kind = protocols::Task::Kind::events});
      } else if (trimmed == "unasked:") {
        Begin({});
        script_.steps.back().unasked = true;
      } else {
        Exchange(trimmed.front(), Trim(trimmed.substr(1)));
      }
    }
    return std::move(script_);
  }

 private:
  void Fail(const std::string& message) const { ADD_FAILURE_AT(path_.c_str(), line_) << message; }

  void Device(const std::vector<std::string>& words) {
    for (const std::string& word : words) {
      const auto [key, value] = KeyAndValue(word);
      if (key == "address") {
        script_.device.address = value;
        continue;
      }
      if (key == "profile") {
        Profile(value);
        continue;
      }
      if (key == "events") {
        script_.device.events = true;
        continue;
      }
      bool known = false;
      for (const protocols::OptionSpec& spec : protocol_.options) {
        if (spec.name != key) continue;
        known = true;
        auto option = config::ParseOption(spec, value);
        if (!option) Fail(option.error());
        if (option) script_.device.options.Set(key, *option);
      }
      if (!known) Fail("no option " + key);
    }
    script_.line.options = script_.device.options;
  }

  void Profile(const std::string& name) {
    const config::Catalog catalog = {.protocols = {{std::string(protocol_.name), &protocol_}},
                                     .module_dirs = {},
                                     .profile_dirs = {"config/profiles"}};
    const auto loaded = config::LoadProfile(name, protocol_, catalog);
    for (const auto& problem : loaded.problems) Fail(ToString(problem));
    script_.device =
        config::DeviceFromProfile(loaded.profile, protocol_, "device", script_.device.address);
  }

  void Point(const std::vector<std::string>& words) {
    if (words.size() < 3) return Fail("a point has a name, read and type");
    config::Point point;
    point.name = words[0];
    point.read = words[1];
    const auto type = TypeOf(words[2]);
    if (!type) return Fail("no type " + words[2]);
    point.type = *type;
    point.text_length = 64;
    for (std::size_t i = 3; i < words.size(); ++i) Attribute(point, words[i]);
    if (const Status status = protocol_.check_point(point); !status) Fail(status.error());
    script_.device.points.push_back(std::move(point));
  }

  void Attribute(config::Point& point, const std::string& word) {
    const auto [key, value] = KeyAndValue(word);
    if (key == "rw") {
      point.access = config::Access::read_write;
    } else if (key == "w") {
      point.access = config::Access::write;
    } else if (key == "write") {
      point.write = value;
    } else if (key == "unit") {
      point.unit = value;
    } else if (key == "scale") {
      point.scale = ParseDecimal(value).value_or(1);
    } else {
      bool known = false;
      for (const auto group :
           {config::Group::once, config::Group::daily, config::Group::slow, config::Group::fast}) {
        if (Name(group) != word) continue;
        point.group = group;
        known = true;
      }
      if (!known) Fail("'" + word + "' is no group, rw, w, write=, unit= or scale=");
    }
  }

  void Write(const std::vector<std::string>& words) {
    if (words.size() != 2) return Fail("a write has a point and a value");
    for (std::size_t i = 0; i < script_.device.points.size(); ++i) {
      const config::Point& point = script_.device.points[i];
      if (point.name != words[0]) continue;
      const auto value = ValueOf(point.type, words[1]);
      if (!value) return Fail("no value: " + words[1]);
      auto raw = bus::ToRaw(point, *value);
      if (!raw) return Fail(raw.error());
      return Begin(protocols::Task{protocols::Task::Kind::write, 0, i, std::move(*raw)});
    }
    Fail("no point " + words[0]);
  }

  void Begin(std::optional<protocols::Task> task) {
    TranscriptStep step;
    step.line = line_;
    step.task = std::move(task);
    script_.steps.push_back(std::move(step));
    silence_ = false;
  }

  void Exchange(char mark, std::string_view rest) {
    if (mark == '>') return Request(Hex(rest));
    if (script_.steps.empty()) return Fail("a request stands first");
    TranscriptStep& step = script_.steps.back();
    if (mark == '<') {
      step.reply.push_back({Hex(rest), std::exchange(silence_, false), std::exchange(wait_, {})});
    } else if (mark == '+') {
      const auto wait = ParseDuration(rest);
      if (!wait) return Fail("no duration");
      silence_ = true;
      wait_ = *wait;
    } else if (mark == '=') {
      step.values.emplace_back(rest);
    } else if (mark == '!') {
      step.outcome = OutcomeOf(rest);
    } else {
      Fail("lines begin with # device: point: write: events: unasked: > < + = or !");
    }
  }

  void Request(Bytes bytes) {
    silence_ = false;
    const bool first = !script_.steps.empty() && script_.steps.back().task &&
                       !script_.steps.back().request && script_.steps.back().outcome == Outcome::ok;
    if (!first) script_.steps.emplace_back();
    script_.steps.back().line = line_;
    script_.steps.back().request = std::move(bytes);
  }

  Bytes Hex(std::string_view text) const {
    auto bytes = ParseHex(text);
    if (!bytes) Fail("not hex");
    return bytes.value_or(Bytes());
  }

  Outcome OutcomeOf(std::string_view name) const {
    for (std::size_t i = 0; i < kOutcomeCount; ++i) {
      if (Name(static_cast<Outcome>(i)) == name) return static_cast<Outcome>(i);
    }
    Fail("no outcome " + std::string(name));
    return Outcome::none;
  }

  const protocols::Protocol& protocol_;
  const std::string& path_;
  int line_ = 0;
  bool silence_ = false;
  Duration wait_{};
  TranscriptScript script_;
};

}  // namespace

TranscriptScript ReadTranscript(const protocols::Protocol& protocol, const std::string& path) {
  return Reader(protocol, path).Read();
}

}  // namespace baudgate
