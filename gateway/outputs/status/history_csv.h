// The history for spreadsheets: `baudgate history --csv`, and the download of the page. Made of the
// records of history_json.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace baudgate::control {

/// `spans`: of minutes, hours, …, not of single values. With the end of the line.
std::string HistoryCsvHead(bool spans);

/// Times as spreadsheets know them; numbers as they are.
std::string HistoryCsvRow(const nlohmann::ordered_json& record, bool spans);

/// "gap: the gateway was down until …".
std::string GapText(const nlohmann::ordered_json& record);

}  // namespace baudgate::control
