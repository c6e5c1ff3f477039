// `Decoded` is the result of decoding the bytes or text of one value.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/value.h"

namespace baudgate::protocols {

/// A value, or an empty value with the quality that tells why. Bytes that are no measurement never
/// give a number.
struct Decoded {
  Value value{};
  Quality quality = Quality::good;
};

}  // namespace baudgate::protocols
