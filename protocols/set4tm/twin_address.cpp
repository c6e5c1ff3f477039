// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin_address.h"

#include <algorithm>
#include <utility>

#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr std::uint32_t kDefaultSerial = 9020001;

}  // namespace

TwinAddress::TwinAddress(Bytes configured, std::optional<std::uint32_t> serial)
    : configured_(std::move(configured)), serial_(serial.value_or(0)) {
  const auto number = ByteReader(configured_).U32Be(1);
  own_ = {number ? static_cast<std::uint8_t>(1 + *number % 239) : configured_[0]};
  if (serial_ == 0) serial_ = number.value_or(0);
  if (serial_ == 0) serial_ = kDefaultSerial;
}

bool TwinAddress::Hears(View address) const {
  if (address.size() == 1) return address[0] == short_address() || address[0] == kCommonAddress;
  return std::ranges::equal(address, ExtendedAddress(serial_)) ||
         std::ranges::equal(address, configured_);
}

bool TwinAddress::IsCommon(View address) const {
  return address[0] == kCommonAddress && short_address() != kCommonAddress;
}

View TwinAddress::ReplyTo(View address) const {
  if (!reply_as_.empty()) return reply_as_;
  return address.size() > 1 ? address : View(own_);
}

}  // namespace baudgate::protocols::set4tm
