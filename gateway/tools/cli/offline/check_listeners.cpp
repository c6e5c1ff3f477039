// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/check_listeners.h"

#include <string>
#include <string_view>
#include <utility>

#include "gateway/tools/cli/offline/check_words.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

std::string_view Describe(config::Permit permit) {
  switch (permit) {
    case config::Permit::read:
      return "reading only (functions 1-4)";
    case config::Permit::data:
      return "reading and writing data (functions 1-6, 15, 16)";
    case config::Permit::all:
      return "reading and writing (all functions)";
  }
  return "";
}

std::string Describe(const config::Listener& listener) {
  std::string text = listener.Place() + ", ";
  if (listener.is_serial()) {
    text += listener.serial.ToString();
    if (listener.serial.software_parity) text += " (software parity)";
    text += ", " + std::string(Title(listener.framing)) + ", ";
  } else {
    text +=
        std::string(Title(listener.framing)) + (listener.speaks_serial() ? " over TCP, " : ", ");
  }
  text += Describe(listener.permit);
  if (listener.is_serial()) return text + ", for the master there";
  return text + ", for " + Whom(listener.allow);
}

/// In the order in which they decide.
std::string DescribePriorities(const config::Listener& listener) {
  std::string text;
  for (const config::FunctionPriority& rule : listener.functions) {
    text += std::string(Name(rule.priority)) + " for functions " +
            Joined(rule.codes, [](std::uint8_t code) { return std::to_string(code); }) + "; ";
  }
  for (const config::ClientPriority& rule : listener.clients) {
    text += std::string(Name(rule.priority)) + " for " + rule.from.text + "; ";
  }
  return text + std::string(Name(listener.priority)) + (text.empty() ? " for all" : " for others");
}

Json ToJson(const config::Listener& listener) {
  using config::Listener;
  Json one = {{"at", listener.Place()}};
  one["serial"] = listener.is_serial() ? Json(listener.serial.ToString()) : Json();
  one["framing"] = Name(listener.framing);
  one["permit"] = Name(listener.permit);
  one["priority"] = Name(listener.priority);
  one["priorities"] = DescribePriorities(listener);
  one["errors"] = listener.errors == Listener::Errors::silent ? "silent" : "exception";
  one["broadcast"] = listener.broadcast == Listener::Broadcast::pass ? "pass" : "ignore";
  return one;
}

}  // namespace

void PrintListener(const config::Listener& listener, std::ostream& out) {
  out << "modbus " << Describe(listener) << '\n';
  out << "  priority   " << DescribePriorities(listener) << '\n';
  const bool silent = listener.errors == config::Listener::Errors::silent;
  out << "  errors     "
      << (silent ? "silent: nothing is answered instead of 0x06, 0x0A and 0x0B"
                 : "exceptions 0x06, 0x0A and 0x0B are answered")
      << '\n';
  const bool pass = listener.broadcast == config::Listener::Broadcast::pass;
  out << "  broadcast  "
      << (pass ? "passed to all slaves of every line with a route" : "not passed on") << '\n';
  if (listener.is_serial()) return;
  out << "  clients    at most " << listener.max_clients << ", closed after "
      << FormatDuration(listener.idle_timeout) << " without a request\n";
}

Json ModbusJson(const config::Modbus& modbus) {
  Json listeners = Json::array();
  for (const config::Listener& listener : modbus.listen) listeners.push_back(ToJson(listener));
  return {{"enabled", modbus.enabled}, {"listen", std::move(listeners)}};
}

}  // namespace baudgate
