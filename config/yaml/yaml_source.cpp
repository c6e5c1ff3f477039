// SPDX-License-Identifier: Apache-2.0
#include "config/yaml/yaml_source.h"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kLargestText = std::size_t{4} << 20U;
constexpr std::size_t kMostNodes = 200'000;

bool IsContinuation(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

// Returns a hint for values that begin with a character that has a meaning in YAML (comment, alias,
// reserved). Protocol addresses with such a character need quotes, but the parser's message does
// not say so.
std::string QuotingHint(const Source& source, int last_line) {
  for (int line = 1; line <= last_line; ++line) {
    const std::string_view text = source.Line(line);
    for (const std::string_view key : {"read:", "write:", "password:"}) {
      auto at = text.find(key);
      if (at == std::string_view::npos) continue;
      at = text.find_first_not_of(' ', at + key.size());
      if (at == std::string_view::npos || !std::strchr("#@%`*&!", text[at])) continue;
      return "; the value after '" + std::string(key) + "' in line " + std::to_string(line) +
             " begins with '" + text[at] + "' and needs quotes";
    }
    // An unquoted '*' begins an alias in YAML. Examples: "- *.*.current_*" and "[*.*.*]".
    for (const char* const begin : {"- *", "[*", "[ *", ", *"}) {
      if (text.find(begin) == std::string_view::npos) continue;
      return "; a value that begins with '*' in line " + std::to_string(line) + " needs quotes";
    }
  }
  return {};
}

struct TooManyNodes {};

/// Records where the last document begins, and counts the nodes of all documents. Throws
/// TooManyNodes beyond kMostNodes.
class DocumentStarts final : public YAML::EventHandler {
 public:
  YAML::Mark last;

  void OnDocumentStart(const YAML::Mark& mark) override { last = mark; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override { Count(); }
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override { Count(); }
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {
    Count();
  }
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    Count();
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    Count();
  }
  void OnMapEnd() override {}

 private:
  void Count() {
    if (++nodes_ > kMostNodes) throw TooManyNodes();
  }

  std::size_t nodes_ = 0;
};

/// True if the text has so many brackets and commas that it must have more than kMostNodes nodes.
/// yaml-cpp stores all tokens of a line of such a text before its first event, with 200 bytes each.
bool HasTooManyBrackets(std::string_view text) {
  const auto separates = [](char c) { return c == '[' || c == '{' || c == ','; };
  return static_cast<std::size_t>(std::ranges::count_if(text, separates)) > kMostNodes;
}

// Returns the only document of the text. YAML::LoadAll cannot be used: a comma behind a value
// ("{ a: 1 },") makes it produce documents without end, until memory is exhausted.
std::optional<YAML::Node> OnlyDocument(const Source& source, Problems& problems) {
  std::istringstream in(source.text());
  YAML::Parser parser(in);
  DocumentStarts starts;
  if (!parser.HandleNextDocument(starts)) {
    problems.Error({source.name(), 1, 1}, "is empty");
    return std::nullopt;
  }
  if (!parser.HandleNextDocument(starts)) return YAML::Load(source.text());
  const Position place = source.At(starts.last);
  const auto at = static_cast<std::size_t>(std::max(starts.last.pos, 0));
  if (at < source.text().size() && source.text()[at] == ',') {
    problems.Error(source.MarkAt(place), "this comma is outside of brackets; remove it");
  } else {
    problems.Error(source.MarkAt(place),
                   "a second document begins here, but a file can have only one; remove the '---'");
  }
  return std::nullopt;
}

// Removes the quotation from a message of yaml-cpp, because yaml-cpp quotes names of anchors, and
// an unquoted password can look like an anchor.
std::string WithoutQuotation(const std::string& message) {
  return message.substr(0, message.find(": "));
}

}  // namespace

Source::Source(std::string name, std::string text)
    : name_(std::move(name)), text_(std::move(text)) {
  line_starts_.push_back(0);
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (text_[i] == '\n') line_starts_.push_back(i + 1);
  }
}

std::string_view Source::Line(int line) const {
  if (line < 1 || line > lines()) return {};
  const std::size_t begin = line_starts_[static_cast<std::size_t>(line) - 1];
  const std::size_t end = text_.find('\n', begin);
  return std::string_view(text_).substr(begin, end == std::string::npos ? end : end - begin);
}

Position Source::At(const YAML::Mark& mark) const {
  if (mark.is_null() || mark.line < 0) return {1, 1};
  const std::string_view line = Line(mark.line + 1);
  int column = mark.column;
  for (std::size_t i = 0; i < line.size() && i < static_cast<std::size_t>(mark.column); ++i) {
    if (IsContinuation(line[i])) --column;
  }
  return {mark.line + 1, column + 1};
}

YamlNode::YamlNode(const YAML::Node& node, std::shared_ptr<const Source> source,
                   std::optional<Position> key)
    : node_(node), source_(std::move(source)) {
  place_ = key && node_.IsNull() ? *key : source_->At(node_.Mark());
}

YamlNode& YamlNode::operator=(const YamlNode& other) {
  node_.reset(other.node_);
  source_ = other.source_;
  place_ = other.place_;
  return *this;
}

YamlNode::Kind YamlNode::kind() const {
  switch (node_.Type()) {
    case YAML::NodeType::Scalar:
      return Kind::scalar;
    case YAML::NodeType::Sequence:
      return Kind::list;
    case YAML::NodeType::Map:
      return Kind::map;
    default:
      return Kind::null;
  }
}

std::optional<YamlNode> ParseYaml(std::string name, std::string text, Problems& problems) {
  if (text.size() > kLargestText) {
    problems.Error({name, 0, 0},
                   "is larger than the 4 MiB that a configuration can have; divide the devices "
                   "among several gateways");
    return std::nullopt;
  }
  const auto refuse_nodes = [&problems](const std::string& file) {
    problems.Error({file, 0, 0},
                   "has more than 200000 keys and values; use profiles for devices of one kind, or "
                   "divide the devices among several gateways");
    return std::nullopt;
  };
  if (HasTooManyBrackets(text)) return refuse_nodes(name);
  const auto source = std::make_shared<const Source>(std::move(name), std::move(text));
  const std::size_t bad = FirstNotUtf8(source->text());
  if (bad != std::string::npos) {
    const auto line = std::count(source->text().begin(),
                                 source->text().begin() + static_cast<std::ptrdiff_t>(bad), '\n');
    problems.Error({source->name(), static_cast<int>(line) + 1, 1},
                   "this line is not UTF-8 text; save the file as UTF-8");
    return std::nullopt;
  }
  try {
    if (auto node = OnlyDocument(*source, problems)) return YamlNode(std::move(*node), source);
    return std::nullopt;
  } catch (const TooManyNodes&) {
    return refuse_nodes(source->name());
  } catch (const YAML::Exception& error) {
    const Position place = source->At(error.mark);
    problems.Error(source->MarkAt(place), "this is not YAML: " + WithoutQuotation(error.msg) +
                                              QuotingHint(*source, place.line));
  } catch (const std::exception&) {
    problems.Error({source->name(), 0, 0}, "could not be read as YAML");
  }
  return std::nullopt;
}

Result<std::string> ReadWholeFile(const std::string& path) {
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) return Error{"is a directory, not a file"};
  std::ifstream file(path, std::ios::binary);
  if (!file) return Error{std::string("cannot be opened: ") + std::strerror(errno)};
  std::string text;
  std::vector<char> chunk(std::size_t{1} << 16U);
  while (file.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || file.gcount() > 0) {
    text.append(chunk.data(), static_cast<std::size_t>(file.gcount()));
    if (text.size() > kLargestText) return Error{"is larger than 4 MiB"};
  }
  if (file.bad()) return Error{"cannot be read"};
  return text;
}

}  // namespace baudgate::config
