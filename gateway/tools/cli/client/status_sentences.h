// The sentences of a status: what is not well, and what is said of the whole gateway. Part of
// status_view.h and status_frame.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace baudgate {

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
/// "bay-1: …", "bay-1.feeder-2: …" and "route 20 to line bay-1: …".
std::vector<std::string> AdviceOf(const nlohmann::ordered_json& status);

}  // namespace baudgate
