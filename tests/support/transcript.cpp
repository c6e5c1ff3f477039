// SPDX-License-Identifier: Apache-2.0
#include "tests/support/transcript.h"

#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <optional>
#include <vector>

#include "config/option_table.h"
#include "gateway/base/text.h"
#include "gateway/line/assembler.h"
#include "gateway/store/conversion.h"

namespace baudgate {
namespace {

constexpr int kMostSteps = 8;

struct Piece {
  Bytes bytes;
  bool after_silence = false;  // a time stood before it
};

/// One request and what came of it.
struct Step {
  int line = 0;
  Bytes request;
  std::vector<Piece> reply;
  Outcome outcome = Outcome::ok;
  std::vector<std::string> values;  // "name value quality"
};

struct Script {
  config::Line line;
  config::Device device;
  std::vector<Step> steps;
};

std::vector<std::string> Words(std::string_view text) {
  std::vector<std::string> words;
  for (const std::string_view word : Split(text, ' ')) {
    if (!word.empty()) words.emplace_back(word);
  }
  return words;
}

/// Reads a file and reports what it does not understand as a failure at its line.
class Reader {
 public:
  Reader(const Protocol& protocol, const std::string& path) : protocol_(protocol), path_(path) {
    script_.device.name = "device";
    script_.device.protocol = protocol.name;
    script_.device.options = config::DefaultOptions(protocol);
    script_.line.protocol = protocol.name;
    script_.line.options = script_.device.options;
  }

  Script Read() {
    std::ifstream file(path_);
    if (!file) Fail("can not be read");
    for (std::string text; std::getline(file, text);) {
      ++line_;
      const std::string_view trimmed = Trim(text);
      if (trimmed.empty() || trimmed.front() == '#') continue;
      if (trimmed.starts_with("device:")) {
        Device(Words(trimmed.substr(7)));
      } else if (trimmed.starts_with("point:")) {
        Point(Words(trimmed.substr(6)));
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
      const auto equals = word.find('=');
      const std::string key = word.substr(0, equals);
      const std::string value = equals == std::string::npos ? "" : word.substr(equals + 1);
      if (key == "address") {
        script_.device.address = value;
        continue;
      }
      bool known = false;
      for (const OptionSpec& spec : protocol_.options) {
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

  void Point(const std::vector<std::string>& words) {
    config::Point point;
    if (words.size() < 3) return Fail("a point has a name, read and type");
    point.name = words[0];
    point.read = words[1];
    for (char& c : point.read) c = c == '_' ? ' ' : c;
    point.access = config::Access::read_write;
    bool known = false;
    for (int type = 0; type <= static_cast<int>(config::Type::string); ++type) {
      point.type = static_cast<config::Type>(type);
      known = Name(point.type) == words[2];
      if (known) break;
    }
    if (!known) Fail("no type " + words[2]);
    point.text_length = 64;
    for (const config::Group group : {config::Group::once, config::Group::slow}) {
      if (words.size() > 3 && Name(group) == words[3]) point.group = group;
    }
    if (const Status status = protocol_.check_point(point); !status) Fail(status.error());
    script_.device.points.push_back(std::move(point));
  }

  void Exchange(char mark, std::string_view rest) {
    if (mark == '>') {
      script_.steps.push_back({line_, Hex(rest), {}, Outcome::ok, {}});
      silence_ = false;
      return;
    }
    if (script_.steps.empty()) return Fail("a request stands first");
    Step& step = script_.steps.back();
    if (mark == '<') {
      step.reply.push_back({Hex(rest), std::exchange(silence_, false)});
    } else if (mark == '+') {
      if (!ParseDuration(rest)) Fail("no duration");
      silence_ = true;
    } else if (mark == '=') {
      step.values.emplace_back(rest);
    } else if (mark == '!') {
      step.outcome = OutcomeOf(rest);
    } else {
      Fail("lines begin with # device: point: > < + = or !");
    }
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

  const Protocol& protocol_;
  const std::string& path_;
  int line_ = 0;
  bool silence_ = false;
  Script script_;
};

/// What a line does with the reply, without its clock.
Answer Carry(const Protocol& protocol, Conversation& conversation, const Task& task,
             const Request& request, const Step& step, Instant now) {
  Assembler assembler;
  assembler.Begin(protocol.reply_rule, request.expect);
  std::optional<Bytes> frame;
  for (const Piece& piece : step.reply) {
    if (piece.after_silence) frame = assembler.Next(true);
    if (frame) break;
    assembler.Feed(piece.bytes);
    frame = assembler.Next(false);
    if (frame) break;
  }
  if (!frame) frame = assembler.Next(true);
  if (frame) return conversation.OnFrame(task, request, *frame, now);
  Answer answer;
  answer.outcome = assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame();
  answer.then = conversation.OnFailure(task, request, answer.outcome, now);
  return answer;
}

std::vector<std::string> ValuesOf(const config::Device& device, const Answer& answer) {
  std::vector<std::string> values;
  for (const Reading& reading : answer.readings) {
    if (reading.point >= device.points.size()) continue;
    const config::Point& point = device.points[reading.point];
    const Sample sample = ToSample(point, reading);
    const std::string value = HasValue(sample.value) ? ToText(sample.value) + " " : "";
    values.push_back(point.name + " " + value + std::string(Name(sample.quality)));
  }
  return values;
}

class Player {
 public:
  Player(const Protocol& protocol, const std::string& path, Script script)
      : protocol_(protocol), path_(path), script_(std::move(script)) {}

  void Play() {
    const auto bus = protocol_.make_bus(script_.line);
    const auto conversation = bus->MakeConversation(script_.device);
    std::size_t query = 0;
    while (next_ < script_.steps.size() && !::testing::Test::HasFailure()) {
      const std::size_t count = conversation->Queries().size();
      if (count == 0) return Fail(script_.steps[next_], "the conversation asks for nothing");
      const Then then = PlayTask(*conversation, {Task::Kind::poll, query % count, kNoPoint, {}});
      query = then == Then::replan ? 0 : query + 1;
    }
  }

 private:
  void Fail(const Step& step, const std::string& message) const {
    ADD_FAILURE_AT(path_.c_str(), step.line) << message;
  }

  Then PlayTask(Conversation& conversation, const Task& task) {
    for (int i = 0; i < kMostSteps && next_ < script_.steps.size(); ++i) {
      const Step& step = script_.steps[next_++];
      now_ += 1s;
      const auto request = conversation.Ask(task, now_);
      if (!request) {
        Fail(step, request.error());
        return Then::done;
      }
      EXPECT_EQ(ToHex(request->bytes), ToHex(step.request)) << path_ << ":" << step.line;
      const Answer answer = Carry(protocol_, conversation, task, *request, step, now_);
      EXPECT_EQ(Name(answer.outcome), Name(step.outcome))
          << path_ << ":" << step.line << ": " << answer.reason;
      EXPECT_EQ(ValuesOf(script_.device, answer), step.values) << path_ << ":" << step.line;
      if (answer.then != Then::ask_again) return answer.then;
    }
    return Then::done;
  }

  const Protocol& protocol_;
  const std::string& path_;
  Script script_;
  std::size_t next_ = 0;
  Instant now_ = Instant() + 1h;
};

}  // namespace

void PlayTranscript(const Protocol& protocol, const std::string& path) {
  Script script = Reader(protocol, path).Read();
  if (script.steps.empty()) ADD_FAILURE_AT(path.c_str(), 1) << "no exchange in it";
  Player(protocol, path, std::move(script)).Play();
}

}  // namespace baudgate
