// Functions that render the answer to a status request (gateway/outputs/status/status_json.h) as
// text.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

std::string MillisecondsText(const nlohmann::ordered_json& json);
std::string RoundTripText(double us);
/// Returns how much of the last full minute the line was busy. Example: "78 %".
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

/// Returns one sentence about the gateway. Example: "substation-7: baudgate 0.1.0, up 2 min, lines:
/// 2, devices: 3, online: 1".
std::string HeadSentence(const nlohmann::ordered_json& status);
/// Returns one sentence about DDS. Example: "DDS domain 0: 3 subscribers, 1234 samples". Empty: DDS
/// is off, or AdviceOf returns a sentence about DDS.
std::string DdsSentence(const nlohmann::ordered_json& status);
/// Returns sentences about received requests and datagrams. Examples: "DDS took 12 write requests",
/// "DDS accepted 12345 datagrams, refused 40: 38 fragments, 2 broken parameter lists".
std::vector<std::string> DdsTraffic(const nlohmann::ordered_json& status);
/// Returns one sentence about alarms. Example: "2 alarms active, 1 not acknowledged: see 'baudgate
/// alarms'"; empty: there are no alarms.
std::string AlarmsSentence(const nlohmann::ordered_json& status);
/// Returns all advice. Each sentence begins with its subject: "bay-1: …", "bay-1.feeder-2: …",
/// "master on PORT: …", "route 20 to line bay-1: …", "audit: …".
std::vector<std::string> AdviceOf(const nlohmann::ordered_json& status);

/// Renders a status. `target` is the target of the request: "LINE", "LINE.DEVICE", or empty for all
/// lines. Throws a nlohmann exception if the answer is that of another version of the gateway.
std::string RenderStatus(const nlohmann::ordered_json& status, const std::string& target,
                         const TableView& view);

}  // namespace baudgate::tools
