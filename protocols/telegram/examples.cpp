// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/examples.h"

#include <algorithm>

#include "gateway/base/decimal.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/forms.h"
#include "protocols/telegram/reply.h"
#include "protocols/telegram/units.h"

namespace baudgate::protocols::telegram {
namespace {

using config::MapReader;
using config::Problems;
using config::YamlNode;

std::string NameOf(const Element& element) {
  if (!element.is_field()) return "'" + Printable(element.literal) + "'";
  return element.name.empty() ? "a field without a name" : "{" + element.name + "}";
}

/// How far the bytes fit: "from byte 5 on, at {weight}, it does not fit".
std::string Misfit(const Form& form, View bytes, const Match& match) {
  const auto size = form.pattern.size();
  if (size && bytes.size() > *size) {
    return "it has " + std::to_string(bytes.size()) + " bytes, and the pattern " +
           std::to_string(*size) + ": " + std::to_string(bytes.size() - *size) + " too many";
  }
  if (match.bad_checksum) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < match.parts.size(); ++i) {
      const Element& element = form.pattern.elements[i];
      if (element.is_field() && element.name == kChecksum) break;
      at += match.parts[i].size();
    }
    const auto sum = form.checksum.Of(bytes.first(std::min(at, bytes.size())));
    if (!sum) return "it is too short for its checksum";
    const auto field =
        EncodeField(form.pattern.Find(kChecksum)->format, static_cast<std::int64_t>(*sum));
    const bool binary = form.pattern.Find(kChecksum)->format.is_binary();
    return "its checksum is wrong; by '" + std::string(form.checksum.kind->name) + "' it is " +
           (!field   ? std::to_string(*sum)
            : binary ? "hex " + ToHex(*field)
                     : "'" + Printable(*field) + "'");
  }
  std::size_t at = 0;
  for (const View part : match.parts) at += part.size();
  if (match.parts.size() == form.pattern.elements.size()) {
    return "it goes on behind byte " + std::to_string(at) + ", where the pattern ends";
  }
  return "it does not fit from byte " + std::to_string(at + 1) + " on, at " +
         NameOf(form.pattern.elements[match.parts.size()]);
}

class ExampleCheck {
 public:
  ExampleCheck(const YamlNode& node, const Telegram& telegram, std::size_t most, Problems& problems)
      : telegram_(telegram),
        most_(most),
        map_(node, "example of '" + telegram.name + "'", problems) {}

  std::optional<Example> Run() {
    Example example;
    const bool sent = !telegram_.send || CheckSent(example);
    const bool received = telegram_.receive.empty() || CheckReceived(example);
    if (telegram_.receive.empty() && map_.Has("receive")) {
      Error("receive", "the telegram has no 'receive', so nothing comes back");
    }
    if (!telegram_.send && map_.Has("send")) Error("send", "the telegram has no 'send'");
    // What else it says cannot be judged.
    if (!sent || !received) map_.AllowAll();
    map_.Finish();
    if (!sent || !received) return std::nullopt;
    return example;
  }

 private:
  void Error(std::string_view key, const std::string& why) {
    map_.problems().Error(map_.MarkOf(key), map_.what() + ": " + why);
  }

  std::optional<Bytes> BytesOf(const char* key) {
    const auto node = map_.Need(key, "'S\\r\\n'");
    auto bytes = node ? ReadFixed(*node, key, map_.problems()) : std::nullopt;
    if (bytes && bytes->size() > most_) {
      Error(key, "is longer than " + std::to_string(most_) + " bytes");
      return std::nullopt;
    }
    return bytes;
  }

  /// What to write in place of bytes that are written as in C.
  std::string HexHint(const char* key) {
    const auto text = map_.Text(key);
    return text && text->starts_with("0x") ? "; bytes in hex are written 'hex 1B 05'" : "";
  }

  bool CheckSent(Example& example) {
    auto bytes = BytesOf("send");
    if (!bytes) return false;
    const Match match = MatchAll(*telegram_.send, *bytes, {});
    if (match.kind != Match::Kind::whole) {
      Error("send", Misfit(*telegram_.send, *bytes, match) + HexHint("send"));
      return false;
    }
    known_ = ValuesOf(*telegram_.send, match);
    for (const auto& [name, value] : known_) {
      if (HasValue(value)) continue;
      Error("send", "what stands for {" + name + "} is no number");
      return false;
    }
    const auto built = Build(*telegram_.send, known_);
    if (!built || *built != *bytes) {
      Error("send", built ? "the pattern makes '" + Printable(*built) + "' of these values"
                          : built.error());
      return false;
    }
    example.send = std::move(*bytes);
    example.sent = known_;
    return true;
  }

  bool CheckReceived(Example& example) {
    auto bytes = BytesOf("receive");
    if (!bytes) return false;
    const Reply reply = DecodeReply(telegram_, *bytes, known_);
    if (reply.outcome == Outcome::unexpected) {
      Error("receive", WhyNot(*bytes) + HexHint("receive"));
      return false;
    }
    if (reply.outcome != Outcome::ok) {
      Error("receive", "is no good answer: " + reply.reason);
      return false;
    }
    bool right = true;
    for (const Form& form : telegram_.receive) {
      for (const Element& element : form.pattern.elements) {
        const bool says = element.is_field() && !element.name.empty() && element.name != kChecksum;
        if (!says) continue;
        const auto node = map_.Get(element.name);
        if (node) right = CheckField(element.name, *node, reply) && right;
      }
    }
    example.receive = std::move(*bytes);
    for (const auto& [name, field] : reply.fields) example.values[name] = field.decoded.value;
    return right;
  }

  std::string WhyNot(View bytes) const {
    // If several answers are possible, the reason is that of the one that fits furthest.
    const Form* best = nullptr;
    Match furthest;
    for (const Form& form : telegram_.receive) {
      Match match = MatchAll(form, bytes, known_);
      if (best != nullptr && match.parts.size() <= furthest.parts.size()) continue;
      best = &form;
      furthest = std::move(match);
    }
    if (furthest.kind == Match::Kind::whole) {
      return "it repeats something else than what was sent, or the address of another device";
    }
    return Misfit(*best, bytes, furthest);
  }

  bool CheckField(const std::string& name, const YamlNode& node, const Reply& reply) {
    const auto wanted = config::ReadText(node, name, map_.problems());
    if (!wanted) return false;
    const auto found = reply.fields.find(name);
    if (found == reply.fields.end()) {
      Error(name, "this answer has no field '" + name + "'");
      return false;
    }
    const SaidField& field = found->second;
    const Quality quality =
        field.is_status ? field.decoded.quality : std::min(field.decoded.quality, reply.quality);
    const auto meaning = std::ranges::find(Meanings(), *wanted, &Meaning::word);
    const bool by_word = meaning != Meanings().end() && meaning->quality == quality;
    const bool by_value = IsGood(field.decoded.quality) && !IsBad(quality) &&
                          SameValue(Value(*wanted), field.decoded.value);
    if (by_word || by_value) return true;
    Error(name, "the answer says " +
                    (IsGood(quality) ? ToText(field.decoded.value) : baudgate::Name(quality)) +
                    ", not " + *wanted);
    return false;
  }

  const Telegram& telegram_;
  const std::size_t most_;
  MapReader map_;
  Bound known_;
};

/// A number is in the unit that the first example says. If another one may come, `codes` say so.
void TakeUnits(const Example& example, Telegram& telegram) {
  const auto good = std::ranges::find(Meanings(), "good", &Meaning::word);
  for (const auto& [name, value] : example.values) {
    const bool known = telegram.codes.contains(name) || example.sent.contains(name);
    const auto* text = std::get_if<std::string>(&value);
    if (IsUnit(name) && !known && text != nullptr) telegram.codes[name] = {{*text, &*good}};
  }
}

/// Blanks behind a number may have taken the place of its digits ("123 " of "1234"), unless the
/// device writes numbers at the left of their fields: then an example shows it.
void TakeSides(Telegram& telegram) {
  for (Form& form : telegram.receive) {
    for (std::size_t i = 0; i < form.pattern.elements.size(); ++i) {
      Element& element = form.pattern.elements[i];
      if (!element.is_field() || !element.format.is_text_number()) continue;
      element.format.left = std::ranges::any_of(telegram.examples, [&](const Example& example) {
        const Match match = MatchAll(form, example.receive, {});
        if (match.kind != Match::Kind::whole || match.parts[i].empty()) return false;
        return match.parts[i].front() != ' ' && match.parts[i].back() == ' ';
      });
    }
  }
}

}  // namespace

void CheckExamples(const std::vector<YamlNode>& examples, Description& description,
                   std::size_t index, Problems& problems) {
  Telegram& telegram = description.telegrams[index];
  for (const YamlNode& node : examples) {
    if (node.kind() != YamlNode::Kind::map) {
      problems.Error(node.mark(), "example: expected a map: { send: …, receive: …, weight: 1.0 }");
      continue;
    }
    auto example = ExampleCheck(node, telegram, description.most, problems).Run();
    if (!example) continue;
    TakeUnits(*example, telegram);
    telegram.examples.push_back(std::move(*example));
    const Bytes& sent = telegram.examples.back().send;
    const auto meant = sent.empty() ? std::nullopt : description.Recognise(sent);
    if (meant && meant->telegram != index) {
      problems.Error(node.mark(), "telegram '" + telegram.name + "' looks like '" +
                                      description.telegrams[meant->telegram].name +
                                      "': nobody could tell which of them was sent");
    }
  }
  TakeSides(telegram);
}

}  // namespace baudgate::protocols::telegram
