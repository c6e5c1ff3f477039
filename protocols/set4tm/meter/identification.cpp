// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/meter/identification.h"

#include <algorithm>
#include <string>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

constexpr StatusWord kUnknown = StatusWord::unknown;
constexpr Knows kNo = Knows::no;
constexpr Knows kYes = Knows::yes;
constexpr Knows kPerhaps = Knows::perhaps;

// The types of meters. Codes and names: reference 9.3. Floats: 9.7, "SET-4TM.02 and older: integers
// only". Masks: 9.8, supported by M models, and by .03 from firmware 02.28.30 and PSCH from
// 32.00.00.
constexpr MeterType kTypes[] = {
    {0x0, "SET-4TM.02, SET-1M.01", kUnknown, kNo, kNo},
    {0x1, "SET-4TM.03", kUnknown, kYes, kPerhaps},
    {0x2, "SEB-1TM.01, .02", kUnknown, kNo, kNo},
    {0x3, "PSCH-4TM.05", kUnknown, kYes, kPerhaps},
    {0x4, "SEO-1.16", kUnknown, kNo, kNo},
    {0x5, "PSCH-3TM.05", kUnknown, kYes, kPerhaps},
    {0x6, "PSCH-4TM.05M", kUnknown, kYes, kYes},
    {0x7, "PSCH-3TM.05M", kUnknown, kYes, kYes},
    {0x8, "SET-4TM.02M, .03M", StatusWord::as_02m_03m, kYes, kYes},
    {0x9, "SEB-1TM.02D", kUnknown, kPerhaps, kPerhaps},
    {0xA, "PSCH-3/4TM.05D", kUnknown, kPerhaps, kPerhaps},
    {0xB, "PSCH-3/4TM.05MK", kUnknown, kPerhaps, kPerhaps},
};

/// Returns the code and name of a type: "8 (SET-4TM.02M, .03M)", or "C" for an unknown type.
std::string NameOfType(std::uint8_t code) {
  const std::string digit(1, "0123456789ABCDEF"[code & 0x0FU]);
  const MeterType* type = FindType(code);
  return type == nullptr ? digit : digit + " (" + std::string(type->name) + ")";
}

}  // namespace

const MeterType* FindType(std::uint8_t code) {
  for (const MeterType& type : kTypes) {
    if (type.code == code) return &type;
  }
  return nullptr;
}

std::optional<std::uint8_t> ParseType(std::string_view text) {
  if (text.starts_with("0x")) text.remove_prefix(2);
  const auto code = ParseInteger<std::uint8_t>(text, 16);
  return code && *code <= 0x0F ? code : std::nullopt;
}

namespace {

const Bytes kAskVariant = {kRead, kVariant};
const Bytes kAskRatios = {kRead, kRatios};
const Bytes kAskPort = {kRead, kPort};
const Bytes kAskTime = {kJournal, 0x00};
const Bytes kAskTimeExtended = {kJournalExtended, 0x00, 0x00};
constexpr std::size_t kVariantSize = 3;
constexpr Duration kOtherTypeRests = 1min;

bool ReadsFlags(std::span<const Match> matches) {
  return std::ranges::any_of(matches, [](const Match& match) { return IsFlag(match.field); });
}

bool Lacks(std::span<const Match> matches, bool (*lacks)(Measure, const Scale&),
           const Scale& scale) {
  return std::ranges::any_of(
      matches, [&](const Match& match) { return lacks(MeasureOf(match.field), scale); });
}

std::string Listed(const std::vector<std::uint8_t>& types) {
  std::string text;
  for (std::size_t i = 0; i < types.size(); ++i) {
    text += i == 0 ? "" : i + 1 == types.size() ? " or " : ", ";
    text += NameOfType(types[i]);
  }
  return text;
}

}  // namespace

Identification::Identification(const config::Device& device, const Settings& settings)
    : device_(device), settings_(settings) {}

void Identification::OnReconnect() {
  learned_ = {};
  type_.reset();
  wants_type_ = asked_variant_ = asked_ratios_ = false;
  multiplier_ = 1;
  day_.clear();
  new_day_ = false;
}

void Identification::OnLost() {
  if (!settings_.types.empty()) asked_variant_ = false;
}

void Identification::ForgetRefusals() {
  if (!type_) asked_variant_ = false;
  if (!learned_.voltage_ratio) asked_ratios_ = false;
}

std::optional<Bytes> Identification::Question(std::span<const Match> matches) const {
  const Scale known = scale();
  const bool judged = !settings_.types.empty() && !device_.identity.ignore;
  const bool type =
      judged || wants_type_ || ReadsFlags(matches) || Lacks(matches, LacksVariant, known);
  const bool again = judged && trouble_;
  if ((!asked_variant_ || again) && type) return kAskVariant;
  if (!asked_ratios_ && Lacks(matches, LacksRatios, known)) return kAskRatios;
  return std::nullopt;
}

void Identification::Learn(View pdu, View data) {
  if (Is(pdu, kAskVariant) && data.size() == kVariantSize) {
    const Scale variant = ParseVariant(data);
    learned_.meter_constant = variant.meter_constant;
    learned_.power_coefficient = variant.power_coefficient;
    learned_.current_coefficient = variant.current_coefficient;
    type_ = static_cast<std::uint8_t>(data[2] >> 4U);
    asked_variant_ = true;
    Judge();
  } else if (Is(pdu, kAskRatios)) {
    const Scale ratios = ParseRatios(data);
    learned_.voltage_ratio = ratios.voltage_ratio;
    learned_.current_ratio = ratios.current_ratio;
    learned_.voltage_in_floats = ratios.voltage_in_floats;
    learned_.current_in_floats = ratios.current_in_floats;
    asked_ratios_ = true;
  } else if (Is(pdu, kAskPort) && data.size() == 2) {
    multiplier_ = std::max<unsigned>(1, data[1]);
  } else if (Is(pdu, kAskTime) || Is(pdu, kAskTimeExtended)) {
    const auto day = ByteReader(data).Slice(4, 3);
    if (!day) return;
    new_day_ = !day_.empty() && !std::ranges::equal(day_, *day);
    day_.assign(day->begin(), day->end());
  }
}

/// Takes a refusal. A meter that refuses to report its type fits any profile, but its status word
/// is not decoded.
bool Identification::OnRefused(View pdu) {
  if (Is(pdu, kAskRatios)) asked_ratios_ = true;
  if (Is(pdu, kAskVariant)) {
    asked_variant_ = true;
    type_.reset();
    trouble_ = {};
  }
  return Is(pdu, kAskVariant) || Is(pdu, kAskRatios);
}

/// Sets trouble_ if the meter's type is none of the profile's types. Codes above B are newer than
/// the reference: for them trouble_ has only a text, which the status shows, and the meter is
/// polled as usual.
void Identification::Judge() {
  trouble_ = {};
  if (settings_.types.empty() || std::ranges::count(settings_.types, *type_) != 0) return;
  const std::string what =
      "type " + NameOfType(*type_) + ", but the profile is for type " + Listed(settings_.types);
  if (FindType(*type_) == nullptr) {
    trouble_.text = "the meter has " + what +
                    ", so its status word never has a good value; use a profile for this type";
    return;
  }
  if (device_.identity.ignore) return;
  trouble_ = {Reason::other_module,
              "the meter has " + what + "; correct the profile or the address"};
}

/// True if the meter's type is known to have the status word of .02M and .03M. In `baudgate
/// decode`, which asks no meter, all types of the profile must have it.
bool Identification::KnowsStatusWord() const {
  const auto known = [](std::uint8_t code) {
    const MeterType* type = FindType(code);
    return type != nullptr && type->status_word == StatusWord::as_02m_03m;
  };
  if (type_) return known(*type_);
  return !asked_variant_ && !settings_.types.empty() && std::ranges::all_of(settings_.types, known);
}

Knows Identification::floats() const {
  const MeterType* type = type_ ? FindType(*type_) : nullptr;
  return type == nullptr ? Knows::perhaps : type->floats;
}

bool Identification::WantType() {
  wants_type_ = true;
  return !asked_variant_;
}

Answer Identification::OtherType() const { return NotThisMeter(kOtherTypeRests, trouble_.text); }

Knows Identification::masked_floats() const {
  const MeterType* type = type_ ? FindType(*type_) : nullptr;
  return type == nullptr ? Knows::perhaps : type->masked_floats;
}

}  // namespace baudgate::protocols::set4tm
