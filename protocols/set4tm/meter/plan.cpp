// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/plan.h"

#include <algorithm>
#include <array>
#include <set>

#include "protocols/set4tm/meter/codec.h"

namespace baudgate::protocols::set4tm {

namespace {

constexpr std::size_t kMaskAt = 4;
constexpr std::size_t kMaskSize = 8;
constexpr std::size_t kRequestSize = kMaskAt + kMaskSize;
constexpr std::uint8_t kNone = 0xFF;

/// The parameters (RWRI bytes of 08 1B) by the bits of a mask (08 23), from the lowest bit of m8 to
/// the highest of m2. U1(1): positive sequence voltage; K0 and K2: zero and negative sequence
/// unbalance, of current (i) or voltage (u); KI and KU: distortion.
constexpr std::array<std::uint8_t, 56> kByBit = {
    0x00, 0x01, 0x02, 0x03, 0x04,  0x05,  0x06,  0x07,   // m8: P, Q
    0x08, 0x09, 0x0A, 0x0B, 0x30,  0x31,  0x32,  0x33,   // m7: S, cos
    0x1C, 0x11, 0x12, 0x13, 0x18,  0x15,  0x16,  0x17,   // m6: Ubat, U, U1(1), line U
    0x2C, 0x21, 0x22, 0x23, 0x28,  0x25,  0x26,  0x27,   // m5: K0i, I, K2i, KI
    0x8C, 0x81, 0x82, 0x83, 0x88,  0x85,  0x86,  0x87,   // m4: K0u, KU, K2u, line KU
    0xE0, 0xE1, 0xE2, 0xE3, 0x40,  0x70,  kNone, kNone,  // m3: loss P, frequency, temperature
    0xE4, 0xE5, 0xE6, 0xE7, kNone, kNone, kNone, kNone,  // m2: loss Q
};

/// True for parameters whose phase bits 0 mean phase 1 and not a sum: voltage, current, distortion,
/// averaged values.
bool ZeroIsPhaseOne(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  return mode == 1 || mode == 2 || mode == 8 || mode == 0xA || mode == 0xB;
}

bool HasPhases(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  if (mode == 4 || mode == 7 || mode == 9) return false;  // frequency, temperature
  // Positive sequence, unbalance and battery have one value each, so they have no phases.
  return !(ZeroIsPhaseOne(parameter) && (parameter & 0x0CU) >= 8U);
}

}  // namespace

std::optional<std::uint8_t> ParameterAt(View pdu, std::size_t offset) {
  if (pdu.size() != 4 || pdu[0] != kRead || pdu[1] != kFloats || offset % 4 != 0) {
    return std::nullopt;
  }
  const bool group = pdu[2] == 2;
  if ((pdu[2] != 0 && !group) || offset / 4 > (group ? 3U : 0U)) return std::nullopt;
  std::uint8_t parameter = pdu[3];
  if (!HasPhases(parameter)) {
    // For parameters without phases the phase bits have no meaning, so they are cleared.
    return static_cast<std::uint8_t>(ZeroIsPhaseOne(parameter) ? parameter & 0xFCU
                                                               : parameter & 0xF0U);
  }
  if (group) parameter = static_cast<std::uint8_t>((parameter & 0xFCU) | (offset / 4));
  if (ZeroIsPhaseOne(parameter) && (parameter & 3U) == 0) ++parameter;
  return parameter;
}

std::optional<unsigned> MaskBit(std::uint8_t parameter) {
  if (parameter == kNone) return std::nullopt;
  for (unsigned bit = 0; bit < kByBit.size(); ++bit) {
    if (kByBit[bit] == parameter) return bit;
  }
  return std::nullopt;
}

std::optional<std::uint8_t> MaskedParameter(unsigned bit) {
  if (bit >= kByBit.size() || kByBit[bit] == kNone) return std::nullopt;
  return kByBit[bit];
}

bool IsMasked(View pdu) { return pdu.size() > 2 && pdu[0] == kRead && pdu[1] == kFloatMask; }

Bytes MaskRequest(std::uint8_t id, const std::vector<unsigned>& bits) {
  Bytes pdu(kRequestSize);
  pdu[0] = kRead;
  pdu[1] = kFloatMask;
  pdu[2] = id;
  for (const unsigned bit : bits) {
    std::uint8_t& mask = pdu[kRequestSize - 1 - bit / 8];
    mask = static_cast<std::uint8_t>(mask | (1U << (bit % 8)));
  }
  return pdu;
}

std::vector<unsigned> MaskBits(View pdu) {
  std::vector<unsigned> bits;
  if (pdu.size() != kRequestSize || pdu[0] != kRead || pdu[1] != kFloatMask) return bits;
  for (unsigned bit = 0; bit < kMaskSize * 8; ++bit) {
    if (((pdu[kRequestSize - 1 - bit / 8] >> (bit % 8)) & 1U) != 0) bits.push_back(bit);
  }
  return bits;
}

namespace {

constexpr std::uint8_t kTemperature = 0x70;  // a parameter of 08 1B
constexpr std::uint8_t kAskTemperature = 0x01;
constexpr std::uint8_t kAskOne = 0x11;
constexpr std::uint8_t kAskFour = 0x16;
constexpr std::size_t kFloatSize = 4;
constexpr std::size_t kIntegerSize = 3;

}  // namespace

Decoder IntegerDecoder(std::uint8_t parameter) {
  const unsigned mode = parameter >> 4U;
  const unsigned kind = (parameter >> 2U) & 3U;
  switch (mode) {
    case 0x0:
      if (kind == 0) return Decoder::power_be;
      return kind == 1 ? Decoder::reactive_be : Decoder::apparent_be;
    case 0x1:
    case 0xA:
      return Decoder::voltage_be;
    case 0x2:
      return kind == 0 ? Decoder::current_be : Decoder::hundredths_be;
    case 0x3:
      return kind == 0 ? Decoder::factor_be : Decoder::hundredths_be;
    case 0xE:
      return kind == 0 ? Decoder::power_be : Decoder::reactive_be;
    default:
      return Decoder::hundredths_be;
  }
}

std::optional<Field> AsInteger(const Field& field) {
  if (field.decoder != Decoder::float_le) return std::nullopt;
  const auto parameter = ParameterAt(field.pdu, field.offset);
  if (!parameter) return std::nullopt;
  // The temperature is not in the replies to 08 11 and 08 16, so it has a request of its own.
  if (*parameter == kTemperature) return Field{{kRead, kAskTemperature}, Decoder::i8, 1, 0};
  const bool group = field.pdu[2] == 2;
  const Bytes pdu = {kRead, group ? kAskFour : kAskOne, field.pdu[3]};
  return Field{pdu, IntegerDecoder(*parameter), field.offset / kFloatSize * kIntegerSize, 0};
}

namespace {

const Bytes kMasked = {kRead, kFloatMask};

}  // namespace

PointFields::PointFields(std::span<const config::Point> points) : points_(points) {
  fields_.reserve(points.size());
  for (const config::Point& point : points) {
    auto field = ParseField(point.read);
    fields_.push_back(field ? std::optional(std::move(*field)) : std::nullopt);
  }
  Index();
}

void PointFields::Index() {
  by_pdu_.clear();
  by_bit_.clear();
  for (std::size_t point = 0; point < fields_.size(); ++point) {
    if (!fields_[point]) continue;
    by_pdu_.emplace(fields_[point]->pdu, point);
    if (const auto bit = BitOf(point)) by_bit_.emplace(*bit, point);
  }
}

bool PointFields::HasFloats() const {
  return std::ranges::any_of(
      fields_, [](const auto& field) { return field && AsInteger(*field).has_value(); });
}

void PointFields::UseIntegers(bool integers) {
  PointFields said(points_);
  fields_ = std::move(said.fields_);
  for (auto& field : fields_) {
    if (field && integers) field = AsInteger(*field).value_or(std::move(*field));
  }
  Index();
}

PduPlan PointFields::MakePlan(bool masked, Often is_often) const {
  PduPlan plan({.may_join =
                    [](const Block<Bytes>& block, const Block<Bytes>&) {
                      return block.key == kMasked && block.items < kMostMaskedFloats;
                    },
                .reads_between = [](const Bytes& key) { return key != kMasked; },
                .refused = WhenRefused::drop,
                .is_often = std::move(is_often)});
  std::set<std::size_t> planned;
  for (std::size_t number = masked ? config::kGroups : 0; number-- > 0;) {
    const auto group = static_cast<config::Group>(number);
    for (const std::size_t point : MaskedPoints(group)) {
      const std::size_t bit = *BitOf(point);
      plan.Add(group, point, kMasked, bit, bit + 1);
      planned.insert(point);
    }
  }
  for (std::size_t point = 0; point < points_.size(); ++point) {
    if (!fields_[point] || planned.contains(point)) continue;
    plan.Add(points_[point].group, point, fields_[point]->pdu);
  }
  plan.Make();
  return plan;
}

std::vector<std::size_t> PointFields::MaskedPoints(config::Group group) const {
  std::vector<std::size_t> points;
  std::set<unsigned> bits;
  for (std::size_t point = 0; point < points_.size(); ++point) {
    const auto bit = points_[point].group == group ? BitOf(point) : std::nullopt;
    if (!bit) continue;
    points.push_back(point);
    bits.insert(*bit);
  }
  if (bits.size() < 2) points.clear();  // a single value is cheaper by 08 1B, so no mask is used
  return points;
}

Bytes PointFields::PduOf(const PduPlan& plan, std::size_t query) const {
  const Bytes& key = plan.block(query).key;
  if (key != kMasked) return key;
  std::vector<unsigned> bits;
  for (const std::size_t point : plan.queries()[query].points) bits.push_back(*BitOf(point));
  return MaskRequest(0, bits);
}

std::optional<unsigned> PointFields::BitOf(std::size_t point) const {
  const auto& field = fields_[point];
  if (!field || field->decoder != Decoder::float_le) return std::nullopt;
  const auto parameter = ParameterAt(field->pdu, field->offset);
  return parameter ? MaskBit(*parameter) : std::nullopt;
}

std::vector<Match> PointFields::Matches(View pdu) const {
  std::vector<Match> matches;
  const auto [begin, end] = by_pdu_.equal_range(Bytes(pdu.begin(), pdu.end()));
  for (auto its = begin; its != end; ++its) {
    matches.push_back({its->second, *fields_[its->second]});
  }
  std::size_t offset = 1;
  for (const unsigned bit : MaskBits(pdu)) {
    const auto [first, last] = by_bit_.equal_range(bit);
    for (auto its = first; its != last; ++its) {
      matches.push_back({its->second, *fields_[its->second]});
      matches.back().field.offset = offset;
    }
    offset += 4;
  }
  std::ranges::sort(matches, {}, &Match::point);
  return matches;
}

}  // namespace baudgate::protocols::set4tm
