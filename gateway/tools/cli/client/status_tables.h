// The lines and devices of a status as tables. Part of status_view.h and status_frame.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "gateway/tools/terminal/live_table.h"

namespace baudgate {

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

}  // namespace baudgate
