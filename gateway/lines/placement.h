// Decides whether a line runs on a thread of its own, because opening or closing the port may
// block, or on one of a few that many lines share; and how many those are. Used by lines.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "config/model/line.h"

namespace baudgate {

enum class Place : std::uint8_t { own_thread, shared_loop };

/// By the text of the configuration alone, because what a link leads to may change while the line
/// runs: "tcp://host:port" and "/dev/pts/7" never block; a driver of a serial port may, for half a
/// minute.
Place PlaceOf(std::string_view port);

/// Threads that lines share in turn: at least one, at most four. `cores`: of this machine, 0: not
/// known.
std::size_t SharedLoops(const std::vector<config::Line>& lines, std::size_t cores);

}  // namespace baudgate
