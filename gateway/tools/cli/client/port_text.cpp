// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/port_text.h"

#include <fmt/format.h>

#include "gateway/tools/cli/client/json_fields.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;

std::string VisitText(const Json& visit) {
  return fmt::format("{} since {}, {} bytes to the port, {} from it", Text(visit, "client"),
                     TextOf(visit, "since"), Number(visit, "to_port"), Number(visit, "from_port"));
}

/// "served at 127.0.0.1:4001 (raw): 10.0.0.7:40112 since …".
std::string ServiceText(const Json& service) {
  std::string text = fmt::format("{} at {} ({})", Text(service, "use"), Text(service, "at"),
                                 Text(service, "mode"));
  if (!Text(service, "trouble").empty()) return text + ": " + Text(service, "trouble");
  if (const std::string until = TextOf(service, "open_until"); !until.empty()) {
    text += " until " + until;
  }
  if (service.at("client").is_object()) return text + ": " + VisitText(service.at("client"));
  if (!service.at("last").is_object()) return text + ": no client yet";
  const Json& last = service.at("last");
  return text + ": no client now; the last was " + VisitText(last) + ", until " +
         TextOf(last, "until") + ": " + Text(last, "why");
}

}  // namespace

std::string ControlLinesText(const Json& modem) {
  if (!modem.is_object()) return {};
  constexpr std::pair<const char*, const char*> kLines[] = {{"dtr", "DTR"}, {"rts", "RTS"},
                                                            {"cts", "CTS"}, {"dsr", "DSR"},
                                                            {"dcd", "DCD"}, {"ring", "RI"}};
  std::string text;
  for (const auto& [key, name] : kLines) {
    if (modem.value(key, false)) text += (text.empty() ? "" : " ") + std::string(name);
  }
  return text.empty() ? "no control line on" : text;
}

std::vector<std::pair<std::string, std::string>> PortFacts(const Json& line) {
  std::vector<std::pair<std::string, std::string>> facts;
  const std::string lines = ControlLinesText(line.value("modem", Json()));
  if (!lines.empty()) facts.emplace_back("lines", lines);
  for (const Json& service : line.value("services", Json::array())) {
    facts.emplace_back("clients", ServiceText(service));
  }
  return facts;
}

}  // namespace baudgate
