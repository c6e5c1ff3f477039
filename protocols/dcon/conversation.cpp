// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <algorithm>
#include <functional>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/expect.h"

namespace baudgate::protocols::dcon {
namespace {

/// A command that this module may not know is silent for ever, and so is a dead module. After so
/// many silences, while other commands are answered, it is the command.
constexpr int kSilencesOfAnUnknownCommand = 3;

bool IsDigital(const std::optional<ReadAddress>& read) {
  return read && (read->form == Form::bits || read->form == Form::status);
}

std::string Label(const Command& request, const Decoded& decoded, const Field& field) {
  const bool joined = decoded.form == Form::numbers || decoded.form == Form::words;
  return joined ? request.text + "[" + std::to_string(field.channel) + "]" : request.text;
}

/// The module's name. No module takes it for a write, with or without checksum.
constexpr const char* kIdentify = "$M";
constexpr const char* kReadAll = "#";

/// Rough length of a reply, to find the cheapest probe.
std::size_t Cost(Form form, std::size_t points) {
  if (form == Form::numbers) return 2 + 7 * points;
  return form == Form::words ? 2 + 4 * points : 10;
}

}  // namespace

DconConversation::DconConversation(const config::Device& device)
    : device_(device),
      settings_(ReadSettings(device.options)),
      address_(ParseAddress(device.address)) {
  for (std::size_t i = 0; i < device.points.size(); ++i) AddPoint(i);
  own_probe_ = MakeOwnProbe();
}

void DconConversation::AddPoint(std::size_t index) {
  const config::Point& point = device_.points[index];
  reads_.emplace_back();
  if (point.access == config::Access::write) return;
  const auto read = ParseRead(point.read);
  if (!read) return;  // check_point has told the user
  reads_.back() = *read;
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (plans_[i].command == read->command && plans_[i].form == read->form &&
        plans_[i].group == point.group) {
      queries_[i].points.push_back(index);
      return;
    }
  }
  queries_.push_back({.group = point.group, .points = {index}});
  plans_.push_back({.command = read->command, .form = read->form, .group = point.group});
}

Request DconConversation::MakeRequest(std::string_view command) const {
  Request request;
  request.bytes = BuildRequest(command, address_.value(), settings_.checksum);
  request.expect = Expect(request.bytes, device_.options);
  return request;
}

Result<Request> DconConversation::Ask(const Task& task, Instant) {
  if (!address_) return Error{address_.error()};
  if (task.kind == Task::Kind::write) return AskWrite(task);
  read_back_.reset();
  if (task.kind == Task::Kind::probe) {
    const std::string command = ProbeCommand();
    Request request = MakeRequest(command);
    request.steady = command == kIdentify;
    return request;
  }
  if (task.query >= plans_.size()) return Error{"there is no query of this number"};
  return MakeRequest(plans_[task.query].command);
}

Result<Request> DconConversation::AskWrite(const Task& task) {
  if (task.point >= device_.points.size()) return Error{"there is no point of this number"};
  if (read_back_ && read_back_->point == task.point && read_back_->value == task.value) {
    return MakeRequest(reads_[task.point]->command);
  }
  read_back_.reset();
  const config::Point& point = device_.points[task.point];
  const auto write = ParseWrite(point.write);
  if (!write) return Error{write.error()};
  const auto command = FormatWrite(*write, task.value);
  if (!command) return Error{"point " + point.name + ": " + command.error()};
  return MakeRequest(*command);
}

/// What is answered as no poll is: the name, or one channel where polls read all of them together.
/// Empty: there is no such request.
std::string DconConversation::MakeOwnProbe() const {
  if (settings_.identify || plans_.empty()) return kIdentify;
  const auto polls = [this](const std::function<bool(const std::string&)>& wanted) {
    return std::ranges::any_of(plans_, [&](const Plan& plan) { return wanted(plan.command); });
  };
  if (!polls([](const std::string& command) { return command == kReadAll; })) return {};
  if (polls([](const std::string& command) { return command != kReadAll && command[0] == '#'; })) {
    return {};
  }
  std::size_t first = ExpectedChannels(kReadAll);
  if (first < 2) return {};
  for (const auto& read : reads_) {
    if (read && read->command == kReadAll) first = std::min<std::size_t>(first, read->index);
  }
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return first < kDigits.size() ? kReadAll + std::string(1, kDigits[first]) : std::string();
}

/// While it does not answer its own probe: the cheapest read that is known to work; while none is,
/// the first, because profiles begin with what always works.
std::string DconConversation::BestProbe() const {
  const bool unknown = !probe_known_ && silent_probes_ >= kSilencesOfAnUnknownCommand;
  if ((!own_probe_.empty() && !unknown) || plans_.empty()) return own_probe_;
  const Plan* best = &plans_.front();
  std::size_t best_cost = 0;
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (!plans_[i].proven || !IsRepeatable(plans_[i].command)) continue;
    const std::size_t cost = Cost(plans_[i].form, queries_[i].points.size());
    if (best_cost != 0 && cost >= best_cost) continue;
    best = &plans_[i];
    best_cost = cost;
  }
  return best->command;
}

/// Every second failed probe gives way to another command: the module may not know the best one. A
/// read in its place could be answered by another module that is behind, so one without a name is
/// asked nothing else once it has answered.
std::string DconConversation::ProbeCommand() const {
  const bool nameless = probe_known_ && own_probe_ != kIdentify;
  if (failed_probes_ % 2 == 0 || plans_.empty() || nameless) return BestProbe();
  const std::string& other = plans_[(failed_probes_ + 1) / 2 % plans_.size()].command;
  return IsRepeatable(other) ? other : BestProbe();
}

std::size_t DconConversation::ExpectedChannels(std::string_view command) const {
  if (settings_.channels != 0) return settings_.channels;
  std::size_t count = 0;
  for (const auto& read : reads_) {
    if (read && read->command == command && read->select == ReadAddress::Select::index) {
      count = std::max<std::size_t>(count, read->index + 1);
    }
  }
  return count;
}

std::optional<Form> DconConversation::PlannedForm(std::string_view command) const {
  for (const auto& read : reads_) {
    if (read && read->command == command) return read->form;
  }
  return std::nullopt;
}

Answer DconConversation::Read(const Command& command, const Decoded& decoded) const {
  Answer answer;
  answer.outcome = decoded.outcome;
  answer.reason = decoded.reason;
  std::vector<bool> used(decoded.fields.size(), false);
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    if (!reads_[i] || reads_[i]->command != command.text) continue;
    if (decoded.outcome == Outcome::unsupported) {
      answer.readings.push_back({i, {}, Quality::bad_configuration, {}});
      continue;
    }
    if (decoded.outcome != Outcome::ok) continue;
    if (reads_[i]->form != decoded.form) {  // two decoders for one command: the first point's holds
      answer.readings.push_back({i, {}, Quality::bad_configuration, {}});
      continue;
    }
    const bool indexed = reads_[i]->select == ReadAddress::Select::index;
    for (std::size_t k = 0; k < used.size(); ++k) {
      if (!indexed || decoded.fields[k].channel == reads_[i]->index) used[k] = true;
    }
    Field field = Select(decoded, *reads_[i]);
    answer.readings.push_back({i, std::move(field.value), field.quality, {}});
  }
  if (decoded.outcome != Outcome::ok) return answer;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const Field& field = decoded.fields[k];
    if (used[k]) continue;
    answer.readings.push_back(
        {kNoPoint, field.value, field.quality, Label(command, decoded, field)});
  }
  return answer;
}

Answer DconConversation::Interpret(View request, View frame) {
  const auto command = ParseRequest(request, settings_.checksum);
  if (!command) {
    Answer answer;
    answer.outcome = Outcome::corrupt;
    answer.reason = "request '" + Printable(request) + "' is no DCON request" +
                    (settings_.checksum ? " with a good checksum; is checksum: true right?" : "");
    return answer;
  }
  const std::size_t channels = ExpectedChannels(command->text);
  return Read(*command,
              DecodeReply(*command, PlannedForm(command->text), channels, frame, settings_));
}

Answer DconConversation::OnFrame(const Task& task, const Request& request, View frame, Instant) {
  Answer answer = Interpret(request.bytes, frame);
  std::erase_if(answer.readings, [](const Reading& r) { return r.point == kNoPoint; });
  const auto command = ParseRequest(request.bytes, settings_.checksum);
  if (!command) return answer;
  return Settle(task, *command, std::move(answer));
}

/// What a decoded answer changes in the session.
Answer DconConversation::Settle(const Task& task, const Command& command, Answer answer) {
  if (task.kind != Task::Kind::write) {
    // The answer to another probe may be one to an earlier request: the poller knows.
    const bool own = task.kind != Task::Kind::probe || command.text == own_probe_;
    if (own && ProvesLife(answer.outcome)) failed_probes_ = 0;
    if (answer.outcome == Outcome::ok && command.text == own_probe_) probe_known_ = true;
    if (answer.outcome == Outcome::ok) answer.then = Learn(command.text, true);
    if (answer.outcome == Outcome::unsupported) answer.then = Learn(command.text, false);
    return answer;
  }
  const auto& read = task.point < reads_.size() ? reads_[task.point] : std::nullopt;
  if (read_back_) {
    read_back_.reset();
    const auto own = std::find_if(answer.readings.begin(), answer.readings.end(),
                                  [&](const Reading& r) { return r.point == task.point; });
    const bool differs = answer.outcome == Outcome::ok && own != answer.readings.end() &&
                         ToDouble(own->value) != ToDouble(task.value);
    if (differs) {
      answer.outcome = Outcome::refused;
      answer.reason = "the write was confirmed, but " + device_.points[task.point].name +
                      " reads back as " + ToText(own->value);
    }
    return answer;
  }
  // A bare '>' proves only that some module took something. An analog output may slew, so only a
  // digital one can be compared.
  if (answer.outcome == Outcome::ok && IsDigital(read)) {
    read_back_ = ReadBack{task.point, task.value};
    answer.then = Then::ask_again;
  }
  return answer;
}

/// A query that works keeps its group; one that the module refuses is asked with the slow group, so
/// that a channel enabled later comes back by itself.
Then DconConversation::Learn(std::string_view command, bool answered) {
  Then then = Then::done;
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    if (plans_[i].command != command) continue;
    plans_[i].answered = answered;
    plans_[i].proven = plans_[i].proven || answered;
    plans_[i].silences = 0;
    if (!answered) {
      if (Demote(i) == Then::replan) then = Then::replan;
    } else if (queries_[i].group != plans_[i].group) {
      queries_[i].group = plans_[i].group;
      then = Then::replan;
    }
  }
  return then;
}

Then DconConversation::Demote(std::size_t query) {
  if (queries_[query].group != config::Group::fast) return Then::done;
  queries_[query].group = config::Group::slow;
  return Then::replan;
}

Then DconConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                 Instant) {
  read_back_.reset();
  if (task.kind == Task::Kind::probe) ++failed_probes_;
  const bool own = task.kind == Task::Kind::probe && !own_probe_.empty() &&
                   request.bytes == MakeRequest(own_probe_).bytes;
  if (own && outcome == Outcome::no_reply) ++silent_probes_;
  if (task.kind != Task::Kind::poll || outcome != Outcome::no_reply) return Then::done;
  if (task.query >= plans_.size()) return Then::done;
  Plan& plan = plans_[task.query];
  const bool alive =
      std::any_of(plans_.begin(), plans_.end(), [](const Plan& p) { return p.answered; });
  if (plan.answered || !alive || ++plan.silences < kSilencesOfAnUnknownCommand) return Then::done;
  return Demote(task.query);
}

void DconConversation::OnReconnect() {
  silent_probes_ = 0;
  read_back_.reset();
  for (std::size_t i = 0; i < plans_.size(); ++i) {
    plans_[i].answered = false;
    plans_[i].silences = 0;
    queries_[i].group = plans_[i].group;
  }
}

std::unique_ptr<Conversation> DconBus::MakeConversation(const config::Device& device) {
  return std::make_unique<DconConversation>(device);
}

}  // namespace baudgate::protocols::dcon
