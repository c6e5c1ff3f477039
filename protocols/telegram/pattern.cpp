// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/pattern.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr std::string_view kHexMark = "hex ";
constexpr std::size_t kMostElements = 200;

bool IsNameText(std::string_view name) {
  return std::ranges::all_of(
      name, [](char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'; });
}

class PatternParser {
 public:
  explicit PatternParser(std::string_view text) : text_(text) {}

  ParsedPattern Parse() {
    hex_ = text_.starts_with(kHexMark);
    at_ = hex_ ? kHexMark.size() : 0;
    while (at_ < text_.size() && !error_) {
      if (text_[at_] == '{') {
        TakeField();
      } else if (hex_) {
        TakeHex();
      } else {
        TakeCharacter();
      }
    }
    if (!error_) CheckOrder();
    if (error_) return {{}, std::move(error_)};
    return {std::move(pattern_), {}};
  }

 private:
  void Fail(std::size_t at, std::string message) {
    if (!error_) error_ = PatternError{std::move(message), at};
  }

  void Add(std::uint8_t byte) {
    if (pattern_.elements.empty() || pattern_.elements.back().is_field()) {
      pattern_.elements.emplace_back();
    }
    pattern_.elements.back().literal.push_back(byte);
  }

  void TakeHex() {
    if (text_[at_] == ' ') {
      ++at_;
      return;
    }
    const auto byte = ParseHex(text_.substr(at_, 2));
    if (!byte || byte->size() != 1 || text_[at_ + 1] == ' ') {
      return Fail(at_, "write two hex digits for each byte, as in 'hex 05 1B'");
    }
    Add(byte->front());
    at_ += 2;
  }

  void TakeCharacter() {
    const char c = text_[at_];
    if (c == '}') return Fail(at_, "'}' without '{'; for the character } write \\}");
    if (c != '\\') {
      Add(static_cast<std::uint8_t>(c));
      ++at_;
      return;
    }
    const char escaped = at_ + 1 < text_.size() ? text_[at_ + 1] : '\0';
    constexpr std::string_view kNames = "rnt\\{}";
    constexpr std::string_view kMeanings = "\r\n\t\\{}";
    if (const auto known = kNames.find(escaped);
        escaped != '\0' && known != std::string_view::npos) {
      Add(static_cast<std::uint8_t>(kMeanings[known]));
      at_ += 2;
      return;
    }
    const auto byte = escaped == 'x' ? ParseHex(text_.substr(at_ + 2, 2)) : std::nullopt;
    if (!byte || byte->size() != 1) {
      return Fail(at_,
                  "unknown escape; allowed: \\r \\n \\t \\\\ \\{ \\} and \\x with two hex digits");
    }
    Add(byte->front());
    at_ += 4;
  }

  void TakeField() {
    const std::size_t end = text_.find('}', at_);
    if (end == std::string_view::npos)
      return Fail(at_, "'{' without '}'; for the character { write \\{");
    const std::string_view inside = text_.substr(at_ + 1, end - at_ - 1);
    const std::size_t colon = std::min(inside.find(':'), inside.size());
    Element element;
    element.name = inside.substr(0, colon);
    if (!IsNameText(element.name)) {
      return Fail(at_ + 1,
                  Quoted(element.name) + " is not a field name; use small letters, digits and _");
    }
    const std::string_view form = colon < inside.size() ? inside.substr(colon + 1) : "";
    const auto format = ParseFormat(form);
    if (!format) return Fail(at_ + 1 + std::min(colon + 1, inside.size()), format.error());
    element.format = *format;
    if (!element.name.empty() && element.format.kind == Format::Kind::bytes) {
      return Fail(at_ + 1,
                  "bytes are skipped and cannot have a name; write {:" + std::string(form) +
                      "}, or {" + element.name + ":byte} for one byte that 'codes' explain");
    }
    if (const Element* before = pattern_.Find(element.name);
        before != nullptr && !element.name.empty()) {
      // There must be only one check value, because it covers the bytes in front of it.
      if (element.name == kChecksum || before->format != element.format) {
        return Fail(at_ + 1, "field '" + element.name + "' occurs twice" +
                                 (element.name == kChecksum ? "" : ", in different formats"));
      }
      pattern_.has_repeats = true;
    }
    if (element.name.empty() && form.empty()) {
      return Fail(at_, "a field needs a name, a format, or both: {weight:decimal}");
    }
    places_.push_back({pattern_.elements.size(), at_});
    pattern_.elements.push_back(std::move(element));
    at_ = end + 1;
  }

  /// Checks that the end of each field can be found from the elements behind it.
  void CheckOrder() {
    if (pattern_.elements.empty()) return Fail(0, "a telegram needs at least one byte");
    if (pattern_.elements.size() > kMostElements)
      return Fail(0, "has too many fields; at most " + std::to_string(kMostElements));
    bool open = false;
    for (const auto& [index, at] : places_) {
      const Element& element = pattern_.elements[index];
      if (element.is_fixed()) continue;
      const bool last = index + 1 == pattern_.elements.size();
      if (element.format.kind == Format::Kind::bytes) {
        // The width of this field follows from the size of the telegram.
        if (std::exchange(open, true))
          return Fail(at, "only one field can be without a width; give the other fields a width");
        continue;
      }
      if (last || pattern_.AnchorOf(index)) continue;
      const Format& next = pattern_.elements[index + 1].format;
      // The next field shows where the number ends, as in "12.5kg" and "+025.12-020.45".
      const bool shows = next.is_signed_token() || (next.is_text() && !next.is_text_number());
      if (!element.format.is_text_number() || !shows) {
        return Fail(at,
                    "the end of '" + element.name +
                        "' is not defined; give this field a width, or put a separator after it");
      }
    }
  }

  std::string_view text_;
  bool hex_ = false;
  std::size_t at_ = 0;
  Pattern pattern_;
  // For each field: the index of its element, and the position of its first character in the text.
  std::vector<std::pair<std::size_t, std::size_t>> places_;
  std::optional<PatternError> error_;
};

}  // namespace

const Element* Pattern::Find(std::string_view name) const {
  const auto found = std::ranges::find_if(
      elements, [&](const Element& element) { return element.is_field() && element.name == name; });
  return found == elements.end() ? nullptr : &*found;
}

std::optional<Pattern::Anchor> Pattern::AnchorOf(std::size_t index) const {
  Anchor anchor;
  for (std::size_t i = index + 1; i < elements.size(); ++i) {
    const Element& element = elements[i];
    if (!element.is_field()) {
      anchor.literal = &element.literal;
      return anchor;
    }
    if (!element.is_fixed() || !element.format.is_text()) return std::nullopt;
    anchor.between += element.fixed_size();
  }
  return std::nullopt;
}

std::size_t Pattern::least_size() const {
  std::size_t least = 0;
  for (const Element& element : elements) least += element.is_fixed() ? element.fixed_size() : 0;
  return std::max<std::size_t>(least, 1);
}

std::optional<std::size_t> Pattern::size() const {
  if (!std::ranges::all_of(elements, &Element::is_fixed)) return std::nullopt;
  return least_size();
}

std::pair<std::size_t, std::optional<std::size_t>> Pattern::usual_sizes() const {
  std::size_t least = 0;
  std::optional<std::size_t> most = 0;
  for (const Element& element : elements) {
    const std::size_t size = element.fixed_size();
    const bool may_be_shorter = element.is_field() && element.format.is_signed_token() &&
                                element.format.point && size > kShorterCode;
    least += may_be_shorter ? size - kShorterCode : size;
    if (size == 0) most.reset();
    if (most) *most += size;
  }
  return {std::max<std::size_t>(least, 1), most};
}

std::size_t Pattern::literal_size() const {
  std::size_t size = 0;
  for (const Element& element : elements) size += element.literal.size();
  return size;
}

ParsedPattern ParsePattern(std::string_view text) { return PatternParser(text).Parse(); }

}  // namespace baudgate::protocols::telegram
