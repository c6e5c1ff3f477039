// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/compile.h"

#include <algorithm>
#include <array>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "protocols/conversation.h"
#include "protocols/telegram/faults.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/forms.h"
#include "protocols/telegram/points.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Assign;
using config::Entry;
using config::MapReader;
using config::Problems;
using config::YamlNode;

constexpr std::string_view kAll = "all";
constexpr std::size_t kMostTelegrams = 200;
constexpr std::size_t kMostCodes = 200;
constexpr std::size_t kLongestTelegram = 4096;

/// The parts of a telegram that can be checked only when all telegrams are read.
struct RawTelegram {
  std::vector<YamlNode> before;
  std::vector<YamlNode> behind;
  std::vector<YamlNode> examples;
};

bool IsTelegramName(std::string_view name) {
  return !name.empty() && std::ranges::all_of(name, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
  });
}

const Meaning* ReadMeaning(const YamlNode& node, Problems& problems) {
  std::vector<std::string_view> words;
  for (const Meaning& meaning : Meanings()) words.push_back(meaning.word);
  const auto index = config::ReadChoice(node, "codes", words, problems);
  return index ? &Meanings()[*index] : nullptr;
}

std::vector<std::string> FieldNames(const Telegram& telegram) {
  std::vector<std::string> names;
  for (const Form& form : telegram.receive) {
    for (const Element& element : form.pattern.elements) {
      if (element.is_field() && !element.name.empty() && element.name != kChecksum) {
        names.push_back(element.name);
      }
    }
  }
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::string HintOf(std::string_view name, const std::vector<std::string>& known) {
  const std::vector<std::string_view> views(known.begin(), known.end());
  return DidYouMean(name, views) +
         " fields: " + (views.empty() ? std::string("none") : Join(views));
}

/// Returns the code of a byte in its usual form: "0x1A" for "0x1a" and for the escape "\\x1A".
/// Empty: `key` is not a byte.
std::optional<std::string> ByteCode(std::string_view key) {
  if (!key.starts_with("0x") && !key.starts_with("\\x")) return std::nullopt;
  const auto byte = ParseHex(key.substr(2));
  return byte && byte->size() == 1 ? std::optional(ByteText(*byte)) : std::nullopt;
}

/// Returns the codes in the form in which FindCode compares them; for a byte this is "0x1A". Codes
/// that the field `name` cannot contain are reported as errors.
Codes CodesOf(const Telegram& telegram, const std::string& name, const Codes& codes,
              const config::Mark& mark, Problems& problems) {
  const Format& format = telegram.FindField(name)->format;
  for (const auto& [key, meaning] : codes) {
    const Status status = CheckCode(format, key);
    if (!status) {
      problems.Error(mark, "codes: " + Quoted(key) + " of '" + name + "' " + status.error());
    }
  }
  if (format.kind != Format::Kind::byte) return codes;
  Codes of_bytes;
  for (const auto& [key, meaning] : codes) {
    if (const auto code = ByteCode(key)) {
      of_bytes[*code] = meaning;
    } else {
      problems.Error(mark, "codes: " + Quoted(key) + " is not a byte, but '" + name +
                               "' is; write 0x1A, with two hex digits");
    }
  }
  return of_bytes;
}

/// Reads the codes of fields, such as `codes: { state: { 'I': busy }, 'input_*': { '+9999.9': over
/// } }`.
void ReadCodes(MapReader& map, Telegram& telegram) {
  const auto node = map.Get("codes");
  if (!node) return;
  Problems& problems = map.problems();
  const std::vector<std::string> names = FieldNames(telegram);
  // `receive` is invalid, so the fields are unknown; the error was reported.
  if (telegram.receive.empty() && map.Has("receive")) return;
  for (const Entry& field : config::ReadEntries(*node, "codes", problems)) {
    Codes codes;
    for (const Entry& code :
         config::ReadEntries(field.value, "codes of " + Quoted(field.key), problems)) {
      if (codes.size() == kMostCodes) {
        problems.Error(code.value.mark(),
                       "codes: too many codes; at most " + std::to_string(kMostCodes));
        break;
      }
      if (const Meaning* meaning = ReadMeaning(code.value, problems)) codes[code.key] = meaning;
    }
    bool used = false;
    for (const std::string& name : names) {
      if (!MatchesPattern(field.key, name)) continue;
      used = true;
      telegram.codes[name].merge(CodesOf(telegram, name, codes, field.value.mark(), problems));
    }
    if (!used) {
      problems.Error(field.value.mark(), "codes: " + Quoted(field.key) +
                                             " is not a field of the answer ('receive');" +
                                             HintOf(field.key, names));
    }
  }
}

std::vector<YamlNode> NodesOf(MapReader& map, const char* key, std::size_t most) {
  const auto node = map.Get(key);
  if (!node) return {};
  if (node->kind() != YamlNode::Kind::list) return {*node};
  return config::ReadList(*node, key, most, map.problems());
}

void CheckTelegram(const MapReader& map, const Telegram& telegram) {
  Problems& problems = map.problems();
  const auto error = [&](std::string_view key, const std::string& why) {
    problems.Error(map.MarkOf(key), std::string(key) + ": " + why);
  };
  if (telegram.listen) {
    if (map.Has("send"))
      error("listen",
            "a telegram that the device sends by itself cannot have 'send'; remove one of the two "
            "keys");
    if (telegram.receive.empty() && !map.Has("receive")) {
      error("listen",
            "a telegram that the device sends by itself needs 'receive'; describe its bytes there");
    }
    if (map.Has("refused"))
      error("refused",
            "a telegram with 'listen' sends no request that could be refused; remove the key");
    return;
  }
  if (!map.Has("send")) {
    problems.Error(map.mark(),
                   map.what() + " needs 'send', or 'listen: yes' if the device sends it by itself");
    return;
  }
  if (telegram.value_field() != nullptr && telegram.reads) {
    error("reads", "a telegram with {value} writes to the device; remove 'reads: yes'");
  }
  if (telegram.once && !telegram.reads)
    error("once",
          "needs 'reads: yes', because 'once' is for telegrams that are sent before reading "
          "telegrams");
}

class Compiler {
 public:
  Compiler(const YamlNode& node, Problems& problems)
      : problems_(problems), description_(std::make_shared<Description>(TextOf(node))) {}

  std::shared_ptr<const config::Description> Run(const YamlNode& node) {
    const std::vector<Entry> entries = config::ReadEntries(node, "telegrams", problems_);
    for (const Entry& entry : entries) {
      if (IsMeantAsAll(entry)) {
        problems_.Error(entry.value.mark(),
                        "telegrams: " + Quoted(entry.key) +
                            " is no telegram, because it has neither 'send' nor 'receive'; write "
                            "'all' for settings of all telegrams");
      }
      if (entry.key == kAll || IsMeantAsAll(entry)) ReadAll(entry.value);
    }
    if (entries.size() > kMostTelegrams)
      problems_.Error(node.mark(),
                      "telegrams: too many telegrams; at most " + std::to_string(kMostTelegrams));
    for (const Entry& entry : entries) {
      if (entry.key != kAll && !IsMeantAsAll(entry) && raws_.size() < kMostTelegrams) Read(entry);
    }
    if (raws_.empty() && !failed()) {
      problems_.Error(
          node.mark(),
          "telegrams: the map has no telegram; write for example weight: { send: 'S\\r\\n', … }");
    }
    for (std::size_t i = 0; i < raws_.size(); ++i) Relate(i);
    if (!failed()) {
      for (std::size_t i = 0; i < raws_.size(); ++i) {
        CheckExamples(raws_[i].examples, *description_, i, problems_);
      }
    }
    if (failed()) description_->telegrams.clear();
    return description_;
  }

 private:
  /// Returns the YAML as text; two descriptions are equal if their texts are equal.
  static std::string TextOf(const YamlNode& node) {
    YAML::Emitter out;
    out << node.yaml();
    return out.good() ? out.c_str() : std::string();
  }

  /// True if the entry looks like a misspelt "all", such as "al: { ends: '\r\n' }".
  static bool IsMeantAsAll(const Entry& entry) {
    constexpr std::array<std::string_view, 1> kKnown = {kAll};
    if (entry.key == kAll || DidYouMean(entry.key, kKnown).empty()) return false;
    if (entry.value.kind() != YamlNode::Kind::map) return false;
    Problems unused;
    const MapReader map(entry.value, "", unused);
    return !map.Has("send") && !map.Has("receive") && !map.Has("listen") && !map.Has("example");
  }

  bool failed() const { return problems_.has_error(); }

  void ReadAll(const YamlNode& node) {
    MapReader map(node, "telegrams: all", problems_);
    all_ = ReadFraming(map, {});
    all_.refused = NodesOf(map, "refused", 20);
    Assign(description_->most, map.Integer<std::size_t>("longest", 1, kLongestTelegram));
    map.Finish();
  }

  void Read(const Entry& entry) {
    MapReader map(entry.value, "telegram '" + entry.key + "'", problems_);
    Telegram& telegram = description_->telegrams.emplace_back();
    RawTelegram& raw = raws_.emplace_back();
    telegram.name = entry.key;
    telegram.mark = entry.value.mark();
    if (!IsTelegramName(entry.key)) {
      problems_.Error(entry.value.mark(),
                      "telegram " + Quoted(entry.key) +
                          " is not a valid name; use small letters, digits and _");
    }
    if (entry.value.kind() != YamlNode::Kind::map) return;
    const Framing framing = ReadFraming(map, all_);
    telegram.idle = framing.idle;
    telegram.strict = framing.strict;
    Assign(telegram.listen, map.Flag("listen"));
    Assign(telegram.reads, map.Flag("reads"));
    Assign(telegram.repeat, map.Flag("repeat"));
    Assign(telegram.once, map.Flag("once"));
    Assign(telegram.pause, map.Time("pause", 1ms, std::chrono::seconds(10)));
    Assign(telegram.wait, map.Time("wait", 1ms, std::chrono::minutes(1)));
    ReadForms(map, framing, description_->most, telegram);
    ReadCodes(map, telegram);
    raw.before = NodesOf(map, "before", kMostSteps);
    raw.behind = NodesOf(map, "behind", kMostSteps);
    ReadIdentity(map, telegram);
    raw.examples = NodesOf(map, "example", 20);
    if (!map.Has("example")) {
      problems_.Error(entry.value.mark(),
                      map.what() +
                          " needs 'example' with real bytes and their values, as in example: { "
                          "send: 'S\\r\\n', receive: 'S S  1.0 g\\r\\n', weight: 1.0 }");
    }
    map.Finish();
    CheckTelegram(map, telegram);
  }

  void ReadIdentity(MapReader& map, Telegram& telegram) {
    const auto field = map.Text("identity");
    if (!field) return;
    telegram.identity = *field;
    if (telegram.FindField(*field) == nullptr) {
      problems_.Error(map.MarkOf("identity"), "identity: " + Quoted(*field) +
                                                  " is not a field of the answer ('receive');" +
                                                  HintOf(*field, FieldNames(telegram)));
    } else if (!telegram.reads) {
      problems_.Error(
          map.MarkOf("identity"),
          "identity: needs 'reads: yes', because the gateway asks for the name with this telegram");
    }
  }

  void Relate(std::size_t index) {
    Telegram& telegram = description_->telegrams[index];
    const auto read = [&](const std::vector<YamlNode>& nodes, const char* key,
                          std::vector<std::size_t>& numbers) {
      for (const YamlNode& node : nodes) {
        const auto name = config::ReadText(node, key, problems_);
        if (name) ReadRelation(node, key, *name, index, numbers);
      }
    };
    read(raws_[index].before, "before", telegram.before);
    read(raws_[index].behind, "behind", telegram.behind);
    // The exchange can have one telegram more, the question for the device's name.
    constexpr std::size_t kMost = kMostSteps - 1;
    if (telegram.before.size() + telegram.behind.size() + 1 > kMost) {
      problems_.Error(
          telegram.mark,
          "telegram '" + telegram.name + "': at most " + std::to_string(kMost) +
              " telegrams are possible in one exchange; remove some from 'before' or 'behind'");
    }
  }

  void ReadRelation(const YamlNode& node, const std::string& key, const std::string& name,
                    std::size_t index, std::vector<std::size_t>& numbers) {
    const auto found = description_->Find(name);
    const auto error = [&](const std::string& why) {
      problems_.Error(node.mark(), key + ": " + why);
    };
    if (!found) {
      std::vector<std::string_view> names;
      for (const Telegram& one : description_->telegrams) names.push_back(one.name);
      return error(Quoted(name) + " is not a telegram of this map;" + DidYouMean(name, names) +
                   " telegrams: " + Join(names));
    }
    const Telegram& other = description_->telegrams[*found];
    if (*found == index)
      return error("a telegram cannot be sent before or after itself; name another telegram");
    if (!other.send)
      return error("'" + name + "' has 'listen: yes', so it is never sent; name another telegram");
    if (other.value_field() != nullptr) {
      return error("'" + name +
                   "' needs a value to write, which 'before' and 'behind' cannot give; name "
                   "another telegram");
    }
    if (description_->telegrams[index].reads && !other.reads) {
      return error("'" + name +
                   "' would be sent with every poll, although it may change the device; add "
                   "'reads: yes' to it if it only reads");
    }
    numbers.push_back(*found);
  }

  Problems& problems_;
  std::shared_ptr<Description> description_;
  Framing all_;
  std::vector<RawTelegram> raws_;
};

}  // namespace

std::shared_ptr<const config::Description> Compile(const YamlNode& telegrams, Problems& problems) {
  // The errors are collected apart, because errors elsewhere in the file must not count as errors
  // of the description.
  Problems own;
  auto description = Compiler(telegrams, own).Run(telegrams);
  for (const config::Problem& problem : own.Sorted()) problems.Error(problem.mark, problem.message);
  return description;
}

namespace {

using config::MapReader;
using config::Problems;
using config::YamlNode;

std::string NameOf(const Element& element) {
  if (!element.is_field()) return "'" + Printable(element.literal) + "'";
  return element.name.empty() ? "a field without a name" : "{" + element.name + "}";
}

/// Returns why the bytes do not fit the form: "it does not fit from byte 5 on, at {weight}".
std::string Misfit(const Form& form, View bytes, const Match& match) {
  const auto size = form.pattern.size();
  if (size && bytes.size() > *size) {
    return "the example has " + std::to_string(bytes.size()) + " bytes, but the pattern has " +
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
    if (!sum) return "the example is too short for its checksum; add the missing bytes";
    const auto field =
        EncodeField(form.pattern.Find(kChecksum)->format, static_cast<std::int64_t>(*sum));
    const bool binary = form.pattern.Find(kChecksum)->format.is_binary();
    return "the checksum is wrong; by '" + std::string(form.checksum.kind->name) + "' it must be " +
           (!field   ? std::to_string(*sum)
            : binary ? "hex " + ToHex(*field)
                     : "'" + Printable(*field) + "'");
  }
  std::size_t at = 0;
  for (const View part : match.parts) at += part.size();
  if (match.parts.size() == form.pattern.elements.size()) {
    return "the example continues after byte " + std::to_string(at) +
           ", but the pattern ends there; correct the example or the pattern";
  }
  return "the example does not fit from byte " + std::to_string(at + 1) + " on, at " +
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
      Error("receive",
            "the telegram has no 'receive', so the example cannot have one; remove the key");
    }
    if (!telegram_.send && map_.Has("send"))
      Error("send", "the telegram has no 'send', so the example cannot have one; remove the key");
    // Without valid bytes, the other keys of the example cannot be checked.
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
      Error(key, "is longer than " + std::to_string(most_) + " bytes; raise 'longest' in 'all'");
      return std::nullopt;
    }
    return bytes;
  }

  /// Returns a hint for the error message if the bytes are written as in C ("0x1B"); else an empty
  /// text.
  std::string HexHint(const char* key) {
    const auto text = map_.Text(key);
    return text && text->starts_with("0x") ? "; write bytes in hex as 'hex 1B 05'" : "";
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
      Error("send", "the value for {" + name + "} is not a number");
      return false;
    }
    const auto built = Build(*telegram_.send, known_);
    if (!built || *built != *bytes) {
      Error("send",
            built ? "the pattern makes '" + Printable(*built) +
                        "' from these values, not these bytes; correct the example or the pattern"
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
      Error("receive", "is not a good answer: " + reply.reason);
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
    // If several answers are possible, the reason is given for the form that fits the most bytes.
    const Form* best = nullptr;
    Match furthest;
    for (const Form& form : telegram_.receive) {
      Match match = MatchAll(form, bytes, known_);
      if (best != nullptr && match.parts.size() <= furthest.parts.size()) continue;
      best = &form;
      furthest = std::move(match);
    }
    if (furthest.kind == Match::Kind::whole) {
      return "the answer repeats other values than 'send' has, or has the address of another "
             "device";
    }
    return Misfit(*best, bytes, furthest);
  }

  bool CheckField(const std::string& name, const YamlNode& node, const Reply& reply) {
    const auto wanted = config::ReadText(node, name, map_.problems());
    if (!wanted) return false;
    const auto found = reply.fields.find(name);
    if (found == reply.fields.end()) {
      Error(name, "the pattern of this answer has no field '" + name + "'");
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
    Error(name, "the answer contains " +
                    (IsGood(quality) ? ToText(field.decoded.value) : baudgate::Name(quality)) +
                    ", not " + *wanted);
    return false;
  }

  const Telegram& telegram_;
  const std::size_t most_;
  MapReader map_;
  Bound known_;
};

/// Sets the codes of unit fields: the unit in the first example is the only good code. Does not
/// change a field for which `codes` lists texts, or whose unit is sent to the device.
void TakeUnits(const Example& example, Telegram& telegram) {
  const auto good = std::ranges::find(Meanings(), "good", &Meaning::word);
  for (const auto& [name, value] : example.values) {
    const bool known = telegram.codes.contains(name) || example.sent.contains(name);
    const auto* text = std::get_if<std::string>(&value);
    if (IsUnit(name) && !known && text != nullptr) telegram.codes[name] = {{*text, &*good}};
  }
}

/// Sets Format::left of number fields: whether a number can be at the left of its field, with
/// blanks behind it. These blanks may have replaced digits ("123 " for "1234"), so they are
/// accepted only if an example shows them.
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
      problems.Error(
          node.mark(),
          "telegram '" + telegram.name + "' looks like '" +
              description.telegrams[meant->telegram].name +
              "', so the gateway cannot tell which of the two was sent; give them different bytes");
    }
  }
  TakeSides(telegram);
}

}  // namespace baudgate::protocols::telegram
