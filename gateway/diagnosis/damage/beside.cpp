// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/damage/beside.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/changed_bytes.h"
#include "gateway/diagnosis/damage/other_frame.h"
#include "gateway/diagnosis/damage/words.h"

namespace baudgate {
namespace {

constexpr std::size_t kQuotedBytes = 8;
/// A modem, radio or serial server puts no more around a packet.
constexpr std::size_t kLongestFrame = 24;
/// So many are no accident of a driver.
constexpr std::ptrdiff_t kFewStrange = 2;

Symptom SymptomOf(Recognised::What what) {
  switch (what) {
    case Recognised::What::other_device:
      return Symptom::other_device;
    case Recognised::What::other_master:
      return Symptom::other_master;
    case Recognised::What::other_reply:
      return Symptom::other_reply;
    case Recognised::What::other_setting:
      return Symptom::other_setting;
    case Recognised::What::other_form:
      return Symptom::other_form;
    case Recognised::What::other_check:
      return Symptom::bad_check;
    case Recognised::What::too_short:
      return Symptom::bytes_lost;
    case Recognised::What::other_protocol:
      break;
  }
  return Symptom::other_protocol;
}

/// A driver that takes or leaves the bus makes ones and then zeros of a character, or the reverse.
bool IsOfDriver(std::uint8_t byte) {
  const unsigned inverse = static_cast<std::uint8_t>(~byte);
  return (byte & (byte + 1U)) == 0 || (inverse & (inverse + 1U)) == 0;
}

/// 00 and FF, as from a line that is not driven, and line ends.
bool IsFiller(View bytes) {
  return std::ranges::all_of(bytes, [](auto byte) { return byte % 0xFF == 0 || IsLineEnd(byte); });
}

/// "10 02 ... 10 03"; empty: too many for a packet's frame.
std::string Around(View before, View behind) {
  if (before.size() + behind.size() > kLongestFrame) return {};
  while (!before.empty() && IsLineEnd(before.back())) before = before.first(before.size() - 1);
  while (!behind.empty() && IsLineEnd(behind.front())) behind = behind.subspan(1);
  const View text = before.empty() ? behind : before;
  const bool words = text.size() > 1 && std::ranges::all_of(text, IsPrintable);
  if (words && (before.empty() || behind.empty())) {
    return (before.empty() ? "... " : "") + Quote(text) + (before.empty() ? "" : " ...");
  }
  const std::string front = ToHex(before.first(std::min(before.size(), kQuotedBytes)));
  const std::string back = ToHex(behind.first(std::min(behind.size(), kQuotedBytes)));
  return front + (front.empty() ? "... " : " ...") + (back.empty() || front.empty() ? "" : " ") +
         back;
}

}  // namespace

std::optional<Finding> Recognise(const Hearing& hearing, View heard) {
  if (hearing.protocol->recognise == nullptr) return std::nullopt;
  auto recognised = hearing.protocol->recognise(hearing.request, heard, *hearing.options);
  if (!recognised) return std::nullopt;
  return Finding{.symptom = SymptomOf(recognised->what),
                 .cause = std::move(recognised->cause),
                 .remedy = std::move(recognised->remedy)};
}

bool IsHexText(const Hearing& hearing, View part) {
  const auto is_digit = [](std::uint8_t byte) {
    return std::isxdigit(byte) != 0 || IsLineEnd(byte);
  };
  return hearing.protocol->carrier != nullptr && !hearing.protocol->tcp &&
         std::ranges::all_of(hearing.request, IsPrintable) && std::ranges::all_of(part, is_digit);
}

std::optional<Finding> Stranger(const Hearing& hearing, View part) {
  if (part.size() <= kHarmless) return std::nullopt;
  auto recognised = Recognise(hearing, part);
  if (recognised && recognised->symptom == Symptom::other_master) {
    recognised->symptom = Symptom::master_beside;
    return recognised;
  }
  if (recognised && recognised->symptom == Symptom::other_device) {
    recognised->symptom = Symptom::device_beside;
    return recognised;
  }
  if (auto foreign = OtherFrame(hearing, part)) {
    foreign->symptom = Symptom::master_beside;
    return foreign;
  }
  // In a protocol of hexadecimal digits these are the rest of a reply.
  if (IsHexText(hearing, part)) return std::nullopt;
  auto words = Words(hearing, part, true);
  if (words) words->symptom = Symptom::text_beside;
  return words;
}

Finding StrayBeside(const Hearing& hearing, View before, View behind) {
  const auto noise = [&](Symptom symptom) {
    return Finding{.symptom = symptom,
                   .bytes = before.size() + behind.size(),
                   .cause = Around(before, behind)};
  };
  // Characters such as no driver makes: something speaks while nobody else does.
  const auto strange = std::ranges::count_if(
      before, [](std::uint8_t byte) { return !IsOfDriver(byte) && !IsLineEnd(byte); });
  const bool speaks = !hearing.connection && strange >= kFewStrange;
  if (before.size() > kHarmless || speaks) return noise(Symptom::noise_before);
  // No driver makes these.
  if (hearing.protocol->tcp && !behind.empty()) return noise(Symptom::noise_behind);
  if (behind.size() > kHarmless) return noise(Symptom::noise_behind);
  // One byte on a wire is the driver's, and so are more of them without a form.
  const std::size_t few = hearing.connection ? 1 : 2;
  const bool form = !IsFiller(before) || !IsFiller(behind);
  return form && before.size() + behind.size() >= few ? noise(Symptom::few_beside) : Finding{};
}

}  // namespace baudgate
