// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/disk.h"

#include <array>

namespace baudgate {

std::string_view Name(Disk disk) {
  constexpr std::array<std::string_view, 4> kNames = {"opening", "fine", "stalled", "failing"};
  return kNames[static_cast<std::size_t>(disk)];
}

}  // namespace baudgate
