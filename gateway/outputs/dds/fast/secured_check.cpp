// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fast/secured_check.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

constexpr std::uint8_t kSecBody = 0x30;
constexpr std::uint8_t kSecPrefix = 0x31;
constexpr std::uint8_t kSecPostfix = 0x32;
constexpr std::uint8_t kMessagePrefix = 0x33;
constexpr std::uint8_t kMessagePostfix = 0x34;

constexpr std::size_t kCryptoHeader = 20;  // kind, key id, session id (4 each), suffix (8)
constexpr std::size_t kMac = 16;
constexpr std::size_t kReceiverMac = 20;  // key id (4), MAC
constexpr std::uint32_t kMostReceivers = 256;

constexpr std::size_t kMessageIds = 2 * 24 + 3 * 16;  // two identities, three GUIDs

constexpr std::size_t kHandshakeSources = 64;
constexpr std::size_t kBurst = 512;
constexpr Duration kInterval = Duration(1s) / 128;
constexpr std::size_t kBurstOfAddress = kBurst / 2;
constexpr Duration kIntervalOfAddress = kInterval * 2;

/// Walks through CDR; `fits` turns false where something would leave the payload.
class SecuredWalk {
 public:
  SecuredWalk(const RtpsFields& fields, std::size_t at) : fields_(fields), at_(at) {}

  bool fits() const { return fits_; }
  std::uint32_t Number() {
    at_ = (at_ + 3) & ~std::size_t{3};
    const auto number = fields_.U32(at_);
    fits_ = fits_ && number.has_value();
    at_ += 4;
    return fits_ ? *number : 0;
  }
  void Counted() {
    const std::size_t length = Number();
    fits_ = fits_ && length <= fields_.size() - at_;
    if (fits_) at_ += length;
  }
  /// Names with texts, or with bytes.
  void Properties() {
    for (std::uint32_t left = Number(); fits_ && left > 0; --left) {
      Counted();
      Counted();
    }
  }

 private:
  const RtpsFields& fields_;
  std::size_t at_;
  bool fits_ = true;
};

bool HasRoom(Instant& full_at, Duration interval, std::size_t burst, Instant now) {
  const Instant after = std::max(full_at, now) + interval;
  return after - now <= interval * static_cast<std::int64_t>(burst);
}

}  // namespace

bool SecuredFits(std::uint8_t id, const RtpsFields& body) {
  // Numbers of these are big-endian, whatever the submessage says.
  switch (id) {
    case kSecPrefix:
    case kMessagePrefix:
      return body.size() >= kCryptoHeader;
    case kSecBody: {
      // 30 00 08 00 FF FF FF FF …: 4294967295 encrypted bytes
      const auto length = body.Entity(0);
      return length && *length <= body.size() - 4;
    }
    case kSecPostfix:
    case kMessagePostfix: {
      const auto count = body.Entity(kMac);
      return count && *count <= kMostReceivers && *count * kReceiverMac <= body.size() - kMac - 4;
    }
    default:
      return true;
  }
}

bool SecuredOrder::Next(std::uint8_t id, bool first) {
  inside_ = open();
  if (ended_) return false;
  switch (id) {
    case kMessagePrefix:
      message_ = first;
      return first;
    case kMessagePostfix: {
      const bool right = message_ && step_ == Step::outside;
      message_ = false;
      ended_ = true;
      return right;
    }
    case kSecPrefix: {
      const bool right = step_ == Step::outside;
      step_ = Step::prefix;
      return right;
    }
    case kSecBody:
      if (step_ == Step::outside) return message_;
      [[fallthrough]];
    default:
      // 31 … 30 … 30 …: one submessage between prefix and postfix
      if (step_ == Step::body) return false;
      if (step_ == Step::prefix) step_ = Step::body;
      return true;
    case kSecPostfix: {
      const bool right = step_ == Step::body;
      step_ = Step::outside;
      return right;
    }
  }
}

bool IsGenericMessage(View payload, bool little) {
  const RtpsFields fields(payload, little);
  if (payload.size() < kMessageIds) return false;
  SecuredWalk walk(fields, kMessageIds);
  walk.Counted();  // the class of the message
  for (std::uint32_t left = walk.Number(); walk.fits() && left > 0; --left) {
    walk.Counted();  // the class of a token
    walk.Properties();
    walk.Properties();
  }
  return walk.fits();
}

HandshakeBudget::HandshakeBudget() { sources_.reserve(kHandshakeSources); }

bool HandshakeBudget::Take(std::uint32_t address, Instant now) {
  auto at = std::ranges::find(sources_, address, &Source::address);
  if (at == sources_.end()) {
    if (sources_.size() == kHandshakeSources) {
      at = std::ranges::min_element(sources_, {}, &Source::full_at);
      *at = {address, {}};
    } else {
      at = sources_.insert(sources_.end(), Source{address, {}});
    }
  }
  if (!HasRoom(at->full_at, kIntervalOfAddress, kBurstOfAddress, now) ||
      !HasRoom(full_at_, kInterval, kBurst, now)) {
    return false;
  }
  at->full_at = std::max(at->full_at, now) + kIntervalOfAddress;
  full_at_ = std::max(full_at_, now) + kInterval;
  return true;
}

}  // namespace baudgate::dds
