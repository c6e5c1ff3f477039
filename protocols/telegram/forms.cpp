// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/forms.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {
namespace {

using config::Assign;
using config::MapReader;
using config::Problems;
using config::YamlNode;

constexpr std::size_t kMostForms = 20;
constexpr std::int64_t kMostSkipped = 255;

/// A field whose position is given by a map, not by a pattern: { at: 4, format: uint16_be }.
struct PlacedField {
  Element element;
  std::size_t at = 0;
  config::Mark mark;
};

std::optional<Pattern> ReadPattern(const YamlNode& node, const std::string& what,
                                   Problems& problems) {
  const auto text = config::ReadText(node, what, problems);
  if (!text) return std::nullopt;
  ParsedPattern parsed = ParsePattern(*text);
  if (parsed.pattern) return std::move(parsed.pattern);
  problems.Error(PlaceIn(node, parsed.error->at), what + ": " + parsed.error->message);
  return std::nullopt;
}

void ReadChecksumKind(const YamlNode& node, Problems& problems, Framing& framing) {
  std::vector<std::string_view> names = {"none"};
  for (const ChecksumKind& kind : ChecksumKinds()) names.push_back(kind.name);
  const auto index = config::ReadChoice(node, "checksum", names, problems);
  framing.unknown_checksum = !index;
  if (index && *index > 0) framing.checksum.kind = &ChecksumKinds()[*index - 1];
}

void ReadChecksum(const YamlNode& node, Problems& problems, Framing& framing) {
  framing.checksum = {};
  framing.answers_have_it = true;
  if (node.kind() != YamlNode::Kind::map) return ReadChecksumKind(node, problems, framing);
  MapReader map(node, "checksum", problems);
  if (const auto kind = map.Need("kind", "xor8")) ReadChecksumKind(*kind, problems, framing);
  Assign(framing.checksum.skip, map.Integer<std::size_t>("skip", 0, kMostSkipped));
  Assign(framing.checksum.leave, map.Integer<std::size_t>("leave", 0, kMostSkipped));
  Assign(framing.answers_have_it, map.Flag("answers"));
  map.Finish();
}

std::optional<Format> ReadFixedFormat(MapReader& map, const char* example) {
  const auto node = map.Need("format", example);
  const auto text = node ? config::ReadText(*node, "format", map.problems()) : std::nullopt;
  if (!text) return std::nullopt;
  const auto format = ParseFormat(*text);
  if (format && format->is_fixed()) return *format;
  map.problems().Error(
      node->mark(), "format: " + (format ? Quoted(*text) + " needs a width here" : format.error()));
  return std::nullopt;
}

std::optional<SizeField> ReadSizeAt(const YamlNode& node, Problems& problems) {
  SizeField field;
  field.format = *ParseFormat("uint8");
  if (node.kind() != YamlNode::Kind::map) {
    const auto at = config::ReadInteger(node, "size_at", 0, kMostSkipped, problems);
    if (!at) return std::nullopt;
    field.at = static_cast<std::size_t>(*at);
    return field;
  }
  MapReader map(node, "size_at", problems);
  map.Need("at", "2");
  Assign(field.at, map.Integer<std::size_t>("at", 0, kMostSkipped));
  Assign(field.plus, map.Integer<std::size_t>("plus", 0, kMostSkipped));
  if (map.Has("format")) Assign(field.format, ReadFixedFormat(map, "uint16_be"));
  map.Finish();
  if (field.format.is_whole_number()) return field;
  problems.Error(node.mark(), "size_at: the format must be an integer, such as uint8 or uint16_be");
  return std::nullopt;
}

/// Returns the entries of a list; if the node is not a list, it is the only entry.
std::vector<YamlNode> OneOrMore(const YamlNode& node, const std::string& what, Problems& problems) {
  if (node.kind() != YamlNode::Kind::list) return {node};
  return config::ReadList(node, what, kMostForms, problems);
}

void AddEnd(const Bytes& ends, Pattern& pattern) {
  if (ends.empty()) return;
  if (pattern.elements.empty() || pattern.elements.back().is_field()) {
    pattern.elements.push_back({ends, {}, {}});
    return;
  }
  Bytes& last = pattern.elements.back().literal;
  const bool there =
      last.size() >= ends.size() &&
      std::equal(ends.begin(), ends.end(), last.end() - static_cast<std::ptrdiff_t>(ends.size()));
  if (!there) Append(last, ends);
}

std::vector<PlacedField> ReadPlaced(MapReader& map) {
  std::vector<PlacedField> placed;
  const auto node = map.Get("fields");
  if (!node) return placed;
  for (const config::Entry& entry : config::ReadEntries(*node, "fields", map.problems())) {
    MapReader field(entry.value, "field '" + entry.key + "'", map.problems());
    PlacedField one{{{}, entry.key, {}}, 0, entry.value.mark()};
    field.Need("at", "4");
    Assign(one.at, field.Integer<std::size_t>("at", 0, 4095));
    const auto format = ReadFixedFormat(field, "uint16_be");
    field.Finish();
    if (!format) continue;
    one.element.format = *format;
    placed.push_back(std::move(one));
  }
  std::ranges::sort(placed, {}, &PlacedField::at);
  return placed;
}

Element Gap(std::size_t width) {
  Element gap;
  gap.format.kind = Format::Kind::bytes;
  gap.format.width = width;
  return gap;
}

void AddPlaced(const std::vector<PlacedField>& placed, std::optional<std::size_t> size,
               Pattern& pattern, Problems& problems) {
  if (placed.empty()) return;
  std::size_t at = pattern.elements.empty() ? 0 : pattern.size().value_or(0);
  if (!pattern.elements.empty() && !pattern.size()) {
    problems.Error(
        placed.front().mark,
        "fields: a field in 'receive' has no width, so the positions after it are unknown; "
        "give each field in 'receive' a width");
    return;
  }
  for (const PlacedField& one : placed) {
    if (one.at < at) {
      problems.Error(one.mark, "field '" + one.element.name + "': byte " + std::to_string(one.at) +
                                   " belongs to an earlier field; the first free byte is " +
                                   std::to_string(at));
      return;
    }
    if (pattern.Has(one.element.name)) {
      problems.Error(one.mark,
                     "field '" + one.element.name +
                         "' is in the pattern as well; remove it from one of the two places");
      return;
    }
    if (one.at > at) pattern.elements.push_back(Gap(one.at - at));
    pattern.elements.push_back(one.element);
    at = one.at + one.element.format.width;
  }
  if (size && *size > at) pattern.elements.push_back(Gap(*size - at));
}

class FormReader {
 public:
  FormReader(MapReader& map, const Framing& framing, std::size_t most, bool listen)
      : map_(map), framing_(framing), most_(most), listen_(listen) {}

  void Send(Telegram& telegram) {
    const auto node = map_.Get("send");
    auto pattern = node ? ReadPattern(*node, "send", map_.problems()) : std::nullopt;
    if (!pattern) return;
    if (pattern->is_open() && pattern->elements.back().format.kind == Format::Kind::bytes) {
      map_.problems().Error(node->mark(), "send: a field of bytes in 'send' needs a width");
    }
    telegram.send = Checked(std::move(*pattern), node->mark(), "send", false);
  }

  void Answers(Telegram& telegram) {
    if (telegram.send) sent_ = &telegram.send->pattern;
    const auto size = map_.Integer<std::size_t>("size", 1, static_cast<std::size_t>(most_));
    const std::vector<PlacedField> placed = ReadPlaced(map_);
    const auto node = map_.Get("receive");
    const bool by_size = !node && (size || !placed.empty());
    if (by_size) {
      Pattern pattern;
      AddPlaced(placed, size, pattern, map_.problems());
      if (pattern.elements.empty()) pattern.elements.push_back(Gap(size.value_or(1)));
      const config::Mark mark = map_.MarkOf(placed.empty() ? "size" : "fields");
      telegram.receive.push_back(Checked(std::move(pattern), mark, "fields", true));
      CheckSize(telegram.receive.back(), size);
      return;
    }
    if (!node) return;
    for (const YamlNode& one : OneOrMore(*node, "receive", map_.problems())) {
      auto pattern = ReadPattern(one, "receive", map_.problems());
      if (!pattern) continue;
      AddPlaced(placed, size, *pattern, map_.problems());
      AddEnd(framing_.ends, *pattern);
      telegram.receive.push_back(Checked(std::move(*pattern), one.mark(), "receive", true));
      CheckSize(telegram.receive.back(), size);
    }
  }

  void Refusals(Telegram& telegram) {
    const auto node = map_.Get("refused");
    const std::vector<YamlNode> nodes =
        node ? OneOrMore(*node, "refused", map_.problems()) : framing_.refused;
    if (telegram.receive.empty()) return;
    for (const YamlNode& one : nodes) {
      auto pattern = ReadPattern(one, "refused", map_.problems());
      if (!pattern) continue;
      AddEnd(framing_.ends, *pattern);
      telegram.refused.push_back(Checked(std::move(*pattern), one.mark(), "refused", true));
    }
  }

 private:
  void CheckSize(const Form& form, std::optional<std::size_t> size) {
    if (!size) return;
    const auto own = form.pattern.size();
    if (own == size) return;
    map_.problems().Error(
        map_.MarkOf("size"),
        "size: the pattern has " +
            (own ? std::to_string(*own) + " bytes, not " + std::to_string(*size)
                 : std::string("fields without a width, so 'size' cannot be checked; remove "
                               "'size', or give these fields a width")));
  }

  Form Checked(Pattern pattern, const config::Mark& mark, const std::string& what, bool received) {
    Form form{std::move(pattern), framing_.checksum, {}, received && !listen_};
    if (received) form.size_at = framing_.size_at;
    Problems& problems = map_.problems();
    const auto error = [&](const std::string& why) { problems.Error(mark, what + ": " + why); };
    if (received && form.pattern.Has(kPassword)) {
      error(
          "a password cannot be a field of an answer, because answers are logged; skip its bytes, "
          "as in {:4bytes}");
    }
    CheckEnd(form, received, error);
    CheckSum(form, mark, error);
    if (what != "send" && what != "refused" && NeedsSum(form)) {
      error("has no {checksum}, but 'checksum' is " + std::string(framing_.checksum.kind->name) +
            "; write {checksum:" + SumFormat(*framing_.checksum.kind) +
            "} at its position, or checksum: none if the device sends none");
    }
    if (form.pattern.Find(kChecksum) == nullptr) form.checksum = {};
    const std::size_t most = form.is_unmarked() ? most_ / 2 : most_;
    if (form.pattern.least_size() > most) {
      error("is longer than " + std::to_string(most) + " bytes; raise 'longest' in 'all'");
    }
    return form;
  }

  template <typename Tell>
  void CheckEnd(const Form& form, bool received, Tell error) const {
    const bool sized = form.size_at.has_value();
    if (sized && form.size_at->at + form.size_at->format.width > form.pattern.least_size()) {
      error("ends before the position of its size; correct size_at");
    }
    const bool has_rest = std::ranges::any_of(form.pattern.elements, [](const Element& element) {
      return element.is_field() && element.format.kind == Format::Kind::bytes &&
             element.format.width == 0;
    });
    if (has_rest && !sized)
      error("a field of bytes without a width needs 'size_at', the position of its size");
    if (!received || sized || !form.pattern.is_open()) return;
    if (framing_.idle > Duration::zero()) return;
    error(
        "the end of the telegram is not defined; give the last field a width, add the bytes that "
        "end it, or set 'ends', 'size_at' or 'idle'");
  }

  static std::string SumFormat(const ChecksumKind& kind) {
    return "0" + std::to_string(2 * kind.bytes) + "X";
  }

  /// True if the form lacks a field for the check value, but needs it. An answer that consists only
  /// of fixed bytes ("ACK") and of fields of the request needs no check value.
  bool NeedsSum(const Form& form) const {
    if (framing_.checksum.kind == nullptr || !framing_.answers_have_it) return false;
    if (form.pattern.Has(kChecksum)) return false;
    return std::ranges::any_of(form.pattern.elements, [&](const Element& element) {
      return element.is_field() &&
             (sent_ == nullptr || element.name.empty() || !sent_->Has(element.name));
    });
  }

  template <typename Tell>
  void CheckSum(const Form& form, const config::Mark& mark, Tell error) const {
    const Element* field = form.pattern.Find(kChecksum);
    if (field == nullptr || framing_.unknown_checksum) return;
    if (form.checksum.kind == nullptr) {
      return error(
          "has {checksum}, but no key 'checksum' with its kind; write for example checksum: sum8");
    }
    const ChecksumKind& kind = *form.checksum.kind;
    std::size_t front = 0;
    for (const Element& element : form.pattern.elements) {
      if (&element == field || !element.is_fixed()) break;
      front += element.fixed_size();
      if (&element + 1 == field && front <= form.checksum.skip + form.checksum.leave) {
        map_.problems().Error(map_.Has("checksum") ? map_.MarkOf("checksum") : mark,
                              "checksum: 'skip' and 'leave' leave no byte of the " +
                                  std::to_string(front) + " bytes before {checksum}: skip is " +
                                  std::to_string(form.checksum.skip) + " and leave is " +
                                  std::to_string(form.checksum.leave));
      }
    }
    const Format& format = field->format;
    const bool hex = format.kind == Format::Kind::hex && format.width == 2 * kind.bytes;
    const bool binary = format.kind == Format::Kind::uint && format.width == kind.bytes;
    const std::size_t digits = kind.bytes == 1 ? 3 : kind.bytes == 2 ? 5 : 10;
    const bool decimal = format.kind == Format::Kind::integer && format.width == digits;
    if (hex || binary || decimal) return;
    const std::string bits = std::to_string(8 * kind.bytes);
    error(std::string(kind.name) + " has " + bits + " bits; write {checksum:" + SumFormat(kind) +
          "}, {checksum:uint" + bits + (kind.bytes == 1 ? "}" : "_le}") +
          ", or in decimal digits {checksum:0" + std::to_string(digits) + "d}");
  }

  MapReader& map_;
  const Framing& framing_;
  const std::size_t most_;
  const bool listen_;
  const Pattern* sent_ = nullptr;  // the pattern that is sent; null: nothing is sent
};

}  // namespace

config::Mark PlaceIn(const YamlNode& node, std::size_t at) {
  config::Mark mark = node.mark();
  const std::string_view line = node.source()->Line(mark.line);
  const auto column = static_cast<std::size_t>(std::max(mark.column - 1, 0));
  const bool quoted = column < line.size() && (line[column] == '\'' || line[column] == '"');
  mark.column += static_cast<int>(at) + (quoted ? 1 : 0);
  return mark;
}

std::optional<Bytes> ReadFixed(const YamlNode& node, const std::string& what, Problems& problems) {
  const auto pattern = ReadPattern(node, what, problems);
  if (!pattern) return std::nullopt;
  if (pattern->elements.size() == 1 && !pattern->elements.front().is_field()) {
    return pattern->elements.front().literal;
  }
  problems.Error(node.mark(),
                 what + ": write real bytes here, not fields; for the character { write \\{");
  return std::nullopt;
}

Framing ReadFraming(MapReader& map, const Framing& all) {
  Framing framing = all;
  if (const auto node = map.Get("ends")) {
    if (auto bytes = ReadFixed(*node, "ends", map.problems())) framing.ends = std::move(*bytes);
  }
  if (const auto node = map.Get("checksum")) ReadChecksum(*node, map.problems(), framing);
  if (const auto node = map.Get("size_at")) framing.size_at = ReadSizeAt(*node, map.problems());
  Assign(framing.idle, map.Time("idle", 1ms, std::chrono::seconds(5)));
  Assign(framing.strict, map.Flag("strict"));
  return framing;
}

void ReadForms(MapReader& map, const Framing& framing, std::size_t most, Telegram& telegram) {
  FormReader reader(map, framing, most, telegram.listen);
  reader.Send(telegram);
  reader.Answers(telegram);
  reader.Refusals(telegram);
}

}  // namespace baudgate::protocols::telegram
