// Declares the struct `Decoded`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/value.h"

namespace baudgate::protocols {

/// A decoded value. If the bytes are not a measurement, `value` is empty and `quality` tells why.
struct Decoded {
  Value value{};
  Quality quality = Quality::good;
};

}  // namespace baudgate::protocols
