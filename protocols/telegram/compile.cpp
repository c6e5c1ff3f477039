// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/compile.h"

#include <algorithm>
#include <array>
#include <map>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"
#include "protocols/conversation.h"
#include "protocols/telegram/examples.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/forms.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Assign;
using config::Entry;
using config::MapReader;
using config::Problems;
using config::Quoted;
using config::YamlNode;

constexpr std::string_view kAll = "all";
constexpr std::size_t kMostTelegrams = 200;
constexpr std::size_t kMostCodes = 200;
constexpr std::size_t kLongestTelegram = 4096;

/// One telegram as it was read, with what can be judged only when all are known.
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
  return config::DidYouMean(name, views) +
         " its fields: " + (views.empty() ? std::string("none") : config::Join(views));
}

/// "0x1A" of "0x1a" and of the escape "\\x1A".
std::optional<std::string> ByteCode(std::string_view key) {
  if (!key.starts_with("0x") && !key.starts_with("\\x")) return std::nullopt;
  const auto byte = ParseHex(key.substr(2));
  return byte && byte->size() == 1 ? std::optional(ByteText(*byte)) : std::nullopt;
}

/// The codes as the field `name` writes them.
Codes CodesOf(const Telegram& telegram, const std::string& name, const Codes& codes,
              const config::Mark& mark, Problems& problems) {
  if (telegram.FindField(name)->format.kind != Format::Kind::byte) return codes;
  Codes of_bytes;
  for (const auto& [key, meaning] : codes) {
    if (const auto code = ByteCode(key)) {
      of_bytes[*code] = meaning;
    } else {
      problems.Error(mark, "codes: " + Quoted(key) + " is no byte; '" + name +
                               "' is one: write 0x1A, with two hex digits");
    }
  }
  return of_bytes;
}

/// `codes: { state: { 'I': busy }, 'input_*': { '+9999.9': over } }`
void ReadCodes(MapReader& map, Telegram& telegram) {
  const auto node = map.Get("codes");
  if (!node) return;
  Problems& problems = map.problems();
  const std::vector<std::string> names = FieldNames(telegram);
  if (telegram.receive.empty() && map.Has("receive")) return;  // it could not be read
  for (const Entry& field : config::ReadEntries(*node, "codes", problems)) {
    Codes codes;
    for (const Entry& code :
         config::ReadEntries(field.value, "codes of " + Quoted(field.key), problems)) {
      if (codes.size() == kMostCodes) {
        problems.Error(code.value.mark(), "codes: too many");
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
      problems.Error(
          field.value.mark(),
          "codes: " + Quoted(field.key) + " is no field of the answer;" + HintOf(field.key, names));
    }
  }
}

std::vector<YamlNode> NodesOf(MapReader& map, const char* key, std::size_t most) {
  const auto node = map.Get(key);
  if (!node) return {};
  if (node->kind() != YamlNode::Kind::list) return {*node};
  return config::ReadList(*node, key, most, map.problems());
}

/// What contradicts itself in one telegram.
void CheckTelegram(const MapReader& map, const Telegram& telegram) {
  Problems& problems = map.problems();
  const auto error = [&](std::string_view key, const std::string& why) {
    problems.Error(map.MarkOf(key), std::string(key) + ": " + why);
  };
  if (telegram.listen) {
    if (map.Has("send")) error("listen", "a telegram that comes unasked has no 'send'");
    if (telegram.receive.empty() && !map.Has("receive")) {
      error("listen", "say in 'receive' what comes");
    }
    if (map.Has("refused")) error("refused", "nothing is asked, so nothing is refused");
    return;
  }
  if (!map.Has("send")) {
    problems.Error(map.mark(), map.what() + " needs 'send', or 'listen: yes' if it comes unasked");
    return;
  }
  if (telegram.value_field() != nullptr && telegram.reads) {
    error("reads", "a telegram with {value} writes it");
  }
  if (telegram.once && !telegram.reads) error("once", "only what goes before others is sent once");
}

class Compiler {
 public:
  Compiler(const YamlNode& node, Problems& problems)
      : problems_(problems), description_(std::make_shared<Description>(TextOf(node))) {}

  std::shared_ptr<const config::Description> Run(const YamlNode& node) {
    const std::vector<Entry> entries = config::ReadEntries(node, "telegrams", problems_);
    for (const Entry& entry : entries) {
      if (IsMeantAsAll(entry)) {
        problems_.Error(entry.value.mark(), "telegrams: " + Quoted(entry.key) +
                                                " sends and awaits nothing; did you mean 'all'?");
      }
      if (entry.key == kAll || IsMeantAsAll(entry)) ReadAll(entry.value);
    }
    if (entries.size() > kMostTelegrams) problems_.Error(node.mark(), "telegrams: too many");
    for (const Entry& entry : entries) {
      if (entry.key != kAll && !IsMeantAsAll(entry) && raws_.size() < kMostTelegrams) Read(entry);
    }
    if (raws_.empty() && !failed()) {
      problems_.Error(node.mark(),
                      "telegrams: there is none; write for example weight: { send: 'S\\r\\n', … }");
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
  /// As it was written: two descriptions are the same where this is.
  static std::string TextOf(const YamlNode& node) {
    YAML::Emitter out;
    out << node.yaml();
    return out.good() ? out.c_str() : std::string();
  }

  /// "al: { ends: '\r\n' }"
  static bool IsMeantAsAll(const Entry& entry) {
    constexpr std::array<std::string_view, 1> kKnown = {kAll};
    if (entry.key == kAll || config::DidYouMean(entry.key, kKnown).empty()) return false;
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
                      "telegram " + Quoted(entry.key) + ": a name has small letters, digits and _");
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
                          " needs 'example': real bytes and what they mean, as in example: "
                          "{ send: 'S\\r\\n', receive: 'S S  1.0 g\\r\\n', weight: 1.0 }");
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
                                                  " is no field of the answer;" +
                                                  HintOf(*field, FieldNames(telegram)));
    } else if (!telegram.reads) {
      problems_.Error(map.MarkOf("identity"), "identity: needs 'reads: yes', as it is asked for");
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
    // The question who the device is may go before.
    constexpr std::size_t kMost = kMostSteps - 1;
    if (telegram.before.size() + telegram.behind.size() + 1 > kMost) {
      problems_.Error(telegram.mark, "telegram '" + telegram.name + "': at most " +
                                         std::to_string(kMost) + " telegrams make an exchange");
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
      return error(Quoted(name) + " is no telegram;" + config::DidYouMean(name, names) +
                   " telegrams: " + config::Join(names));
    }
    const Telegram& other = description_->telegrams[*found];
    if (*found == index) return error("a telegram cannot stand beside itself");
    if (!other.send) return error("'" + name + "' comes unasked, and is never sent");
    if (other.value_field() != nullptr) {
      return error("'" + name + "' writes a value, and no value is known here");
    }
    if (description_->telegrams[index].reads && !other.reads) {
      return error("'" + name +
                   "' would be sent with every poll: it needs 'reads: yes' if it changes "
                   "nothing in the device");
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
  // Errors elsewhere in the file are none of the description's.
  Problems own;
  auto description = Compiler(telegrams, own).Run(telegrams);
  for (const config::Problem& problem : own.Sorted()) problems.Error(problem.mark, problem.message);
  return description;
}

}  // namespace baudgate::protocols::telegram
