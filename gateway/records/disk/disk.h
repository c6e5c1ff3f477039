// How the disk of a file of the state folder does.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace baudgate {

enum class Disk : std::uint8_t {
  opening,  ///< the file is being checked
  fine,
  stalled,  ///< it does not answer in time
  failing,
};
std::string_view Name(Disk disk);

}  // namespace baudgate
