// Decides on which thread each line runs: one of its own if opening or closing the port may
// block, else one of a few that many lines share. Used by daemon.cpp.
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

struct Placement {
  static constexpr std::size_t kMostLoops = 4;
  static constexpr std::size_t kOwn = ~std::size_t{0};

  std::size_t loops = 1;             ///< shared ones, at least one
  std::vector<std::size_t> loop_of;  ///< by line: one of the shared loops, in turn, or kOwn
};

/// `cores`: of this machine, 0: not known.
Placement PlaceLines(const std::vector<config::Line>& lines, std::size_t cores);

}  // namespace baudgate
