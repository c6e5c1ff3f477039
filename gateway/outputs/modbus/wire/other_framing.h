// Recognises a client that frames its messages in another way than its listener expects, by the
// first bytes that it sends. Pure.
//
//   00 01 00 00 00 06 01 03 00 00 00 01     Modbus TCP
//   01 03 00 00 00 01 84 0A                 Modbus RTU: the CRC is right
//   :010300000001FB CR LF                   Modbus ASCII: the LRC is right
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "gateway/base/bytes.h"
#include "gateway/outputs/modbus/wire/frames.h"

namespace baudgate::modbus {

/// How many of the first received bytes are examined.
inline constexpr std::size_t kMostLookedAt = 520;

/// What `heard`, which has no request in the framing `expected`, is in another. Empty: that
/// cannot be told.
std::optional<Framing> OtherFraming(View heard, Framing expected, const Frames& frames);

}  // namespace baudgate::modbus
