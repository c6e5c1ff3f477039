// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/protocols.h"

#include <nlohmann/json.hpp>

#include "gateway/base/exit_code.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;
using config::TextTable;

std::string_view KindName(OptionSpec::Kind kind) {
  switch (kind) {
    case OptionSpec::Kind::flag:
      return "true or false";
    case OptionSpec::Kind::integer:
      return "whole number";
    case OptionSpec::Kind::real:
      return "number";
    case OptionSpec::Kind::text:
      return "text";
    case OptionSpec::Kind::duration:
      return "duration";
    case OptionSpec::Kind::choice:
      return "choice";
    case OptionSpec::Kind::texts:
      return "list of texts";
    case OptionSpec::Kind::pairs:
      return "map of texts";
    case OptionSpec::Kind::description:
      return "map";
  }
  return "text";
}

std::string Allowed(const OptionSpec& option) {
  if (option.kind == OptionSpec::Kind::choice) return std::string(option.choices);
  const bool is_number =
      option.kind == OptionSpec::Kind::integer || option.kind == OptionSpec::Kind::real;
  if (!is_number || option.minimum >= option.maximum) return "";
  return FormatNumber(option.minimum) + "…" + FormatNumber(option.maximum);
}

std::string_view ScopeName(const OptionSpec& option) {
  return option.scope == OptionSpec::Scope::line ? "line" : "device";
}

/// Times that are computed from a bit rate have nanoseconds, which are of no use to a reader.
Duration Rounded(Duration time) {
  return Duration(std::chrono::round<std::chrono::milliseconds>(10 * time)) / 10;
}

void PrintTimes(const Protocol& protocol, std::ostream& out) {
  const config::Timing timing = protocol.timing(protocol.serial);
  out << "\nDefaults\n";
  if (!protocol.tcp) out << "  serial: " << protocol.serial.ToString() << '\n';
  out << "  timing: {";
  const char* between = " ";
  for (const auto& [name, time] :
       {std::pair("quiet", timing.quiet), std::pair("reply", timing.reply),
        std::pair("gap", timing.gap), std::pair("ceiling", timing.ceiling),
        std::pair("drain", timing.drain)}) {
    if (!time) continue;
    out << between << name << ": " << FormatDuration(Rounded(*time));
    between = ", ";
  }
  out << " }\n";
}

void PrintOne(const Protocol& protocol, std::ostream& out) {
  out << protocol.name << ": " << protocol.title << '\n';
  if (!protocol.options.empty()) {
    out << "\nOptions\n";
    for (const OptionSpec& option : protocol.options) {
      const std::string allowed = Allowed(option);
      out << "  " << option.name << " (" << ScopeName(option) << "; " << KindName(option.kind)
          << (allowed.empty() ? "" : ": " + allowed) << "; default "
          << (option.fallback.empty() ? "empty" : option.fallback)
          << (option.secret ? "; secret" : "") << ")\n      " << option.help << '\n';
    }
  }
  if (!protocol.decoders.empty()) {
    out << "\nWhat `read` can say\n";
    TextTable table({"form", "meaning"});
    for (const DecoderSpec& decoder : protocol.decoders) {
      table.Add({std::string(decoder.form), std::string(decoder.help)});
    }
    table.PrintAligned(out, "  ");
  }
  PrintTimes(protocol, out);
}

Json ToJson(const Protocol& protocol) {
  Json options = Json::array();
  for (const OptionSpec& option : protocol.options) {
    options.push_back({{"name", option.name},
                       {"scope", ScopeName(option)},
                       {"kind", KindName(option.kind)},
                       {"allowed", Allowed(option)},
                       {"default", option.fallback},
                       {"secret", option.secret},
                       {"help", option.help}});
  }
  Json decoders = Json::array();
  for (const DecoderSpec& decoder : protocol.decoders) {
    decoders.push_back({{"form", decoder.form}, {"help", decoder.help}});
  }
  return {{"name", protocol.name},
          {"title", protocol.title},
          {"serial", protocol.tcp ? Json() : Json(protocol.serial.ToString())},
          {"options", std::move(options)},
          {"decoders", std::move(decoders)}};
}

void PrintList(const config::Catalog& catalog, std::ostream& out) {
  TextTable table({"protocol", "title", "profiles"});
  for (const auto& [name, protocol] : catalog.protocols) {
    table.Add({name, std::string(protocol->title), std::to_string(catalog.Profiles(name).size())});
  }
  table.PrintAligned(out);
}

}  // namespace

int RunProtocols(const std::string& name, bool json, const config::Catalog& catalog,
                 std::ostream& out, std::ostream& err) {
  if (const Status any = catalog.HasProtocols(); !any) {
    err << "baudgate: " << any.error() << '\n';
    return kExitCanNot;
  }
  const Protocol* one = name.empty() ? nullptr : catalog.FindProtocol(name);
  if (!name.empty() && !one) {
    const std::vector<std::string_view> installed = catalog.ProtocolNames();
    err << "protocol " << config::Quoted(name) << " is not installed;"
        << config::DidYouMean(name, installed)
        << " installed: " << (installed.empty() ? "none" : config::Join(installed)) << '\n';
    return kExitUsage;
  }
  if (json) {
    Json result = one ? ToJson(*one) : Json::array();
    if (!one) {
      for (const auto& [key, protocol] : catalog.protocols) result.push_back(ToJson(*protocol));
    }
    out << result.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
  } else if (one) {
    PrintOne(*one, out);
  } else {
    PrintList(catalog, out);
  }
  return 0;
}

}  // namespace baudgate
