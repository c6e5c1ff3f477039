// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/units.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::string_view kUnitBehind = "_unit";
constexpr std::string_view kUnitInFront = "unit_";

/// Letters with which NMEA 0183 names the unit of a speed, and that unit as points have it.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kLettersOfUnits = {
    {{"N", "kn"}, {"K", "km/h"}, {"M", "m/s"}, {"S", "mph"}}};

/// Without blanks; "°C" and "degC" are "C".
std::string PlainText(std::string_view unit) {
  std::string text(unit);
  std::erase(text, ' ');
  for (const std::string_view degree : {"°", "deg"}) {
    if (text == std::string(degree) + "C" || text == std::string(degree) + "F") {
      return text.substr(degree.size());
    }
  }
  return text;
}

/// "mPa" and "MPa", but not "mbar" and "MBAR" of a device that writes capitals only.
bool AreMilliAndMega(std::string_view one, std::string_view other) {
  return one.size() > 1 && one.front() != other.front() && config::Lower(one).front() == 'm' &&
         one.substr(1) == other.substr(1);
}

bool IsNumberField(const Element& element) {
  return element.is_field() && !element.name.empty() && element.format.is_number() &&
         element.name != kChecksum && element.name != kAddress;
}

/// The number next to elements[index], in front of it or else behind it; null: neither is one.
const Element* NumberNextTo(const Pattern& pattern, std::size_t index) {
  const auto& elements = pattern.elements;
  for (const bool behind : {false, true}) {
    std::size_t place = behind ? index + 1 : index - 1;  // wraps in front of the first
    const bool separates =
        place < elements.size() && !elements[place].is_field() &&
        AsText(elements[place].literal).find_first_not_of(" ,;\t") == std::string_view::npos;
    if (separates) place += behind ? 1U : std::size_t{0} - 1;
    if (place < elements.size() && IsNumberField(elements[place])) return &elements[place];
  }
  return nullptr;
}

/// Whether elements[index], a unit, is that of the number `field`: by its name ("weight_unit"),
/// because the answer has no other number, or because it stands next to it.
bool IsUnitOf(const Pattern& pattern, std::size_t index, std::string_view field) {
  std::string_view own = pattern.elements[index].name;
  if (own.ends_with(kUnitBehind)) {
    own.remove_suffix(kUnitBehind.size());
  } else if (own.starts_with(kUnitInFront)) {
    own.remove_prefix(kUnitInFront.size());
  }
  if (own == field) return true;
  const Element* named = pattern.Find(own);
  if (named != nullptr && IsNumberField(*named)) return false;
  const bool alone = std::ranges::none_of(pattern.elements, [&](const Element& element) {
    return IsNumberField(element) && element.name != field;
  });
  const Element* next = NumberNextTo(pattern, index);
  return alone || (next != nullptr && next->name == field);
}

/// The texts with which the number is good. A parameter chooses one of them.
std::vector<std::string> GoodTexts(const Telegram& telegram, const std::string& unit,
                                   const Bound& bound) {
  const bool chosen = telegram.listen || (telegram.send && telegram.send->pattern.Has(unit));
  const auto parameter = bound.find(unit);
  if (chosen && parameter != bound.end()) return {ToText(parameter->second)};
  std::vector<std::string> texts;
  const auto codes = telegram.codes.find(unit);
  if (codes == telegram.codes.end()) return texts;
  for (const auto& [text, meaning] : codes->second) {
    if (meaning->quality == Quality::good) texts.push_back(text);
  }
  return texts;
}

/// "0" and "1" are codes of units, and a blank says nothing.
bool NamesUnit(std::string_view text) {
  return text.find_first_not_of(" 0123456789") != std::string_view::npos;
}

std::string SayWrongUnit(const config::Point& point, const Telegram& telegram,
                         const std::string& unit, const std::vector<std::string>& texts) {
  std::string good;
  for (const std::string& text : texts) good += (good.empty() ? "'" : " or '") + text + "'";
  return "has unit " + config::Quoted(point.unit) + ", and its number is good only where '" + unit +
         "' of telegram '" + telegram.name + "' says " + good +
         ": correct the unit of the point, or give it a 'scale' that converts the number; if the "
         "device is set to " +
         config::Quoted(point.unit) + ", correct 'codes' or 'parameters' of the telegram instead";
}

}  // namespace

bool IsUnit(std::string_view name) {
  return name == "unit" || name.ends_with(kUnitBehind) || name.starts_with(kUnitInFront);
}

bool IsSameUnit(std::string_view text, std::string_view unit) {
  const std::string said = PlainText(text);
  const std::string wanted = PlainText(unit);
  const bool letter = std::ranges::any_of(kLettersOfUnits, [&](const auto& known) {
    return known.first == said && known.second == wanted;
  });
  if (letter) return true;
  return config::Lower(said) == config::Lower(wanted) && !AreMilliAndMega(said, wanted);
}

std::string WrongUnit(const config::Point& point, const Telegram& telegram, const Element& field,
                      const Bound& bound) {
  if (point.unit.empty() || point.scale != 1 || point.offset != 0) return {};
  for (const Form& form : telegram.receive) {
    if (!form.pattern.Has(field.name)) continue;
    for (std::size_t i = 0; i < form.pattern.elements.size(); ++i) {
      const Element& unit = form.pattern.elements[i];
      const bool is_text = unit.format.is_text() && !unit.format.is_number();
      if (!unit.is_field() || !is_text || !IsUnit(unit.name)) continue;
      if (!IsUnitOf(form.pattern, i, field.name)) continue;
      const std::vector<std::string> texts = GoodTexts(telegram, unit.name, bound);
      const bool same = std::ranges::any_of(
          texts, [&](const std::string& text) { return IsSameUnit(text, point.unit); });
      if (!same && std::ranges::any_of(texts, NamesUnit)) {
        return SayWrongUnit(point, telegram, unit.name, texts);
      }
    }
  }
  return {};
}

}  // namespace baudgate::protocols::telegram
