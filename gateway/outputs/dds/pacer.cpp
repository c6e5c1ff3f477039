// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/pacer.h"

#include <algorithm>

namespace baudgate::dds {

bool Pacer::Take(Instant now) {
  const Instant reserved = std::max(reserved_until_, now);
  if (reserved - now > allowance_ - interval_) return false;
  reserved_until_ = reserved + interval_;
  return true;
}

}  // namespace baudgate::dds
