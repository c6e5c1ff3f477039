// Durations as Fast DDS counts them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fastdds/rtps/common/Time_t.h>

#include <cstdint>

#include "gateway/base/time.h"

namespace baudgate::dds {

inline eprosima::fastrtps::Duration_t DdsTime(Duration duration) {
  return {static_cast<std::int32_t>(duration / 1s),
          static_cast<std::uint32_t>((duration % 1s) / 1ns)};
}

}  // namespace baudgate::dds
