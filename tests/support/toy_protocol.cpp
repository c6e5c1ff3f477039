// SPDX-License-Identifier: Apache-2.0
#include "tests/support/toy_protocol.h"

#include <algorithm>
#include <set>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

struct Words {
  char address = 0;
  std::string number;
  std::string rest;
};

std::optional<Words> Read(std::string_view text) {
  Words words;
  if (!text.empty() && text.front() >= 'A' && text.front() <= 'Z') {
    words.address = text.front();
    text.remove_prefix(1);
  }
  const auto digits = std::min(text.find_first_not_of("0123456789"), text.size());
  words.number = text.substr(0, digits);
  words.rest = text.substr(digits);
  return words;
}

protocols::Cut ToyRequestRule(View held, const protocols::Expectation&, bool) {
  const auto end = std::find(held.begin(), held.end(), '\r');
  if (end == held.end()) return protocols::Cut::NeedMore();
  return protocols::Cut::Frame(static_cast<std::size_t>(end - held.begin()) + 1);
}

protocols::Cut ToyReplyRule(View held, const protocols::Expectation&, bool) {
  if (held[0] == 0) return protocols::Cut::Discard(1, Outcome::none, "the line came alive");
  if (held[0] != '!') return protocols::Cut::Discard(1, Outcome::corrupt, "noise before frame");
  const auto end = std::find(held.begin(), held.end(), '\r');
  if (end == held.end()) return protocols::Cut::NeedMore();
  const auto size = static_cast<std::size_t>(end - held.begin()) + 1;
  const View body = held.first(size < 5 ? 0 : size - 4);
  if (body.empty() || held[size - 4] != '*' ||
      AsText(held.subspan(size - 3, 2)) != HexByte(Sum8(body))) {
    return protocols::Cut::Discard(1, Outcome::corrupt, "checksum");
  }
  return protocols::Cut::Frame(size);
}

protocols::Expectation ToyExpect(View request, const protocols::ParsedOptions&) {
  protocols::Expectation expect;
  expect.max_bytes = 64;
  if (request.empty()) return expect;
  if (request[0] != 'U' && request.size() > 1) expect.address = {request[1]};
  if (request[0] == 'Q') expect.reply = protocols::Expectation::Reply::none;
  expect.repeatable = request[0] != 'L' && request[0] != 'W' && request[0] != 'Q';
  return expect;
}

class ToyConversation final : public protocols::Conversation {
 public:
  explicit ToyConversation(const config::Device& device) : device_(device) { Plan(); }

  std::span<const protocols::Query> Queries() const override { return queries_; }

  Result<protocols::Request> Ask(const protocols::Task& task, Instant) override {
    if (task.kind == protocols::Task::Kind::probe) {
      if (IsOnlyWritten()) return Error{"nothing of it can be read"};
      protocols::Request request = Make("P0");
      request.steady = true;
      return request;
    }
    const bool write = task.kind == protocols::Task::Kind::write;
    const std::size_t point = write ? task.point : queries_.at(task.query).points.front();
    const auto [how, number] = Split(device_.points[point].read);
    if (how == 'E') return Error{"this point cannot be asked"};
    if (how == 'S' && closing_) {
      protocols::Request request = Make("C0");
      request.closes = true;
      return request;
    }
    if (how == 'S' && !open_) return Make("O9");
    if (write) return Make((how == 'Q' ? "Q" : "W") + number + "=" + ToText(task.value));
    if (how == 'N' && !std::exchange(announced_, false)) return Make("Q" + number);
    if (how == 'L' || how == 'D') return Make("L" + number);
    if (how == 'U') return Make("U" + number);
    return Make("?" + number);
  }

  protocols::Then OnSent(const protocols::Task& task, const protocols::Request&, Instant) override {
    announced_ =
        task.kind == protocols::Task::Kind::poll && device_.points[PointOf(task)].read[0] == 'N';
    return announced_ ? protocols::Then::ask_again : protocols::Then::done;
  }

  protocols::Answer OnFrame(const protocols::Task& task, const protocols::Request& request,
                            View frame, Instant) override {
    protocols::Answer answer;
    const auto got = Read(AsText(frame.subspan(1, frame.size() - 5)));
    const auto asked = Read(AsText(request.bytes).substr(1));
    const char kind = static_cast<char>(request.bytes[0]);
    if (got->rest != "~odd" && Check(request.bytes, frame) == Outcome::unexpected) {
      answer.outcome = Outcome::unexpected;
      answer.reason = "an answer to another request";
      return answer;
    }
    const std::string& rest = got->rest;
    if (rest == "~closed") {
      open_ = false;
      answer.then = protocols::Then::ask_again;
      return answer;
    }
    if (rest.starts_with("~")) return OnWord(task, rest.substr(1));
    return OnContent(task, kind, rest);
  }

  /// A request of kind U accepts any reply without an address.
  Outcome Check(View request, View frame) const override {
    const auto got = Read(AsText(frame.subspan(1, frame.size() - 5)));
    const auto asked = Read(AsText(request).substr(1));
    const bool fits = request[0] == 'U'
                          ? got->address == 0
                          : got->address == asked->address && got->number == asked->number;
    if (!fits || got->rest == "~odd") return Outcome::unexpected;
    if (got->rest == "~busy") return Outcome::busy;
    if (got->rest == "~refused") return Outcome::refused;
    const bool words = got->rest.starts_with("~") && got->rest != "~closed" &&
                       got->rest != "~fault" && got->rest != "~nan" && got->rest != "~foreign" &&
                       got->rest != "~events";
    return words ? Outcome::unsupported : Outcome::ok;
  }

  protocols::Then OnFailure(const protocols::Task& task, const protocols::Request& request,
                            Outcome outcome, Instant) override {
    const bool close = task.kind == protocols::Task::Kind::write && InSession(task) && !closing_;
    closing_ = close;
    if (close) failed_write_ = true;
    if (!close) open_ = false;
    if (request.bytes[0] == 'B' && outcome != Outcome::busy) {
      dropped_.insert(PointOf(task));
      Plan();
      return protocols::Then::replan;
    }
    return close ? protocols::Then::ask_again : protocols::Then::done;
  }

  std::optional<protocols::Request> Instead(const protocols::Request& request, Outcome,
                                            Instant) override {
    if (request.bytes[0] != 'L') return std::nullopt;
    for (const config::Point& point : device_.points) {
      const auto [how, number] = Split(point.read);
      if (how == 'L' && AsText(request.bytes).substr(2) == number + "\r") return Make("B" + number);
    }
    return std::nullopt;
  }

  bool ForgetRefusals() override {
    if (dropped_.empty()) return false;
    dropped_.clear();
    Plan();
    return true;
  }

  const protocols::DeviceTrouble& trouble() const override { return trouble_; }

  void OnReconnect() override {
    open_ = closing_ = failed_write_ = false;
    dropped_.clear();
    Plan();
  }

  protocols::Answer Interpret(View request, View frame) override {
    return OnFrame({}, {Bytes(request.begin(), request.end()), {}}, frame, {});
  }

 private:
  static std::pair<char, std::string> Split(const std::string& read) {
    const bool plain = read.empty() || (read[0] >= '0' && read[0] <= '9');
    return plain ? std::pair{'?', read} : std::pair{read[0], read.substr(1)};
  }

  void Plan() {
    queries_.clear();
    for (std::size_t i = 0; i < device_.points.size(); ++i) {
      const bool read = !device_.points[i].read.starts_with("V") && !dropped_.contains(i);
      if (read) queries_.push_back({device_.points[i].group, {i}});
    }
  }

  bool IsOnlyWritten() const {
    return std::ranges::all_of(
        device_.points, [](const config::Point& point) { return point.read.starts_with("V"); });
  }

  std::size_t PointOf(const protocols::Task& task) const {
    if (task.kind == protocols::Task::Kind::write) return task.point;
    return task.query < queries_.size() ? queries_[task.query].points.front() : protocols::kNoPoint;
  }
  bool InSession(const protocols::Task& task) const {
    return PointOf(task) != protocols::kNoPoint &&
           device_.points[PointOf(task)].read.starts_with("S");
  }

  protocols::Request Make(const std::string& text) const {
    protocols::Request request;
    request.bytes = ToBytes(text.substr(0, 1) + device_.address + text.substr(1) + "\r");
    request.expect = ToyExpect(request.bytes, {});
    request.prepares = text[0] == 'O';
    return request;
  }

  protocols::Answer OnWord(const protocols::Task& task, const std::string& word) {
    protocols::Answer answer;
    answer.reason = "the device says " + word;
    if (word == "busy") {
      answer.outcome = Outcome::busy;
      answer.wait = device_.options.Time("wait");
    } else if (word == "odd") {
      answer.outcome = Outcome::refused;
    } else if (word == "events") {
      answer.batch.emplace();
    } else if (word == "refused") {
      answer.outcome = Outcome::refused;
      if (task.kind == protocols::Task::Kind::write && InSession(task)) {
        closing_ = failed_write_ = true;
        answer.then = protocols::Then::ask_again;
      }
    } else if (word == "replan") {
      dropped_.insert(PointOf(task));
      Plan();
      answer.outcome = Outcome::unsupported;
      answer.then = protocols::Then::replan;
    } else if (word == "fault") {
      answer.readings.push_back({PointOf(task), {}, Quality::bad_sensor_failure, {}});
    } else if (word == "foreign") {
      trouble_ = {Reason::other_module, "it is not A"};
    } else if (word == "nan") {
      answer.readings.push_back(
          {PointOf(task), std::numeric_limits<double>::quiet_NaN(), Quality::good, {}});
    } else {
      answer.outcome = Outcome::unsupported;
    }
    return answer;
  }

  protocols::Answer OnContent(const protocols::Task& task, char kind, const std::string& rest) {
    protocols::Answer answer;
    if (kind == 'O') {
      open_ = true;
      answer.then = protocols::Then::ask_again;
    } else if (kind == 'C') {
      open_ = closing_ = false;
      if (std::exchange(failed_write_, false)) answer.outcome = Outcome::refused;
    } else if (kind == 'W' && InSession(task)) {
      closing_ = true;
      answer.then = protocols::Then::ask_again;
    } else if (kind == 'W' || kind == 'P') {
    } else if (const auto value = ParseDecimal(rest.empty() ? rest : rest.substr(1))) {
      answer.readings.push_back({PointOf(task), *value, Quality::good, {}});
      trouble_ = {};
    } else {
      answer.outcome = Outcome::unexpected;
    }
    return answer;
  }

  const config::Device& device_;
  std::vector<protocols::Query> queries_;
  std::set<std::size_t> dropped_;
  bool open_ = false;
  bool closing_ = false;
  bool failed_write_ = false;
  bool announced_ = false;
  protocols::DeviceTrouble trouble_;
};

class ToyTwin final : public protocols::Twin {
 public:
  ToyTwin(const config::Device& device, protocols::TwinValues& values)
      : device_(device), values_(values), reply_as_(device.address) {}

  void ReplyAs(std::string_view address) override { reply_as_ = address; }

  Bytes Answer(View request, Instant now) override {
    if (request.size() < 4 || AsText(request).substr(1, 1) != device_.address) return {};
    const char kind = static_cast<char>(request[0]);
    const auto asked = Read(AsText(request.first(request.size() - 1)).substr(1));
    const std::string tag = reply_as_ + asked->number;
    if (kind == 'P' || kind == 'O' || kind == 'C') return ToyReply(tag);
    for (std::size_t i = 0; i < device_.points.size(); ++i) {
      std::string_view read = device_.points[i].read;
      if (!read.empty() && (read[0] < '0' || read[0] > '9')) read.remove_prefix(1);
      if (read != asked->number) continue;
      if (kind == 'W' || kind == 'Q') {
        if (!asked->rest.empty()) values_.Set(i, *ParseDecimal(asked->rest.substr(1)));
        return kind == 'Q' ? Bytes() : ToyReply(tag);
      }
      return ToyReply((kind == 'U' ? "" : tag) + "=" + ToText(values_.Get(i, now)));
    }
    return ToyReply(tag + "~unsupported");
  }

 private:
  const config::Device& device_;
  protocols::TwinValues& values_;
  std::string reply_as_;
};

/// Makes the longest exchange take 1 s at every bit rate.
constexpr protocols::TimingRule kTiming = {.quiet = {.least = 5ms},
                                           .reply = {.least = 200ms},
                                           .gap = {.least = 20ms},
                                           .drain = {.least = 50ms},
                                           .longest = 1'000'000,
                                           .gaps = 0,
                                           .longest_time = {.least = 800ms}};

}  // namespace

Bytes ToyReply(std::string_view body) {
  Bytes frame = ToBytes("!" + std::string(body));
  Append(frame, "*" + HexByte(Sum8(frame)) + "\r");
  return frame;
}

config::Options ToyOptions() {
  config::Options options;
  options.Set("wait", Duration(50ms).count());
  return options;
}

const protocols::Protocol& ToyProtocol() {
  static const protocols::OptionSpec kOptions[] = {{.name = "wait",
                                                    .kind = protocols::OptionSpec::Kind::duration,
                                                    .fallback = "50ms",
                                                    .help = "pause after busy",
                                                    .choices = {}}};
  static const protocols::Protocol protocol = [] {
    protocols::Protocol p;
    p.name = "toy";
    p.title = "Toy";
    p.options = kOptions;
    p.canonical_address = [](std::string_view address) {
      return Result<std::string>(std::string(address));
    };
    p.check_point = [](const config::Point&) { return Status(); };
    p.timing = kTiming;
    p.request_rule = ToyRequestRule;
    p.reply_rule = ToyReplyRule;
    p.expect = ToyExpect;
    p.make_conversation = [](const config::Device& device, const protocols::ParsedOptions&,
                             protocols::Bus*) -> std::unique_ptr<protocols::Conversation> {
      return std::make_unique<ToyConversation>(device);
    };
    p.make_twin = [](const config::Device& device,
                     protocols::TwinValues& values) -> std::unique_ptr<protocols::Twin> {
      return std::make_unique<ToyTwin>(device, values);
    };
    return p;
  }();
  return protocol;
}

}  // namespace baudgate
