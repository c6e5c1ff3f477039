// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/faults.h"

#include <algorithm>

#include "gateway/base/spelling.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/points.h"
#include "protocols/telegram/settings.h"
#include "protocols/telegram/units.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Access;
using config::Point;
using config::Type;

/// Reports about one device, point by point.
class FaultFinder {
 public:
  FaultFinder(const config::Device& device, const Description& description)
      : device_(device),
        description_(description),
        bound_(BoundOf(ReadSettings(device.options), device.address)) {}

  std::vector<Doubt> Run() {
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
    Tell(std::string("has '") + key + ": " + call.telegram + "', which is no telegram;" +
         config::DidYouMean(call.telegram, names) + " telegrams: " + config::Join(names));
    return nullptr;
  }

  void CheckRead(const Point& point) {
    const auto place = ParseRead(point);
    if (!place) return;  // its own check says it
    const Telegram* telegram = FindTelegram(place->call, "read");
    if (telegram == nullptr) return;
    if (!telegram->reads && !telegram->listen) {
      return Tell(
          "would be polled by telegram '" + telegram->name +
          "', which may change the device: add 'reads: yes' to the telegram if it does not");
    }
    if (telegram->listen && !place->call.parameters.empty()) {
      return Tell("gives parameters to '" + telegram->name + "', which is never sent");
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
    Tell("reads '" + name + "', which is no field of the answer to '" + telegram.name + "';" +
         config::DidYouMean(name, names) + " its fields: " + config::Join(names));
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
      Tell("has type " + std::string(config::Name(point.type)) + ", and the field '" + field.name +
           (number ? "' is a number" : "' is a text: write type: string(16)"));
    }
  }

  /// A number that comes with its unit keeps this unit at the point.
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
      return Tell("takes bits of '" + field.name + "', which is no whole number");
    }
    const unsigned last = place.bit + place.bits - 1;
    const auto bits = field.format.bits();
    if (!bits || last < *bits) return;
    Tell("takes bit b" + std::to_string(last) + " of '" + field.name + "', whose last one is b" +
         std::to_string(*bits - 1));
  }

  void CheckWrite(const Point& point) {
    const auto call = ParseWrite(point);
    if (!call) return;
    const Telegram* telegram = FindTelegram(*call, "write");
    if (telegram == nullptr) return;
    if (!telegram->send) return Tell("is written by '" + telegram->name + "', which is never sent");
    const Element* field = telegram->value_field();
    if (telegram->reads) {
      return Tell("is written by '" + telegram->name +
                  "', which only reads: 'write' names the telegram that changes the device");
    }
    if (field == nullptr && point.type != Type::boolean) {
      Tell("is written by '" + telegram->name +
           "', which has no field {value}: it needs type bool");
    } else if (field != nullptr && (point.type == Type::string) == field->format.is_number()) {
      Tell("has type " + std::string(config::Name(point.type)) +
           ", which does not fit {value} of '" + telegram->name + "'");
    }
    if (telegram->receive.empty() && point.access == Access::write) {
      Tell("is written by '" + telegram->name +
           "', which nothing answers: give it 'read' as well, so that its value is read back");
    }
    CheckCalled(*telegram, *call);
  }

  /// Checks the telegram itself and those that go with it.
  void CheckCalled(const Telegram& telegram, const Call& call) {
    Bound own;
    for (const auto& [name, text] : call.parameters) {
      own.emplace(name, text);
      if (name == kAddress || name == kPassword || name == kValue || name == kChecksum) {
        Tell("gives '" + name + "' as a parameter, which has a meaning of its own");
      } else if (!IsSent(telegram, name)) {
        Tell("gives '" + name + "' to '" + telegram.name + "', which has no such field");
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

  /// What is sent once for all points cannot say which of them is meant.
  void CheckOnce(const Telegram& telegram, const Telegram& once, const Call& call) {
    for (const auto& [name, text] : call.parameters) {
      if (!once.send || !once.send->pattern.Has(name)) continue;
      Tell("gives '" + name + "' to '" + once.name + "', which goes before '" + telegram.name +
           "' only once: take 'once' out of '" + once.name + "'");
    }
  }

  /// With the telegram, or with one that goes with it.
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
        // A profile leaves it to its devices.
        if (!device_.address.empty()) Missing(telegram, element.name);
      } else if (const auto field = EncodeField(element.format, value->second); !field) {
        // A secret is not repeated.
        Tell("cannot be sent: {" + element.name + "} of telegram '" + telegram.name + "'" +
             (element.name == kPassword ? " does not take this password" : ": " + field.error()));
      } else if (const std::string text = ToText(value->second); IsTooShort(element, text)) {
        Tell("cannot be sent: {" + element.name + "} of telegram '" + telegram.name + "' has " +
             std::to_string(element.format.width) + " characters, and '" + text + "' has " +
             std::to_string(text.size()) + ": write as many, or give the field the width " +
             std::to_string(text.size()) +
             (element.name == kAddress ? "; an address that is a number is written {address:0" +
                                             std::to_string(element.format.width) + "d}"
                                       : std::string()));
      }
    }
  }

  /// Blanks would be put behind it, and the device would be asked for another thing.
  static bool IsTooShort(const Element& element, const std::string& text) {
    return element.format.kind == Format::Kind::text && element.name != kPassword &&
           text.size() < element.format.width;
  }

  void Missing(const Telegram& telegram, const std::string& name) {
    const std::string what =
        "needs a value for {" + name + "} of telegram '" + telegram.name + "': ";
    Tell(what + (name == kPassword  ? "give the device a 'password'"
                 : name == kAddress ? "give the device its 'address'"
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
      Tell("has a parameter '" + name + "', which no telegram has" +
           (names.empty() ? "" : ";" + config::DidYouMean(name, names)) +
           (names.empty() ? "" : " fields that are sent: " + config::Join(names)));
    }
  }

  const config::Device& device_;
  const Description& description_;
  const Bound bound_;
  std::size_t point_ = kNoPoint;
  std::vector<Doubt> faults_;
};

}  // namespace

std::vector<Doubt> FaultsOf(const config::Device& device) {
  const auto description = DescriptionOf(device.options);
  if (!description) {
    return {{kNoPoint, "has no 'telegrams': they say what is sent and what comes back"}};
  }
  // What is wrong with the telegrams was said where they stand.
  if (description->telegrams.empty()) return {};
  return FaultFinder(device, *description).Run();
}

}  // namespace baudgate::protocols::telegram
