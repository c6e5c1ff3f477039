// Render the answer to a status request (gateway/outputs/status/status_json.h) as text.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

/// Returns a duration as text; "-" for null.
std::string MillisecondsText(const nlohmann::ordered_json& json);
std::string RoundTripText(double us);
/// Returns the use of the line. Example: "78 %".
std::string UseText(const nlohmann::ordered_json& line);

std::size_t Alive(const nlohmann::ordered_json& line);
Tone ToneOfLine(const nlohmann::ordered_json& line);
Tone ToneOfDevice(const nlohmann::ordered_json& device);

enum class Order : std::uint8_t {
  configured,
  trouble,  ///< the worst first
};
std::string LineTable(const nlohmann::ordered_json& lines, const TableView& view,
                      Order order = Order::configured);
std::string DeviceTable(const nlohmann::ordered_json& lines, const TableView& view,
                        Order order = Order::configured);

/// Example: "substation-7: baudgate 0.1.0, up 2 min, lines: 2, devices: 3, online: 1"
std::string HeadSentence(const nlohmann::ordered_json& status);
/// "DDS domain 0: 3 subscribers, 1234 samples". Empty: DDS is off, or has a problem (see AdviceOf).
std::string DdsSentence(const nlohmann::ordered_json& status);
/// Example: "DDS took 12 write requests", "DDS let in 12345 datagrams, refused 40: 38 fragments, …"
std::vector<std::string> DdsTraffic(const nlohmann::ordered_json& status);
/// Example: "2 alarms active, 1 not acknowledged: see 'baudgate alarms'"
std::string AlarmsSentence(const nlohmann::ordered_json& status);
/// Each sentence after its subject: "bay-1: …", "master on PORT: …", "route 20 to line bay-1: …".
std::vector<std::string> AdviceOf(const nlohmann::ordered_json& status);

/// Renders a status. `target`: the target of the request; empty, a line, or a device. Throws a
/// nlohmann exception if the answer is that of another version of the gateway.
std::string RenderStatus(const nlohmann::ordered_json& status, const std::string& target,
                         const TableView& view);

}  // namespace baudgate::tools
