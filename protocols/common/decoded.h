// What a decoder makes of the bytes or text of one value.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/value.h"

namespace baudgate::protocols {

/// A value, or the quality that says why there is none: what is no measurement never becomes a
/// number.
struct Decoded {
  Value value{};
  Quality quality = Quality::good;
};

}  // namespace baudgate::protocols
