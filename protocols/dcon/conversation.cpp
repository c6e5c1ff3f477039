// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/dcon/expect.h"

namespace baudgate::protocols::dcon {
namespace {

bool IsDigital(const std::optional<ReadAddress>& read) {
  return read && (read->form == Form::bits || read->form == Form::status);
}

std::string Label(const Command& request, const DecodedReply& reply, const Field& field) {
  const bool joined = reply.form == Form::numbers || reply.form == Form::words;
  return joined ? request.text + "[" + std::to_string(field.channel) + "]" : request.text;
}

/// The module's name: no module takes the request for a write, with or without checksum.
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
      address_(ParseAddress(device.address).value()),
      plan_({}),
      probes_(ProbeChoice::Own::none) {
  PlanReads();
  own_probe_ = MakeOwnProbe();
  if (own_probe_.empty()) return;
  const bool names = own_probe_ == kIdentify;
  probes_ = ProbeChoice(names ? ProbeChoice::Own::identification : ProbeChoice::Own::read);
}

void DconConversation::PlanReads() {
  for (std::size_t i = 0; i < device_.points.size(); ++i) {
    const config::Point& point = device_.points[i];
    reads_.emplace_back();
    if (point.access == config::Access::write) continue;
    const auto read = ParseRead(point.read);
    if (!read) continue;  // check_point has told the user
    reads_.back() = *read;
    plan_.Add(point.group, i, {read->command, read->form});
  }
  plan_.Make();
}

Request DconConversation::MakeRequest(std::string_view command) const {
  Request request;
  request.bytes = BuildRequest(command, address_, settings_.checksum);
  request.expect = Expect(request.bytes, device_.options);
  return request;
}

Result<Request> DconConversation::Ask(const Task& task, Instant) {
  if (task.kind == Task::Kind::write) return AskWrite(task);
  read_back_.reset();
  if (task.kind == Task::Kind::probe) {
    const std::string command = ProbeCommand();
    Request request = MakeRequest(command);
    request.steady = command == kIdentify;
    request.distinct = command == own_probe_;
    return request;
  }
  return MakeRequest(plan_.block(task.query).key.command);
}

Result<Request> DconConversation::AskWrite(const Task& task) {
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
  if (settings_.identify || plan_.queries().empty()) return kIdentify;
  // One channel is a poll of its own where any command but `#` begins with '#'.
  bool all_together = false;
  for (const auto& read : reads_) {
    if (!read || read->command[0] != '#') continue;
    if (read->command != kReadAll) return {};
    all_together = true;
  }
  if (!all_together) return {};
  std::size_t first = ExpectedChannels(kReadAll);
  if (first < 2) return {};
  for (const auto& read : reads_) {
    if (read && read->command == kReadAll) first = std::min<std::size_t>(first, read->index);
  }
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return first < kDigits.size() ? kReadAll + std::string(1, kDigits[first]) : std::string();
}

/// A read in place of its own probe: the cheapest that is known to work; while none is, the first,
/// because profiles begin with what always works.
std::string DconConversation::ProbeCommand() const {
  std::vector<std::string> reads;
  std::size_t best = 0;
  std::size_t best_cost = 0;
  for (std::size_t query = 0; query < plan_.queries().size(); ++query) {
    const Read& read = plan_.block(query).key;
    if (!IsRepeatable(read.command)) continue;
    reads.push_back(read.command);
    const std::size_t cost = Cost(read.form, plan_.queries()[query].points.size());
    if (!plan_.IsProven(query) || (best_cost != 0 && cost >= best_cost)) continue;
    best = reads.size() - 1;
    best_cost = cost;
  }
  const auto read = probes_.Next(reads.size(), best);
  if (read) return reads[*read];
  return own_probe_.empty() ? kIdentify : own_probe_;
}

/// The first query that sends the command; queries().size(): none does.
std::size_t DconConversation::QueryOf(std::string_view command) const {
  std::size_t query = 0;
  while (query < plan_.queries().size() && plan_.block(query).key.command != command) ++query;
  return query;
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

std::optional<DconConversation::Exchanged> DconConversation::Decode(View request,
                                                                    View frame) const {
  const auto command = ParseRequest(request, settings_.checksum);
  if (!command) return std::nullopt;
  const std::size_t channels = ExpectedChannels(command->text);
  return Exchanged{*command,
                   DecodeReply(*command, PlannedForm(command->text), channels, frame, settings_)};
}

/// Of every point that the command reads.
Answer DconConversation::ReadingsOf(const Exchanged& exchanged) const {
  const DecodedReply& reply = exchanged.reply;
  Answer answer;
  answer.outcome = reply.outcome;
  answer.reason = reply.reason;
  for (std::size_t i = 0; i < reads_.size(); ++i) {
    if (!reads_[i] || reads_[i]->command != exchanged.command.text) continue;
    // Two decoders for one command: that of the first point holds, the other can not be right.
    const bool wrong_form = reply.outcome == Outcome::ok && reads_[i]->form != reply.form;
    if (reply.outcome == Outcome::unsupported || wrong_form) {
      answer.readings.push_back({i, {}, Quality::bad_configuration, {}});
    } else if (reply.outcome == Outcome::ok) {
      Field field = Select(reply, *reads_[i]);
      answer.readings.push_back({i, std::move(field.value), field.quality, {}});
    }
  }
  return answer;
}

/// What the reply holds and no point reads.
void DconConversation::AddLabels(const Exchanged& exchanged, Answer& answer) const {
  const DecodedReply& reply = exchanged.reply;
  if (reply.outcome != Outcome::ok) return;
  for (const Field& field : reply.fields) {
    const bool used = std::ranges::any_of(reads_, [&](const std::optional<ReadAddress>& read) {
      const bool asked =
          read && read->command == exchanged.command.text && read->form == reply.form;
      return asked && (read->select != ReadAddress::Select::index || read->index == field.channel);
    });
    if (used) continue;
    answer.readings.push_back(
        {kNoPoint, field.value, field.quality, Label(exchanged.command, reply, field)});
  }
}

Outcome DconConversation::Check(View request, View frame) const {
  const auto exchanged = Decode(request, frame);
  return exchanged ? exchanged->reply.outcome : Outcome::corrupt;
}

Answer DconConversation::Interpret(View request, View frame) {
  const auto exchanged = Decode(request, frame);
  if (!exchanged) {
    Answer answer;
    answer.outcome = Outcome::corrupt;
    answer.reason = "request '" + Printable(request) + "' is no DCON request" +
                    (settings_.checksum ? " with a good checksum; is checksum: true right?" : "");
    return answer;
  }
  Answer answer = ReadingsOf(*exchanged);
  AddLabels(*exchanged, answer);
  return answer;
}

Answer DconConversation::OnFrame(const Task& task, const Request& request, View frame, Instant) {
  const auto exchanged = Decode(request.bytes, frame);
  if (!exchanged) return Interpret(request.bytes, frame);
  Answer answer = ReadingsOf(*exchanged);
  if (task.kind == Task::Kind::write) return AfterWrite(task, std::move(answer));
  return AfterRead(task, exchanged->command, std::move(answer));
}

/// What the answer to a poll or probe changes in the session.
Answer DconConversation::AfterRead(const Task& task, const Command& command, Answer answer) {
  if (!ProvesLife(answer.outcome)) return answer;
  if (task.kind == Task::Kind::probe) {
    probes_.OnAnswered(command.text == own_probe_);
  } else {
    probes_.OnPolled();
  }
  const std::size_t query = QueryOf(command.text);
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) change = plan_.OnAnswered(query);
  if (answer.outcome == Outcome::unsupported) change = plan_.OnRefused(query);
  if (change != PlanChange::nothing) answer.then = Then::replan;
  return answer;
}

Answer DconConversation::AfterWrite(const Task& task, Answer answer) {
  if (read_back_) {
    read_back_.reset();
    const auto own = std::ranges::find(answer.readings, task.point, &Reading::point);
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
  const auto& read = reads_[task.point];
  if (answer.outcome == Outcome::ok && IsDigital(read)) {
    read_back_ = ReadBack{task.point, task.value};
    answer.then = Then::ask_again;
  }
  return answer;
}

Then DconConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                 Instant) {
  read_back_.reset();
  const bool silent = outcome == Outcome::no_reply;
  if (task.kind == Task::Kind::probe) {
    const bool own = !own_probe_.empty() && request.bytes == MakeRequest(own_probe_).bytes;
    return probes_.OnFailed(own && silent) ? Then::ask_again : Then::done;
  }
  if (task.kind != Task::Kind::poll || !silent) return Then::done;
  return plan_.OnSilent(task.query) == PlanChange::nothing ? Then::done : Then::replan;
}

void DconConversation::OnReconnect() {
  read_back_.reset();
  probes_.OnReconnect();
  plan_.OnReconnect();
}

}  // namespace baudgate::protocols::dcon
