// The addresses of a simulated meter: the short one, the extended one of its serial number, and the
// one at which it is configured.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/base/bytes.h"

namespace baudgate::protocols::set4tm {

class TwinAddress {
 public:
  /// A meter that is configured at its extended address has a short one as well. `serial`: of the
  /// configuration; empty or 0: that of an extended address, or any.
  TwinAddress(Bytes configured, std::optional<std::uint32_t> serial);

  bool Hears(View address) const;
  /// The request came to the common address, and the meter has another one.
  bool IsCommon(View address) const;
  /// The address in the reply to a request that came to `address`.
  View ReplyTo(View address) const;
  /// From then on all replies have this one.
  void ReplyAs(Bytes address) { reply_as_ = std::move(address); }

  std::uint8_t short_address() const { return own_[0]; }
  std::uint32_t serial() const { return serial_; }

 private:
  const Bytes configured_;
  Bytes own_;       // the short one
  Bytes reply_as_;  // empty: the address by which it was asked, the short one for 0
  std::uint32_t serial_ = 0;
};

}  // namespace baudgate::protocols::set4tm
