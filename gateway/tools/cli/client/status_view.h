// The answer to a status request (gateway/outputs/status/status_json.h) as text for people.
// LineTable and DeviceTable make the tables, and HeadSentence and its neighbours the sentences.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

// The lines and devices of a status as tables. Part of RenderStatus and of status.h.

/// "-" for null.
std::string MillisecondsText(const nlohmann::ordered_json& json);
std::string RoundTripText(double us);
/// "78 %".
std::string UseText(const nlohmann::ordered_json& line);

/// Devices of the line that answer.
std::size_t Alive(const nlohmann::ordered_json& line);
Tone ToneOfLine(const nlohmann::ordered_json& line);
Tone ToneOfDevice(const nlohmann::ordered_json& device);

enum class Order : std::uint8_t {
  configured,
  trouble,  ///< what is worst comes first
};
std::string LineTable(const nlohmann::ordered_json& lines, const TableView& view,
                      Order order = Order::configured);
std::string DeviceTable(const nlohmann::ordered_json& lines, const TableView& view,
                        Order order = Order::configured);

// The sentences of a status: what is not well, and what is said of the whole gateway. Part of
// RenderStatus and of status.h.

/// "substation-7: baudgate 0.1.0, up 2 min, lines: 2, devices: 3, online: 1".
std::string HeadSentence(const nlohmann::ordered_json& status);
/// "DDS domain 0: 3 subscribers, 1234 samples"; empty while something is wrong, which the advice
/// tells, or where DDS is off. Samples that the library did not take go again.
std::string DdsSentence(const nlohmann::ordered_json& status);
/// "DDS took 12 write requests", "DDS let in 12345 datagrams, refused 40: 38 fragments, 2 broken
/// parameter lists".
std::vector<std::string> DdsTraffic(const nlohmann::ordered_json& status);
/// "2 alarms active, 1 not acknowledged: see 'baudgate alarms'"; empty where there is none.
std::string AlarmsSentence(const nlohmann::ordered_json& status);
/// All advice, each sentence behind its subject: "bay-1: …", "bay-1.feeder-2: …", "master on PORT:
/// …", "route 20 to line bay-1: …"; then that of each other section of the status behind the key of
/// the section: "audit: …".
std::vector<std::string> AdviceOf(const nlohmann::ordered_json& status);

/// `target` as in the request: nothing, a line, or a device. Throws a nlohmann exception where a
/// field is missing: the gateway is of another version.
std::string RenderStatus(const nlohmann::ordered_json& status, const std::string& target,
                         const TableView& view);

}  // namespace baudgate::tools
