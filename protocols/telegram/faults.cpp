// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/faults.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::string_view kUnitBehind = "_unit";
constexpr std::string_view kUnitInFront = "unit_";

/// The letters by which NMEA 0183 names units of speed, each with the unit that points use.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kLettersOfUnits = {
    {{"N", "kn"}, {"K", "km/h"}, {"M", "m/s"}, {"S", "mph"}}};

/// Returns the unit without blanks; "°C" and "degC" become "C".
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

/// True if the units differ as milli and mega do, as in "mPa" and "MPa". False for "mbar" and
/// "MBAR", which are the same unit: some devices write capitals only.
bool AreMilliAndMega(std::string_view one, std::string_view other) {
  return one.size() > 1 && one.front() != other.front() && Lower(one).front() == 'm' &&
         one.substr(1) == other.substr(1);
}

bool IsNumberField(const Element& element) {
  return element.is_field() && !element.name.empty() && element.format.is_number() &&
         element.name != kChecksum && element.name != kAddress;
}

/// Returns the number field beside elements[index], first in front of it, then behind it. Null:
/// there is no number field beside it.
const Element* NumberNextTo(const Pattern& pattern, std::size_t index) {
  const auto& elements = pattern.elements;
  for (const bool behind : {false, true}) {
    // For index 0 the subtraction wraps around, and `place` is no element.
    std::size_t place = behind ? index + 1 : index - 1;
    const bool separates =
        place < elements.size() && !elements[place].is_field() &&
        AsText(elements[place].literal).find_first_not_of(" ,;\t") == std::string_view::npos;
    if (separates) place += behind ? 1U : std::size_t{0} - 1;
    if (place < elements.size() && IsNumberField(elements[place])) return &elements[place];
  }
  return nullptr;
}

/// True if elements[index] is the unit of the number `field`: its name shows this ("weight_unit"),
/// the answer has no other number, or it is beside the number.
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

/// Returns the texts of the field `unit` with which the number beside it is good: the text of the
/// parameter if a parameter chooses the unit, else all texts with a good code.
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

/// True if the text can be the name of a unit. False for codes such as "0" and "1", and for blanks.
bool NamesUnit(std::string_view text) {
  return text.find_first_not_of(" 0123456789") != std::string_view::npos;
}

std::string SayWrongUnit(const config::Point& point, const Telegram& telegram,
                         const std::string& unit, const std::vector<std::string>& texts) {
  std::string good;
  for (const std::string& text : texts) good += (good.empty() ? "'" : " or '") + text + "'";
  return "has unit " + Quoted(point.unit) + ", but its number is good only if '" + unit +
         "' of telegram '" + telegram.name + "' is " + good +
         "; correct the unit of the point, or add a 'scale' that converts the number; if the "
         "device sends " +
         Quoted(point.unit) + ", correct 'codes' or 'parameters' of the telegram instead";
}

/// Returns an error for a point that reads the number `field` of `telegram`, if the number is good
/// only with other units than the point's unit. Empty: the units agree, or a `scale` or an `offset`
/// converts the number. `bound`: the address, and the parameters of the device and of the point.
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
  return Lower(said) == Lower(wanted) && !AreMilliAndMega(said, wanted);
}

namespace {

using config::Access;
using config::Point;
using config::Type;

/// True if the loss of the first digit would go unnoticed: a number without sign and width begins
/// the telegram, which has neither a size field nor a check value.
bool IsUnguarded(const Form& form) {
  const Element& first = form.pattern.elements.front();
  return form.is_unmarked() && first.is_field() && first.format.is_text_number() &&
         !first.is_fixed() && !first.format.sign && !form.size_at;
}

/// True for an unasked telegram that begins with a binary field and has no check value: any byte
/// can be its first byte, so its beginning cannot be found.
bool IsUnsynchronised(const Telegram& telegram, const Form& form) {
  const Element& first = form.pattern.elements.front();
  return telegram.listen && form.is_unmarked() && first.is_field() && !first.format.is_text();
}

/// Returns the largest number that the point can get. Empty: the limit is unknown.
std::optional<std::uint64_t> MostOf(const ReadPlace& place, const Format& format) {
  std::optional<unsigned> bits;
  if (place.select == ReadPlace::Select::bits) bits = place.bits;
  const bool has_range = format.is_binary() || format.kind == Format::Kind::hex;
  if (place.select == ReadPlace::Select::whole && has_range) bits = format.bits();
  if (!bits || *bits == 0) return std::nullopt;
  if (place.select == ReadPlace::Select::whole && format.kind == Format::Kind::sint) --*bits;
  if (format.kind == Format::Kind::bcd && place.select == ReadPlace::Select::whole) {
    std::uint64_t most = 0;
    for (std::size_t digit = 0; digit < 2 * format.width; ++digit) most = most * 10 + 9;
    return most;
  }
  return *bits >= 64 ? std::numeric_limits<std::uint64_t>::max() : (std::uint64_t{1} << *bits) - 1;
}

/// True if the point can contain `raw`, a number as in the telegram, after scale and offset are
/// applied.
bool Holds(const Point& point, std::uint64_t raw) {
  const Decimal number = Decimal(raw) * point.scale + point.offset;
  if (point.type == Type::boolean) return number == 0 || number == 1;
  if (point.type == Type::uint64) return number.ToUint64().has_value();
  const auto whole = number.ToInt64();
  return whole && config::RangeOf(point).Contains(*whole);
}

/// Returns the field in front of elements[index] or, with `behind`, after it; a separator may be
/// between them. Null: there is no such field, or it is a number.
const Element* Beside(const Pattern& pattern, std::size_t index, bool behind) {
  const auto at = [&](std::size_t steps) -> const Element* {
    const std::size_t place =
        // Below 0 the index wraps around, and `place` is no element.
        behind ? index + steps : index - steps;
    return place < pattern.elements.size() ? &pattern.elements[place] : nullptr;
  };
  const Element* next = at(1);
  const bool separates = next != nullptr && !next->is_field() &&
                         AsText(next->literal).find_first_not_of(" ,;\t") == std::string_view::npos;
  if (separates) next = at(2);
  if (next == nullptr || !next->is_field()) return nullptr;
  const bool speaks = next->format.is_text() && !next->format.is_text_number();
  return speaks || next->format.kind == Format::Kind::byte ? next : nullptr;
}

class DoubtFinder {
 public:
  DoubtFinder(const config::Device& device, const Description& description)
      : device_(device),
        description_(description),
        bound_(BoundOf(ReadSettings(device.options), device.address)) {}

  std::vector<ConfigRemark> Run() {
    for (point_ = 0; point_ < device_.points.size(); ++point_) {
      const Point& point = device_.points[point_];
      const auto place = ParseRead(point);
      const auto found = place ? description_.Find(place->call.telegram) : std::nullopt;
      if (!found || point.access == Access::write) continue;
      const Telegram& telegram = description_.telegrams[*found];
      CheckFront(telegram, *place);
      if (const Element* field = telegram.FindField(place->field)) {
        CheckBeside(telegram, *field);
        CheckRange(point, *place, *field);
        CheckSimulated(point, *place, *field);
      }
    }
    return std::move(doubts_);
  }

 private:
  void Tell(std::string text) { doubts_.push_back({point_, std::move(text)}); }

  void CheckFront(const Telegram& telegram, const ReadPlace& place) {
    for (const Form& form : telegram.receive) {
      if (IsUnsynchronised(telegram, form)) {
        Tell(
            "comes in a telegram without fixed first bytes and check value, so a lost byte would "
            "shift all values unnoticed; write the fixed bytes and {checksum}, if the telegram has "
            "them");
      }
      // With `recheck` a sudden change is read twice, so a lost digit is found.
      if (device_.points[point_].recheck != config::Recheck::off) continue;
      if (!IsUnguarded(form) || form.pattern.elements.front().name != place.field) continue;
      Tell(
          "is the first field of its telegram, so a lost first digit would go unnoticed; give the "
          "field a width if its length is fixed, or, if it always has a sign, write {" +
          place.field + ":+decimal}");
    }
  }

  /// Warns if a unit or state is beside the number, but has no codes.
  void CheckBeside(const Telegram& telegram, const Element& field) {
    if (!field.format.is_number()) return;
    for (const Form& form : telegram.receive) {
      const Element* number = form.pattern.Find(field.name);
      if (number == nullptr) continue;
      const auto index = static_cast<std::size_t>(number - form.pattern.elements.data());
      for (const bool behind : {true, false}) {
        const Element* text = Beside(form.pattern, index, behind);
        if (text != nullptr && IsUnjudged(telegram, *text))
          return TellBeside(form, telegram, *text);
      }
    }
  }

  bool IsUnjudged(const Telegram& telegram, const Element& text) const {
    const bool sent = telegram.send && telegram.send->pattern.Has(text.name);
    return text.name.empty() || !(sent || telegram.codes.contains(text.name) ||
                                  bound_.contains(text.name) || text.name == kChecksum);
  }

  void TellBeside(const Form& form, const Telegram& telegram, const Element& text) {
    std::string says = "g";
    for (const Example& example : telegram.examples) {
      const Match match = MatchAll(form, example.receive, {});
      if (match.kind != Match::Kind::whole) continue;
      const auto index = static_cast<std::size_t>(&text - form.pattern.elements.data());
      says = ToText(DecodeField(text.format, match.parts[index]));
      break;
    }
    if (text.name.empty() && says.empty()) return;
    const std::string name = text.name.empty() ? "unit" : text.name;
    Tell("comes with '" + says +
         "' beside its number, but this text is not checked, so the value counts as good with any "
         "unit or state; " +
         (text.name.empty() ? "name this field {" + name + ":…} and write" : "write") +
         " codes: { " + name + ": { '" + says +
         "': good } }, with all texts that the device may send");
  }

  void CheckRange(const Point& point, const ReadPlace& place, const Element& field) {
    if (point.type == Type::float32 || point.type == Type::float64 || point.type == Type::string) {
      return;
    }
    const auto most = MostOf(place, field.format);
    if (!most || Holds(point, *most)) return;
    Tell("has type " + std::string(config::Name(point.type)) +
         ", which cannot hold all values of '" + field.name + "', up to " + std::to_string(*most) +
         " on the line, so larger values will be bad; write a larger type");
  }

  /// Checks the limits of `simulate`, which are numbers as on the line.
  void CheckSimulated(const Point& point, const ReadPlace& place, const Element& field) {
    if (!point.simulate || point.simulate->text || !field.format.is_number()) return;
    if (place.select != ReadPlace::Select::whole) return;
    for (const double number : {point.simulate->low, point.simulate->high}) {
      if (!std::isfinite(number)) continue;
      const auto bytes = EncodeField(field.format, Nearest(field.format, number));
      if (bytes) continue;
      return Tell("has 'simulate' " + ToText(Value(number)) + ", but its field '" + field.name +
                  "' cannot hold this value: " + bytes.error());
    }
  }

  const config::Device& device_;
  const Description& description_;
  const Bound bound_;
  std::size_t point_ = 0;
  std::vector<ConfigRemark> doubts_;
};

}  // namespace

config::RawNumbers NumbersOf(const config::Device& device, const Point& point) {
  using config::RawNumbers;
  const auto description = DescriptionOf(device.options);
  const auto place = ParseRead(point);
  const auto found = description && place ? description->Find(place->call.telegram) : std::nullopt;
  const Element* field = found ? description->telegrams[*found].FindField(place->field) : nullptr;
  if (field == nullptr) return {};
  if (place->select == ReadPlace::Select::equal) return RawNumbers::Bits(1);
  if (place->select == ReadPlace::Select::bits) return RawNumbers::Bits(place->bits);
  return NumbersOf(field->format);
}

std::vector<ConfigRemark> DoubtsOf(const config::Device& device) {
  const auto description = DescriptionOf(device.options);
  return description ? DoubtFinder(device, *description).Run() : std::vector<ConfigRemark>();
}

namespace {

using config::Access;
using config::Point;
using config::Type;

class FaultFinder {
 public:
  FaultFinder(const config::Device& device, const Description& description)
      : device_(device),
        description_(description),
        bound_(BoundOf(ReadSettings(device.options), device.address)) {}

  std::vector<ConfigRemark> Run() {
    for (std::size_t i = 0; i < device_.points.size(); ++i) {
      point_ = i;
      const Point& point = device_.points[i];
      if (point.access != Access::write) CheckRead(point);
      if (point.access != Access::read) CheckWrite(point);
    }
    CheckParameters();
    point_ = kNoPoint;
    for (const Telegram& telegram : description_.telegrams) {
      if (!telegram.identity.empty()) CheckCalled(telegram, {});
    }
    return std::move(faults_);
  }

 private:
  void Tell(std::string text) { faults_.push_back({point_, std::move(text)}); }

  const Telegram* FindTelegram(const Call& call, const char* key) {
    const auto found = description_.Find(call.telegram);
    if (found) return &description_.telegrams[*found];
    std::vector<std::string_view> names;
    for (const Telegram& telegram : description_.telegrams) names.push_back(telegram.name);
    Tell(std::string("has '") + key + ": " + call.telegram + "', which is not a telegram;" +
         DidYouMean(call.telegram, names) + " telegrams: " + Join(names));
    return nullptr;
  }

  void CheckRead(const Point& point) {
    const auto place = ParseRead(point);
    if (!place) return;  // CheckPoint reports this error
    const Telegram* telegram = FindTelegram(place->call, "read");
    if (telegram == nullptr) return;
    if (!telegram->reads && !telegram->listen) {
      return Tell(
          "would be polled by telegram '" + telegram->name +
          "', which may change the device; add 'reads: yes' to the telegram if it only reads");
    }
    if (telegram->listen && !place->call.parameters.empty()) {
      return Tell("gives parameters to '" + telegram->name +
                  "', which has no 'send' and is never sent; remove the parameters");
    }
    const Element* field = telegram->FindField(place->field);
    if (field == nullptr) return UnknownField(*telegram, place->field);
    CheckType(point, *place, *field);
    CheckUnit(point, *telegram, *place, *field);
    CheckCalled(*telegram, place->call);
  }

  void UnknownField(const Telegram& telegram, const std::string& name) {
    std::vector<std::string_view> names;
    for (const Form& form : telegram.receive) {
      for (const Element& element : form.pattern.elements) {
        const bool listed = std::ranges::find(names, element.name) != names.end();
        if (element.is_field() && !element.name.empty() && !listed) names.push_back(element.name);
      }
    }
    Tell("reads '" + name + "', which is not a field of the answer to '" + telegram.name + "';" +
         DidYouMean(name, names) + " fields: " + Join(names));
  }

  void CheckType(const Point& point, const ReadPlace& place, const Element& field) {
    const bool number = field.format.is_number();
    if (place.select == ReadPlace::Select::bits) return CheckBits(place, field);
    if (place.select == ReadPlace::Select::equal && field.format.kind == Format::Kind::byte) {
      const auto byte = EncodeField(field.format, place.equal);
      if (!byte) Tell("compares '" + field.name + "' with '" + place.equal + "': " + byte.error());
    }
    if (place.select != ReadPlace::Select::whole) return;
    if ((point.type == Type::string) == number) {
      Tell("has type " + std::string(config::Name(point.type)) + ", but the field '" + field.name +
           (number ? "' is a number" : "' is a text; write type: string(16)"));
    }
  }

  void CheckUnit(const Point& point, const Telegram& telegram, const ReadPlace& place,
                 const Element& field) {
    if (place.select != ReadPlace::Select::whole || !field.format.is_number()) return;
    Bound bound = bound_;
    for (const auto& [name, text] : place.call.parameters) bound.insert_or_assign(name, text);
    if (std::string wrong = WrongUnit(point, telegram, field, bound); !wrong.empty()) {
      Tell(std::move(wrong));
    }
  }

  void CheckBits(const ReadPlace& place, const Element& field) {
    if (!field.format.is_whole_number()) {
      return Tell("takes bits of '" + field.name +
                  "', which is not a whole number; read the field without [b…]");
    }
    const unsigned last = place.bit + place.bits - 1;
    const auto bits = field.format.bits();
    if (!bits || last < *bits) return;
    Tell("takes bit b" + std::to_string(last) + " of '" + field.name + "', but its last bit is b" +
         std::to_string(*bits - 1) + "; correct the bit");
  }

  void CheckWrite(const Point& point) {
    const auto call = ParseWrite(point);
    if (!call) return;
    const Telegram* telegram = FindTelegram(*call, "write");
    if (telegram == nullptr) return;
    if (!telegram->send)
      return Tell("is written by '" + telegram->name +
                  "', which has no 'send' and is never sent; name a telegram with 'send'");
    const Element* field = telegram->value_field();
    if (telegram->reads) {
      return Tell("is written by '" + telegram->name +
                  "', which only reads; name in 'write' the telegram that changes the device");
    }
    if (field == nullptr && point.type != Type::boolean) {
      Tell("is written by '" + telegram->name + "', which has no field {value}; write type: bool");
    } else if (field != nullptr && (point.type == Type::string) == field->format.is_number()) {
      Tell("has type " + std::string(config::Name(point.type)) +
           ", which does not fit {value} of '" + telegram->name + "'; correct the type");
    }
    if (telegram->receive.empty() && point.access == Access::write) {
      Tell("is written by '" + telegram->name +
           "', which the device does not answer; add 'read' to the point, so that the value is "
           "read back");
    }
    CheckCalled(*telegram, *call);
  }

  void CheckCalled(const Telegram& telegram, const Call& call) {
    Bound own;
    for (const auto& [name, text] : call.parameters) {
      own.emplace(name, text);
      if (name == kAddress || name == kPassword || name == kValue || name == kChecksum) {
        Tell("gives '" + name +
             "' as a parameter, but this name has its own use; choose another name");
      } else if (!IsSent(telegram, name)) {
        Tell("gives '" + name + "' to '" + telegram.name +
             "', which has no such field in 'send'; remove the parameter");
      }
    }
    CheckFilled(telegram, own);
    for (const auto* list : {&telegram.before, &telegram.behind}) {
      for (const std::size_t number : *list) {
        const Telegram& other = description_.telegrams[number];
        CheckFilled(other, own);
        if (other.once) CheckOnce(telegram, other, call);
      }
    }
  }

  /// Checks that a call has no parameter for the telegram `once`, which is sent only once for all
  /// points.
  void CheckOnce(const Telegram& telegram, const Telegram& once, const Call& call) {
    for (const auto& [name, text] : call.parameters) {
      if (!once.send || !once.send->pattern.Has(name)) continue;
      Tell("gives '" + name + "' to '" + once.name + "', which is sent before '" + telegram.name +
           "' only once; remove 'once' from '" + once.name + "'");
    }
  }

  /// True if the telegram, or a telegram that goes before or behind it, has the field.
  bool IsSent(const Telegram& telegram, const std::string& name) const {
    const auto has = [&](const Telegram& one) { return one.send && one.send->pattern.Has(name); };
    const auto other_has = [&](std::size_t other) { return has(description_.telegrams[other]); };
    return has(telegram) || std::ranges::any_of(telegram.before, other_has) ||
           std::ranges::any_of(telegram.behind, other_has);
  }

  void CheckFilled(const Telegram& telegram, const Bound& own) {
    if (!telegram.send) return;
    for (const Element& element : telegram.send->pattern.elements) {
      if (!element.is_field() || element.name.empty()) continue;
      if (element.name == kValue || element.name == kChecksum) continue;
      const Bound& from = own.contains(element.name) ? own : bound_;
      const auto value = from.find(element.name);
      if (value == from.end() || ToText(value->second).empty()) {
        // A profile has no address, and each device gives the missing values, so nothing is
        // reported for a profile.
        if (!device_.address.empty()) Missing(telegram, element.name);
      } else if (const auto field = EncodeField(element.format, value->second); !field) {
        Tell("cannot be sent: {" + element.name + "} of telegram '" + telegram.name + "'" +
             (element.name == kPassword
                  ? " cannot hold this password; correct 'password' at the device"
                  : ": " + field.error()));
      } else if (const std::string text = ToText(value->second); IsTooShort(element, text)) {
        Tell("cannot be sent: {" + element.name + "} of telegram '" + telegram.name + "' has " +
             std::to_string(element.format.width) + " characters, but '" + text + "' has " +
             std::to_string(text.size()) +
             "; write as many characters, or give the field the width " +
             std::to_string(text.size()) +
             (element.name == kAddress ? "; for an address that is a number write {address:0" +
                                             std::to_string(element.format.width) + "d}"
                                       : std::string()));
      }
    }
  }

  /// True if blanks would be added to the text, so that the device would get another text.
  static bool IsTooShort(const Element& element, const std::string& text) {
    return element.format.kind == Format::Kind::text && element.name != kPassword &&
           text.size() < element.format.width;
  }

  void Missing(const Telegram& telegram, const std::string& name) {
    const std::string what =
        "needs a value for {" + name + "} of telegram '" + telegram.name + "': ";
    Tell(what + (name == kPassword  ? "set 'password' at the device"
                 : name == kAddress ? "set 'address' at the device"
                                    : "write parameters: { " + name +
                                          ": … } at the device or in its "
                                          "profile, or " +
                                          telegram.name + "(" + name + "=…) at the point"));
  }

  void CheckParameters() {
    point_ = kNoPoint;
    std::vector<std::string_view> names;
    for (const Telegram& telegram : description_.telegrams) {
      if (!telegram.send) continue;
      for (const Element& element : telegram.send->pattern.elements) {
        const bool own = element.name.empty() || element.name == kAddress ||
                         element.name == kPassword || element.name == kValue ||
                         element.name == kChecksum;
        if (!own && std::ranges::find(names, element.name) == names.end()) {
          names.push_back(element.name);
        }
      }
    }
    for (const auto& [name, text] : device_.options.Pairs(std::string(kParametersOption))) {
      const bool known =
          std::ranges::any_of(description_.telegrams, [&, &name = name](const Telegram& telegram) {
            return (telegram.send && telegram.send->pattern.Has(name)) ||
                   (telegram.listen && telegram.FindField(name) != nullptr);
          });
      if (known) continue;
      Tell("has a parameter '" + name + "', which is not a field of any telegram" +
           (names.empty() ? "" : ";" + DidYouMean(name, names)) +
           (names.empty() ? "" : " fields that are sent: " + Join(names)));
    }
  }

  const config::Device& device_;
  const Description& description_;
  const Bound bound_;
  std::size_t point_ = kNoPoint;
  std::vector<ConfigRemark> faults_;
};

}  // namespace

std::vector<ConfigRemark> FaultsOf(const config::Device& device) {
  const auto description = DescriptionOf(device.options);
  if (!description) {
    return {
        {kNoPoint,
         "has no key 'telegrams'; describe there what the gateway sends and the device answers"}};
  }
  // There are no telegrams if the description has errors, which were reported at their position in
  // the file.
  if (description->telegrams.empty()) return {};
  return FaultFinder(device, *description).Run();
}

}  // namespace baudgate::protocols::telegram
