// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin/twin.h"

#include <algorithm>
#include <cmath>

#include "protocols/set4tm/meter/clock.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/identification.h"
#include "protocols/set4tm/meter/latch.h"
#include "protocols/set4tm/meter/plan.h"
#include "protocols/set4tm/meter/status.h"
#include "protocols/set4tm/meter/values.h"

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

std::optional<CivilZone::Utc> TwinClock::At(Instant now) const {
  if (!set_) return std::nullopt;
  const WallTime wall = set_->wall + (now - set_->instant);
  return std::chrono::floor<std::chrono::seconds>(wall) + correction_;
}

std::uint8_t TwinClock::Correct(std::chrono::seconds by, Instant now) {
  constexpr std::chrono::seconds kMost(120);
  if (std::chrono::abs(by) > kMost) return kNotAllowed;
  const auto shown = zone_.ToCivil(At(now).value_or(CivilZone::Utc()));
  if (std::chrono::floor<std::chrono::hours>(shown) !=
      std::chrono::floor<std::chrono::hours>(shown + by)) {
    return kNotAllowed;
  }
  const auto today = std::chrono::floor<std::chrono::days>(shown);
  if (corrected_on_ == today) return kClockAlreadyCorrected;
  corrected_on_ = today;
  correction_ += by;
  return kOk;
}

namespace {

constexpr Duration kChannelLife = 20s;
/// The default build variant: class 0.2S/0.5, 3 x 57.7 V, 5 A; both directions, three phases, A =
/// 5000; type 8.
constexpr std::uint8_t kVariantBytes[] = {0x10, 0x40, 0x80};
constexpr std::uint8_t kUnitRatios[] = {0, 1, 0, 1, 0, 0, 0, 0, 0, 0};
/// A NaN whose first byte means that the meter does not support the parameter (reference, 9.8).
constexpr std::uint8_t kUnsupportedFloat[] = {0x01, 0x00, 0x80, 0x7F};

void AppendFloat(Bytes& data, const std::optional<double>& value) {
  if (!value) {
    Append(data, kUnsupportedFloat);
    return;
  }
  const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(*value));
  for (unsigned i = 0; i < 4; ++i) data.push_back(static_cast<std::uint8_t>(bits >> (8 * i)));
}

/// Returns the request for the present value if `pdu` reads the latched one; else `pdu`.
Bytes Live(View pdu) {
  Bytes live(pdu.begin(), pdu.end());
  if (ReadsLatched(pdu)) live[2] &= 2U;
  return live;
}

std::optional<std::uint8_t> TypeOf(const Settings& settings) {
  return settings.types.empty() ? std::nullopt : std::optional(settings.types.front());
}

bool HasFloats(const Settings& settings) {
  const auto code = TypeOf(settings);
  const MeterType* type = code ? FindType(*code) : nullptr;
  return type == nullptr || type->floats != Knows::no;
}

}  // namespace

MeterTwin::MeterTwin(const config::Device& device, TwinValues& values)
    : settings_(ReadSettings(device.options)),
      address_(ParseAddress(device.address).value(), settings_.serial_number),
      clock_(settings_.time_zone.value_or(CivilZone())),
      points_(
          device, values,
          [floats = HasFloats(settings_)](const config::Point& point) {
            auto field = ParseField(point.read);
            if (field && !floats) *field = AsInteger(*field).value_or(*field);
            return field;
          },
          [](const config::Point&) {
            return Result<Field>(Error{"a simulated meter cannot be written"});
          }),
      journals_(clock_.zone(), static_cast<std::size_t>(settings_.journal_records)) {
  for (const auto& point : points_.all()) {
    if (!point.read || point.read->decoder != Decoder::float_le) continue;
    if (const auto parameter = ParameterAt(Live(point.read->pdu), point.read->offset)) {
      float_points_.emplace(*parameter, point.index);
    }
  }
  type_ = TypeOf(settings_);
  const MeterType* type = type_ ? FindType(*type_) : nullptr;
  knows_floats_ = HasFloats(settings_);
  knows_masks_ =
      settings_.snapshot != Snapshot::off && (type == nullptr || type->masked_floats != Knows::no);
}

void MeterTwin::ReplyAs(std::string_view address) {
  address_.ReplyAs(ParseAddress(address).value());
}

bool MeterTwin::Raise(const DeviceEvent& event, Now now) {
  return journals_.Raise(event, now.wall);
}

Bytes MeterTwin::Answer(View request, Instant now) {
  const auto parts = SplitFrame(request, settings_.checksum);
  if (!parts) return {};
  if (parts->address[0] == kBroadcast && IsLatch(parts->body)) Latch(now);
  if (!address_.Hears(parts->address)) return {};
  const auto length = LengthOfRequest(parts->body);
  if (!length || parts->body.size() < length->min || parts->body.size() > length->max) return {};
  if (address_.IsCommon(parts->address) && parts->body[0] == kWrite) return {};
  return MakeFrame(address_.ReplyTo(parts->address), Serve(parts->body, now), settings_.checksum);
}

Bytes MeterTwin::Serve(View pdu, Instant now) {
  const bool open = last_correct_ && now - *last_correct_ <= kChannelLife;
  switch (pdu[0]) {
    case kLinkTest:
      return {kOk};
    case kOpenChannel:
      if (!std::ranges::equal(pdu.subspan(1), settings_.password)) return {kLevelTooLow};
      last_correct_ = now;
      return {kOk};
    case kCloseChannel:
      last_correct_.reset();
      return {kOk};
    default:
      break;
  }
  if (IsLatch(pdu)) {
    Latch(now);
    return {kOk};
  }
  if (!open) return {kChannelClosed};
  last_correct_ = now;
  if (const auto shown = clock_.At(now)) {
    for (auto& [profile, load] : loads_) load.Advance(*shown);
  }
  if (pdu[0] == kWrite) return {Write(pdu, now)};
  const auto data = Data(pdu, now);
  return data ? *data : Bytes{kNotAllowed};
}

/// Carries out a write and returns the status. At access level 1 only the clock can be corrected.
std::uint8_t MeterTwin::Write(View pdu, Instant now) {
  constexpr std::uint8_t kCorrectClock = 0x0B;
  if (pdu[1] != kCorrectClock) return kLevelTooLow;
  const std::chrono::seconds by(static_cast<std::int16_t>(ByteReader(pdu).U16Be(2).value_or(0)));
  return clock_.Correct(by, now);
}

void MeterTwin::Latch(Instant now) {
  latched_at_ = now;
  latched_.clear();
  for (const auto& point : points_.all()) latched_.push_back(points_.Get(point, now));
}

Value MeterTwin::Measured(View pdu, const TwinPoints<Field>::One& point, Instant now) const {
  const bool latched = ReadsLatched(pdu) && !latched_.empty();
  return latched ? latched_[point.index] : points_.Get(point, now);
}

void MeterTwin::SetClock(Now now) {
  constexpr std::chrono::days kPast(7);
  clock_.Set(now);
  latched_at_ = now.instant;
  const auto bytes = static_cast<std::size_t>(settings_.load_records) * kLoadRecord;
  std::vector<unsigned> profiles = settings_.load_profiles;
  if (profiles.empty()) profiles.push_back(1);
  for (const unsigned profile : profiles) {
    constexpr unsigned kMinutes = 30;
    loads_.insert_or_assign(
        profile, TwinLoad(clock_.zone(), kMinutes, bytes, *clock_.At(now.instant) - kPast));
  }
}

TwinLoad* MeterTwin::load(unsigned profile) {
  const auto found = loads_.find(profile);
  return found == loads_.end() ? nullptr : &found->second;
}

/// Answers requests for the time, and for the pointer, interval and memory of a load profile.
std::optional<Bytes> MeterTwin::OfClock(View pdu, Instant now) const {
  const bool of_latch = std::ranges::equal(pdu, AskLatchTime());
  const auto shown = clock_.At(of_latch ? latched_at_ : now);
  if (!shown) return std::nullopt;
  const CivilZone& zone = clock_.zone();
  if (of_latch) return BytesOf(zone.ToCivil(*shown));
  if (AsksClock(pdu)) {
    Bytes data = BytesOf(zone.ToCivil(*shown));
    data.push_back(zone.IsDaylight(*shown) ? 0 : 1);
    return data;
  }
  const bool tagged = pdu[0] == kMemoryTagged;
  if (tagged || pdu[0] == kMemory) {
    const View place = pdu.subspan(tagged ? 2 : 1);
    const auto load = loads_.find(place[0] == 0x03 ? 1 : place[0] - 6U);
    if (load == loads_.end()) return std::nullopt;
    auto memory = load->second.Memory(*ByteReader(place).U16Be(1), place[3]);
    if (memory && tagged) memory->insert(memory->begin(), pdu[1]);
    return memory;
  }
  if (pdu[0] != kRead || pdu.size() < 2 || (pdu[1] != 0x04 && pdu[1] != 0x06)) return std::nullopt;
  const auto load = loads_.find(pdu.size() == 2 ? 1 : pdu[2] + 1U);
  if (load == loads_.end()) return std::nullopt;
  if (pdu[1] == 0x04) return load->second.Pointer();
  return Bytes{0, static_cast<std::uint8_t>(load->second.minutes())};
}

std::optional<Bytes> MeterTwin::OwnData(View pdu) const {
  if (pdu.size() < 2 || pdu[0] != kRead) return std::nullopt;
  switch (pdu[1]) {
    case kSerialNumber: {
      Bytes data = ExtendedAddress(address_.serial());
      data.erase(data.begin());
      Append(data, Bytes{0x06, 0x09, 0x02});
      return data;
    }
    case kShortAddress: {
      if (pdu.size() == 2) return Bytes{0, address_.short_address()};
      const Bytes extended = ExtendedAddress(address_.serial());
      return Bytes(extended.begin() + 1, extended.end());
    }
    case kRatios:
      return Bytes(std::begin(kUnitRatios), std::end(kUnitRatios));
    case kVariant:
      return Bytes(std::begin(kVariantBytes), std::end(kVariantBytes));
    default:
      return std::nullopt;
  }
}

bool MeterTwin::Fill(View pdu, Instant now, Bytes& data) const {
  const bool identity =
      pdu.size() >= 2 && pdu[0] == kRead && (pdu[1] == kSerialNumber || pdu[1] == kShortAddress);
  bool found = false;
  Scale scale;
  if (pdu[0] != kRead || pdu[1] == 0x0D || (pdu[1] >= 0x11 && pdu[1] != kVariant)) {
    scale = ScaleNow(now);
  }
  scale.zone = settings_.time_zone;
  for (const auto& point : points_.all()) {
    if (!point.read || !std::ranges::equal(point.read->pdu, pdu)) continue;
    found = true;
    // Serial number and address come from the configuration, not from points.
    const Decoder decoder = point.read->decoder;
    if (identity && (decoder == Decoder::u32_be || decoder == Decoder::u8)) continue;
    EncodeField(*point.read, Measured(pdu, point, now), scale, data);
  }
  return found;
}

Scale MeterTwin::ScaleNow(Instant now) const {
  constexpr std::uint8_t kAskRatios[] = {kRead, kRatios};
  constexpr std::uint8_t kAskVariant[] = {kRead, kVariant};
  const Bytes ratios = Data(kAskRatios, now).value_or(Bytes());
  const Bytes variant = Data(kAskVariant, now).value_or(Bytes());
  return Merge(ParseRatios(ratios), ParseVariant(variant));
}

std::optional<double> MeterTwin::FloatOf(View pdu, std::uint8_t parameter, Instant now) const {
  const auto point = float_points_.find(parameter);
  if (point == float_points_.end()) return std::nullopt;
  const double value = ToDouble(Measured(pdu, points_.all()[point->second], now));
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

std::optional<Bytes> MeterTwin::Floats(View pdu, Instant now) const {
  Bytes data;
  bool any = false;
  const auto add = [&](const std::optional<std::uint8_t>& parameter) {
    const auto value = parameter ? FloatOf(pdu, *parameter, now) : std::nullopt;
    any = any || value;
    AppendFloat(data, value);
  };
  if (pdu[1] == kFloatMask) {
    if (pdu[3] > 1 || pdu[4] != 0) return std::nullopt;
    data.push_back(pdu[2]);
    const std::vector<unsigned> bits = MaskBits(pdu);
    if (bits.size() > kMostMaskedFloats) return std::nullopt;
    for (const unsigned bit : bits) add(MaskedParameter(bit));
  } else {
    const Bytes live = Live(pdu);
    const std::size_t slots = pdu[2] < 2 ? 1 : 4;
    for (std::size_t slot = 0; slot < slots; ++slot) add(ParameterAt(live, 4 * slot));
  }
  return any ? std::optional(data) : std::nullopt;
}

std::optional<Bytes> MeterTwin::Data(View pdu, Instant now) const {
  const auto length = LengthOfData(pdu);
  if (!length) return std::nullopt;
  if (pdu[0] == kRead && (pdu[1] == kFloats || pdu[1] == kFloatMask)) {
    const bool knows = pdu[1] == kFloats ? knows_floats_ : knows_masks_;
    return knows ? Floats(pdu, now) : std::nullopt;
  }
  if (auto record = journals_.Record(pdu)) return record;
  if (auto bytes = OfClock(pdu, now)) return bytes;
  auto own = OwnData(pdu);
  Bytes data = own ? *own : Bytes(*length);
  const bool found = Fill(pdu, now, data);
  if (type_ && pdu[0] == kRead && pdu[1] == kVariant) {
    data[2] = static_cast<std::uint8_t>(unsigned{*type_} << 4U | (data[2] & 0x0FU));
  }
  if (const auto shown = clock_.At(now); shown && !own && !found) {
    if (auto registers = TwinRegisters(pdu, clock_.zone().ToCivil(*shown))) return registers;
  }
  return own || found || journals_.Has(pdu) ? std::optional(std::move(data)) : std::nullopt;
}

}  // namespace baudgate::protocols::set4tm
