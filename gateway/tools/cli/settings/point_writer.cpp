// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/settings/point_writer.h"

#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/json_fields.h"

namespace baudgate::settings {
namespace {

using Json = ControlClient::Json;

/// Longer than any deadline of a write: whoever gives up first does not know what became of it.
constexpr Duration kWaitForAnswer = 60s;

}  // namespace

WriteReport SocketWriter::Write(const std::string& point, const std::string& value) {
  auto client = ControlClient::Connect(path_);
  if (!client) return {"not_sent", client.error()};
  client->Send({{"command", "write"}, {"target", point}, {"value", value}, {"confirm", true}});
  std::string line;
  if (client->ReadLine(line, ReadClocks().instant + kWaitForAnswer) != ControlClient::Got::line) {
    return {"unknown", "the gateway at " + client->path() + " did not answer"};
  }
  const Json answer = Json::parse(line, nullptr, false);
  if (!answer.is_object())
    return {"unknown", "what answers at " + client->path() + " is no gateway"};
  if (answer.contains("error")) return {"denied", TextOf(answer, "message")};
  WriteReport report{TextOf(answer, "end"), TextOf(answer, "reason")};
  report.read_back = answer.value("read_back", false);
  if (report.end.empty()) return {"unknown", "the gateway is of another version"};
  return report;
}

std::optional<std::string> SocketWriter::WhyNot(const std::string& point,
                                                const std::string& value) {
  auto client = ControlClient::Connect(path_);
  if (!client) return client.error();
  client->Send({{"command", "may_write"}, {"target", point}, {"value", value}});
  std::string line;
  if (client->ReadLine(line, ReadClocks().instant + kWaitForAnswer) != ControlClient::Got::line) {
    return "the gateway at " + client->path() + " did not answer";
  }
  const Json answer = Json::parse(line, nullptr, false);
  if (!answer.is_object()) return "what answers at " + client->path() + " is no gateway";
  if (answer.value("may_write", false)) return std::nullopt;
  return TextOf(answer, answer.contains("error") ? "message" : "reason");
}

}  // namespace baudgate::settings
