// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/doubts.h"

#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Access;
using config::Point;
using config::Type;

/// Its first digit could be lost unseen: nothing stands in front of it.
bool IsUnguarded(const Form& form) {
  const Element& first = form.pattern.elements.front();
  return form.is_unmarked() && first.is_field() && first.format.is_text_number() &&
         !first.is_fixed() && !first.format.sign && !form.size_at;
}

/// Bytes that come unasked and have neither a begin nor a check value: any of them may be first.
bool IsUnsynchronised(const Telegram& telegram, const Form& form) {
  const Element& first = form.pattern.elements.front();
  return telegram.listen && form.is_unmarked() && first.is_field() && !first.format.is_text();
}

/// The largest number that the point may be given, where that is known.
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

/// As its number on the line.
bool Holds(const Point& point, std::uint64_t raw) {
  const Decimal number = Decimal(raw) * point.scale + point.offset;
  if (point.type == Type::boolean) return number == 0 || number == 1;
  if (point.type == Type::uint64) return number.ToUint64().has_value();
  const auto whole = number.ToInt64();
  return whole && config::RangeOf(point).Contains(*whole);
}

/// The field next to elements[index], in front of it or behind it; null: a number, or more than a
/// separator stands between.
const Element* Beside(const Pattern& pattern, std::size_t index, bool behind) {
  const auto at = [&](std::size_t steps) -> const Element* {
    const std::size_t place =
        behind ? index + steps : index - steps;  // wraps in front of the first
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

  std::vector<Doubt> Run() {
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
            "comes with a telegram that begins with a field and has no check value: nothing shows "
            "where it begins, and a lost byte shifts all values; write its fixed bytes and its "
            "{checksum}, if it has any");
      }
      // A jump is read twice.
      if (device_.points[point_].recheck != config::Recheck::off) continue;
      if (!IsUnguarded(form) || form.pattern.elements.front().name != place.field) continue;
      Tell(
          "is the first of its telegram, and nothing shows that its first digit was lost on the "
          "line: if the device always sends as many characters, give the field a width; if it "
          "always sends a sign, write {" +
          place.field + ":+decimal}");
    }
  }

  /// A unit or a state that comes with the number, and that nothing judges.
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
    if (text.name.empty() && says.empty()) return;  // blanks
    const std::string name = text.name.empty() ? "unit" : text.name;
    Tell("comes with '" + says +
         "' beside its number, and nothing judges that: if the device says " +
         "another unit or state there, the value is good all the same; " +
         (text.name.empty() ? "name this field {" + name + ":…} and write" : "write") +
         " codes: { " + name + ": { '" + says + "': good } }, with all that it may say");
  }

  void CheckRange(const Point& point, const ReadPlace& place, const Element& field) {
    if (point.type == Type::float32 || point.type == Type::float64 || point.type == Type::string) {
      return;
    }
    const auto most = MostOf(place, field.format);
    if (!most || Holds(point, *most)) return;
    Tell("has type " + std::string(config::Name(point.type)) + ", which cannot hold all that '" +
         field.name + "' may say, up to " + std::to_string(*most) +
         " on the line: larger ones will be bad");
  }

  /// `simulate` is the number on the line.
  void CheckSimulated(const Point& point, const ReadPlace& place, const Element& field) {
    if (!point.simulate || point.simulate->text || !field.format.is_number()) return;
    if (place.select != ReadPlace::Select::whole) return;
    for (const double number : {point.simulate->low, point.simulate->high}) {
      if (!std::isfinite(number)) continue;
      const auto bytes = EncodeField(field.format, Nearest(field.format, number));
      if (bytes) continue;
      return Tell("has 'simulate' " + ToText(Value(number)) + ", and its field '" + field.name +
                  "' cannot say it: " + bytes.error());
    }
  }

  const config::Device& device_;
  const Description& description_;
  const Bound bound_;
  std::size_t point_ = 0;
  std::vector<Doubt> doubts_;
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

std::vector<Doubt> DoubtsOf(const config::Device& device) {
  const auto description = DescriptionOf(device.options);
  return description ? DoubtFinder(device, *description).Run() : std::vector<Doubt>();
}

}  // namespace baudgate::protocols::telegram
