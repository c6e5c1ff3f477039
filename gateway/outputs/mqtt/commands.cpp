// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/commands.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/outputs/status/value_json.h"

namespace baudgate::mqtt {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kRetained[] =
    "the command is retained, so the broker would send it again after each connection; publish it "
    "without retain";

std::string TextOf(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return FormatNumber(value.get<double>());
  return value.dump();
}

std::string AnswerText(const Command& command, WriteEnd end, const std::string& reason) {
  Json json = {{"value", command.value}, {"result", Name(end)}, {"reason", Harmless(reason)}};
  if (!command.id.empty()) json["id"] = command.id;
  json["time"] = FormatWallTime(ReadClocks().wall);
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

Result<Command> ParseCommand(const std::string& payload) {
  if (payload.size() > Commands::kLongestPayload) return Error{"the command is too long"};
  Command command{std::string(Trim(payload))};
  if (!command.value.starts_with('{')) return command;
  const auto parsed = status::ParseJson(payload);
  if (!parsed) return Error{parsed.error()};
  const Json& json = *parsed;
  if (json.is_discarded()) return Error{"the command is not JSON"};
  const bool has_value = json.is_object() && json.contains("value") &&
                         (json["value"].is_primitive() && !json["value"].is_null());
  if (!has_value) return Error{"the command has no value; write for example {\"value\":12.5}"};
  command.value = TextOf(json["value"]);
  for (const auto& [key, value] : json.items()) {
    // A misspelt `not_after` must not be a command without an end.
    if (key == "value") {
      continue;
    } else if (key == "confirm" && value.is_boolean()) {
      command.confirm = value.get<bool>();
    } else if (key == "id" && value.is_string()) {
      command.id = value.get<std::string>();
    } else if (key == "not_after" && value.is_string()) {
      const auto time = ParseWallTime(value.get<std::string>());
      if (!time) return Error{"not_after: " + time.error()};
      command.not_after = *time;
    } else {
      return Error{Quoted(key) +
                   " is no member of a command, or has another type; members: value, confirm "
                   "(true, false), id (text), not_after (time as text)"};
    }
  }
  return command;
}

Commands::Commands(const bus::PointStore& store, bus::CommandSink& sink, std::string client,
                   std::function<void()> wake)
    : store_(store), writer_{std::move(client), 0}, gate_(store, sink) {
  const MutexLock lock(mail_->mutex);
  mail_->wake = std::move(wake);
}

void Commands::Take(const std::string& topic, std::optional<bus::PointRef> at,
                    const Message& message, Now now) {
  const MutexLock lock(mutex_);
  if (!taking_) return;
  const std::string to = topic + "/result";
  const auto command = ParseCommand(message.payload);
  const auto answer = [&](WriteEnd end, const std::string& reason) {
    mail_->Add({to, AnswerText(command ? *command : Command(), end, reason)});
  };
  const auto device = at ? store_.device(at->device) : nullptr;
  if (!device || store_.gone(at->device)) {
    return answer(WriteEnd::denied, "the topic is that of no point of this gateway");
  }
  const config::Point& point = device->points[at->point];
  bus::WriteAsk ask;
  ask.device = at->device;
  ask.parts.push_back({at->point, command ? Value(command->value) : Value()});
  const auto deny = [&](const std::string& reason) {
    gate_.Deny(writer_, ask, reason);
    answer(WriteEnd::denied, reason);
  };
  if (message.retained) return deny(kRetained);
  if (!command) return deny(command.error());
  if (command->not_after && now.wall > *command->not_after) {
    return deny("the command came after its time (not_after)");
  }
  auto value = bus::ParseValue(point, command->value);
  if (!value) return deny(value.error());
  ask.parts.front().value = std::move(*value);
  ask.without_selection = command->confirm;
  ask.deadline = now.instant + bus::kWaitForDevice;
  ask.done = [mail = mail_, to, command = *command](const WriteResult& result) {
    mail->Add({to, AnswerText(command, result.end, result.reason)});
  };
  const auto denial = gate_.Submit(writer_, std::move(ask), now.instant);
  if (!denial) return;
  using Why = bus::WriteDenial::Why;
  answer(denial->why == Why::busy ? WriteEnd::busy : WriteEnd::denied,
         denial->why == Why::not_selected ? denial->text + "; over MQTT set \"confirm\":true"
                                          : denial->text);
}

std::vector<Commands::Answer> Commands::TakeAnswers() {
  const MutexLock lock(mail_->mutex);
  return std::exchange(mail_->answers, {});
}

void Commands::Stop() {
  const MutexLock lock(mutex_);
  taking_ = false;
}

}  // namespace baudgate::mqtt
