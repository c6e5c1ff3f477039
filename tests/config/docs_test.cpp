// Tests that every piece of YAML in the documents can be pasted: each piece is completed to a whole
// file and loaded.
//
// Pieces are blocks marked as yaml, files that a command writes (cat > x.yaml <<'END'), and lines
// in other blocks and inline code that begin with a key of the configuration. "…" stands for
// omitted parts. Each piece is tried at every level (file, line, device, point, profile …) with
// every protocol until an attempt loads; missing names, ports and addresses are filled in.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <span>

#include "config/loader.h"
#include "tests/config/fake_protocol.h"
#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

using Lines = std::vector<std::string>;

struct Piece {
  std::string file;
  std::size_t line = 0;
  std::string text;
};

/// A piece that is not tested: it is not a configuration, or needs files of another piece.
struct Exception {
  std::string_view file;
  std::string_view begins;
  std::string_view why;
};
constexpr Exception kExceptions[] = {
    {"docs/audit.md", "gateway: audit", "the name of a client"},
    {"docs/events.md", "records: ", "names points of the reader's own profile"},
    {"docs/history.md", "gap: overwritten", "a record of the answer"},
    {"docs/history.md", "history:\n", "its patterns name points of the reader's plant"},
    {"docs/new-device.md", "lines:", "its profile is made by the commands above it"},
    {"docs/new-device.md", "profile: acme-em1", "the same"},
    {"protocols/set4tm/README.md", "write: [clock_correction]", "a point of an example above it"},
    {"docs/writes.md", "max: NAME", "a point of the reader's own device"},
    {"docs/writes.md", "allow_when: { point: LINE", "a point of the reader's plant"},
    {"docs/settings.md", "gateway: \"substation-7\"", "a file of `baudgate settings`"},
};
constexpr Exception kUnreadCode[] = {
    {"protocols/telegram/README.md", "",
     "keys of a telegram; its blocks show them at their places"},
};

const std::set<std::string>& Keys() {
  static const std::set<std::string> kKeys = {"gateway", "modbus",    "dds",     "web",    "events",
                                              "history", "lines",     "devices", "points", "listen",
                                              "routes",  "telegrams", "records", "device"};
  return kKeys;
}

std::string KeyOf(const std::string& line) {
  static const std::regex kKey(R"(^([a-z_]+):( .*)?$)");
  std::smatch found;
  return std::regex_match(line, found, kKey) ? found[1].str() : std::string();
}

bool StartsAFile(const std::string& line) { return Keys().contains(KeyOf(line)); }

class Document {
 public:
  explicit Document(std::string file) : file_(std::move(file)) {
    std::ifstream in(file_);
    for (std::string line; std::getline(in, line);) lines_.push_back(line);
  }

  std::vector<Piece> Pieces() {
    for (std::size_t i = 0; i < lines_.size();) i = TakeFrom(i);
    return std::move(pieces_);
  }

 private:
  std::size_t TakeFrom(std::size_t i) {
    const std::string& line = lines_[i];
    if (line.starts_with("```")) {
      std::size_t end = i + 1;
      while (end < lines_.size() && !lines_[end].starts_with("```")) ++end;
      TakeBlock({lines_.begin() + At(i + 1), lines_.begin() + At(end)}, i + 1, line.substr(3));
      return end + 1;
    }
    if (line.starts_with("    ") && (i == 0 || lines_[i - 1].empty())) {
      Lines block;
      std::size_t end = i;
      for (; end < lines_.size() && (lines_[end].empty() || lines_[end].starts_with("    "));
           ++end) {
        block.push_back(lines_[end].empty() ? "" : lines_[end].substr(4));
      }
      TakeBlock(block, i, "");
      return end;
    }
    const bool read =
        std::ranges::none_of(kUnreadCode, [&](const Exception& one) { return one.file == file_; });
    if (read) TakeCode(line, i);
    return i + 1;
  }

  static std::ptrdiff_t At(std::size_t i) { return static_cast<std::ptrdiff_t>(i); }

  void Add(std::size_t line, const Lines& lines) {
    std::string text;
    for (const std::string& one : lines) text += one + "\n";
    pieces_.push_back({file_, line + 1, text});
  }

  void TakeBlock(const Lines& block, std::size_t first, const std::string& language) {
    if (language == "yaml") return Add(first, block);
    static const std::regex kHere(R"(^cat > \S+\.yaml <<'?(\w+)'?$)");
    for (std::size_t i = 0; i < block.size(); ++i) {
      std::smatch here;
      Lines piece;
      std::size_t end = i;
      if (std::regex_match(block[i], here, kHere)) {
        for (end = i + 1; end < block.size() && block[end] != here[1].str();) {
          piece.push_back(block[end++]);
        }
      } else if (StartsAFile(block[i]) && !(i > 0 && block[i - 1].starts_with("$"))) {
        const auto goes_on = [&](const std::string& line) {
          return line.starts_with(" ") || line.starts_with("- ") || line.starts_with("#") ||
                 StartsAFile(line);
        };
        piece.push_back(block[end++]);
        while (end < block.size() && goes_on(block[end])) piece.push_back(block[end++]);
        --end;
      }
      if (!piece.empty()) Add(first + i, piece);
      i = end;
    }
  }

  void TakeCode(const std::string& line, std::size_t number) {
    static const std::regex kCode("`([^`]+)`");
    for (std::sregex_iterator at(line.begin(), line.end(), kCode), end; at != end; ++at) {
      const std::string code = (*at)[1];
      static const std::regex kPair(R"(^[a-z_]+: \S.*$)");
      if (std::regex_match(code, kPair)) Add(number, {code});
    }
  }

  const std::string file_;
  Lines lines_;
  std::vector<Piece> pieces_;
};

std::string WithoutDots(std::string text, bool keys) {
  static const std::string kDots = R"((…|\.\.\.))";
  const auto replace = [&text](const std::string& form, const std::string& by) {
    text = std::regex_replace(text, std::regex(form), by);
  };
  replace(R"((\n *-) )" + kDots + R"((?= *\n))", "$1");
  replace(R"(\n *)" + kDots + R"((?= *\n))", "");
  replace(", " + kDots, "");
  replace(R"(([a-z_]+: ))" + kDots + " ", keys ? "" : "$1/x ");
  replace(R"(([\[{]) )" + kDots + ",? ", "$1 ");
  return text;
}

/// Appends the node in block style. Scalars stay unchanged, because `0x8000` and "0x8000" differ.
void Print(const YAML::Node& node, const std::string& indent, std::string& out) {
  if (node.IsMap() && node.size() > 0) {
    out += "\n";
    for (const auto& entry : node) {
      out += indent;
      std::string key;
      Print(entry.first, "", key);
      out += key.substr(1, key.size() - 2) + ":";
      Print(entry.second, indent + "  ", out);
    }
  } else if (node.IsSequence() && node.size() > 0) {
    out += "\n";
    for (const auto& entry : node) {
      out += indent + "-";
      Print(entry, indent + "  ", out);
    }
  } else if (node.IsScalar() && node.Tag() == "!") {
    std::string quoted = " \"";
    for (const char c : node.Scalar()) {
      if (c == '"' || c == '\\') quoted += '\\';
      if (c == '\n') {
        quoted += "\\n";
      } else {
        quoted += c;
      }
    }
    out += quoted + "\"\n";
  } else {
    out += node.IsScalar()     ? " " + node.Scalar() + "\n"
           : node.IsMap()      ? " {}\n"
           : node.IsSequence() ? " []\n"
                               : "\n";
  }
}

struct Base {
  const char* protocol;
  const char* profile;
  const char* read = "";
  const char* type = "float32";
  bool written = false;
  const char* option = "";
  const char* value = "";
};
constexpr Base kBases[] = {
    {"spabus", "", "I1"},
    {"modbus_rtu", "", "holding 0", "int16"},
    {"modbus_rtu", "", "holding 0", "int16", true},
    {"modbus_rtu", "", "coil 0", "bool", true},
    {"modbus_rtu", "", "holding 0", "string(16)"},
    {"modbus_rtu", "", "holding 0"},
    {"modbus_tcp", "", "holding 0"},
    {"modbus_ascii", "", "holding 0"},
    {"dcon", "owen-mv110-8a", "#0"},
    {"dcon", "owen-mv110-8a", "", "bool"},
    {"dcon", "owen-mv110-8a", "", "float64"},
    {"reader", "bar-code"},
    {"reader", "olimex-mod-rfid125-asked", "", "string(32)", false, "commands", "ask"},
    {"spabus", "spaj140c", "S1", "float32", true},
    {"set4tm", "set-4tm.03m", "08 1B 00 float_le@0", "float64", false, "time_zone", "+03:00"},
    {"set4tm", "set-4tm.03m", "08 1B 00 float_le@0", "bool", true},
    {"telegram", "mt-sics"},
};

YAML::Node Map(const std::string& key, const YAML::Node& value) {
  YAML::Node map;
  map[key] = value;
  return map;
}

YAML::Node List(const YAML::Node& element) {
  YAML::Node list;
  list.push_back(element);
  return list;
}

class Completion {
 public:
  explicit Completion(const Base& base) : base_(base) {}

  YAML::Node Point(YAML::Node point) const {
    if (!point.IsMap()) point = YAML::Node(YAML::NodeType::Map);
    Fill(point, "name", "p");
    if (!point["read"] && !point["write"]) Fill(point, "read", base_.read);
    Fill(point, "type", base_.type);
    if (base_.written) Fill(point, "access", point["read"] ? "rw" : "w");
    if (point["table"]) Fill(point, "modbus", "0");
    return point;
  }
  YAML::Node Device(YAML::Node device) const {
    if (!device.IsMap()) device = YAML::Node(YAML::NodeType::Map);
    static int number = 0;
    Fill(device, "name", "d" + std::to_string(++number));
    if (std::string_view(base_.protocol) != "reader") Fill(device, "address", "1");
    if (const auto protocol = ProtocolOf(List(device)); protocol && *protocol != base_.protocol) {
      Fill(device, "protocol", *protocol);
    }
    if (!device["profile"] && !device["points"]) {
      if (*base_.profile != '\0') {
        device["profile"] = base_.profile;
      } else {
        device["points"] = List(YAML::Node(YAML::NodeType::Map));
      }
    }
    if (device["points"]) Each(device["points"], &Completion::Point);
    if (*base_.option != '\0') Fill(device, base_.option, base_.value);
    if (base_.written) Fill(device, "write", "allow");
    return device;
  }
  YAML::Node Line(YAML::Node line) const {
    if (!line.IsMap()) line = YAML::Node(YAML::NodeType::Map);
    static int number = 0;
    const std::string own = "l" + std::to_string(++number);
    Fill(line, "name", own);
    const bool network = std::string_view(base_.protocol) == "modbus_tcp";
    Fill(line, "port", (network ? "tcp://10.0.0.9:502" : "/dev/") + (network ? "" : own));
    if (line["serial_server"]) return line;
    Fill(line, "protocol", ProtocolOf(line["devices"]).value_or(base_.protocol));
    if (!line["devices"] || line["devices"].size() == 0) line["devices"] = List(YAML::Node());
    Each(line["devices"], &Completion::Device);
    return line;
  }
  /// Example: `points` at the level of the file becomes `lines: [{ devices: [{ points }] }]`.
  YAML::Node File(YAML::Node file) const {
    const auto move = [&file](const char* key, const auto& to) {
      if (!file[key]) return;
      const YAML::Node value = file[key];
      file.remove(key);
      to(value);
    };
    move("points",
         [&](const YAML::Node& points) { file["devices"] = List(Map("points", points)); });
    move("devices",
         [&](const YAML::Node& devices) { file["lines"] = List(Map("devices", devices)); });
    for (const char* key : {"listen", "routes"}) {
      move(key, [&](const YAML::Node& value) { file["modbus"][key] = value; });
    }
    if (!file["lines"]) file["lines"] = List(YAML::Node());
    AddLinesOfRoutes(file);
    if (!file["events"]) file["events"] = YAML::Node(YAML::NodeType::Map);
    if (file["history"].IsMap() && !file["history"]["points"]) {
      YAML::Node all("*.*.*");
      all.SetTag("!");
      file["history"]["points"] = List(all);
    }
    Each(file["lines"], &Completion::Line);
    return file;
  }
  YAML::Node Profile(YAML::Node profile) const {
    Fill(profile, "device", "x");
    if (!profile["points"]) profile["points"] = List(YAML::Node(YAML::NodeType::Map));
    Each(profile["points"], &Completion::Point);
    if (!profile["events"].IsSequence()) return profile;
    for (const YAML::Node& event : profile["events"]) {
      const YAML::Node record = event["record"];
      if (record && !profile["records"][record.Scalar()]) {
        profile["records"][record.Scalar()] = Map("points", List(profile["points"][0]["name"]));
      }
    }
    return profile;
  }

 private:
  static void Fill(YAML::Node& map, const char* key, const std::string& value) {
    if (!map[key]) map[key] = value;
  }
  static std::optional<std::string> ProtocolOf(const YAML::Node& devices) {
    if (!devices || !devices.IsSequence()) return std::nullopt;
    for (const YAML::Node& device : devices) {
      if (!device.IsMap() || !device["profile"]) continue;
      for (const Base& base : kBases) {
        if (Shipped().FindProfile(base.protocol, device["profile"].Scalar())) return base.protocol;
      }
    }
    return std::nullopt;
  }
  static void AddLinesOfRoutes(YAML::Node& file) {
    if (!file["modbus"].IsMap() || !file["modbus"]["routes"].IsSequence()) return;
    for (const YAML::Node& route : file["modbus"]["routes"]) {
      if (!route["line"]) continue;
      const auto is_it = [&](const YAML::Node& line) {
        return line.IsMap() && line["name"] && line["name"].Scalar() == route["line"].Scalar();
      };
      if (std::none_of(file["lines"].begin(), file["lines"].end(), is_it)) {
        file["lines"].push_back(Map("name", route["line"]));
      }
    }
  }
  void Each(YAML::Node list, YAML::Node (Completion::*complete)(YAML::Node) const) const {
    if (!list.IsSequence()) return;
    for (std::size_t i = 0; i < list.size(); ++i) list[i] = (this->*complete)(list[i]);
  }

  const Base& base_;
};

YAML::Node Listed(const YAML::Node& piece) { return piece.IsMap() ? List(piece) : piece; }

using Level = YAML::Node (*)(YAML::Node& piece);
constexpr Level kLevels[] = {
    [](YAML::Node& piece) { return piece; },
    [](YAML::Node& piece) { return Map("lines", Listed(piece)); },
    [](YAML::Node& piece) { return Map("devices", Listed(piece)); },
    [](YAML::Node& piece) { return Map("points", Listed(piece)); },
    [](YAML::Node& piece) {
      if (piece.IsMap() && !piece["on"]) piece["on"] = "change";
      return Map("points", List(Map("events", Listed(piece))));
    },
    [](YAML::Node& piece) {
      if (!piece.IsMap()) return piece;
      piece["point"] = "l.d.p";
      if (!piece["is"]) piece["is"] = "1";
      YAML::Node guarded = Map("points", List(Map("allow_when", piece)));
      guarded["address"] = "2";
      YAML::Node line = Map("devices", List(Map("name", YAML::Node("d"))));
      line["devices"].push_back(guarded);
      line["name"] = "l";
      return Map("lines", List(line));
    },
    [](YAML::Node& piece) { return Map("gateway", piece); },
    [](YAML::Node& piece) { return Map("modbus", piece); },
    [](YAML::Node& piece) {
      if (piece.IsMap() && !piece["at"])
        piece["at"] = piece["framing"] ? "/dev/m" : "127.0.0.1:1502";
      return Map("listen", Listed(piece));
    },
    [](YAML::Node& piece) {
      if (!piece.IsMap()) return piece;
      piece["units"] = "5";
      piece["server"] = "10.0.0.9";
      return Map("routes", List(piece));
    },
    [](YAML::Node& piece) { return Map("dds", piece); },
    [](YAML::Node& piece) {
      if (piece.IsMap() && !piece["broker"]) piece["broker"] = "mqtt://10.0.0.9";
      if (piece.IsMap() && piece["primary_host"]) piece["payload"] = "sparkplug";
      return Map("mqtt", piece);
    },
    [](YAML::Node& piece) { return Map("web", piece); },
    [](YAML::Node& piece) { return Map("history", piece); },
    [](YAML::Node& piece) { return Map("lines", List(Map("serial", piece))); },
    [](YAML::Node& piece) {
      if (piece.IsMap() && !piece["at"]) piece["at"] = "127.0.0.1:4001";
      return Map("lines", List(Map("serial_server", piece)));
    },
    [](YAML::Node& piece) { return Map("devices", List(Map("timing", piece))); },
};
/// Only these levels depend on the protocol, so the other levels are tried once.
constexpr std::size_t kLevelsOfProtocols = 4;
constexpr Level kProfileLevels[] = {
    [](YAML::Node& piece) { return piece; },
    [](YAML::Node& piece) {
      if (piece.IsMap() && !piece["code"]) piece["code"] = "1";
      if (piece.IsMap() && !piece["text"]) piece["text"] = "x";
      return Map("events", Listed(piece));
    },
};

/// Stores the problems of the attempt with the fewest problems. An unknown key counts as 100
/// problems, because it shows that the piece was read at a wrong level.
class Attempts {
 public:
  bool done() const { return nearest_ && nearest_->empty(); }
  void Take(const std::vector<config::Problem>& problems) {
    std::vector<config::Problem> errors;
    std::size_t distance = 0;
    for (const config::Problem& one : problems) {
      if (one.warning) continue;
      errors.push_back(one);
      distance += one.message.find("unknown key") == std::string::npos ? 1 : 100;
    }
    if (nearest_ && distance >= distance_) return;
    nearest_ = errors;
    distance_ = distance;
  }
  std::string Text() const { return nearest_ ? Shown(*nearest_) : "it is no YAML"; }

 private:
  std::optional<std::vector<config::Problem>> nearest_;
  std::size_t distance_ = 0;
};

std::string Printed(const YAML::Node& node) {
  std::string printed;
  Print(node, "", printed);
  return printed;
}

void Try(const std::string& text, const std::string& file, Attempts& attempts) {
  const config::Catalog& catalog = Shipped();
  for (const Base& base : kBases) {
    const Completion completion(base);
    const bool has_profile = *base.profile != '\0';
    for (const Level level :
         std::span(kLevels).first(has_profile ? kLevelsOfProtocols : std::size(kLevels))) {
      YAML::Node piece = YAML::Load(text);
      const YAML::Node whole = level(piece);
      if (!whole.IsMap()) continue;
      attempts.Take(config::LoadText(Printed(completion.File(whole)), file, catalog).problems);
      if (attempts.done()) return;
    }
    for (const Level level : kProfileLevels) {
      YAML::Node piece = YAML::Load(text);
      const YAML::Node whole = level(piece);
      if (!whole.IsMap()) continue;
      const protocols::Protocol& protocol = *catalog.FindProtocol(base.protocol);
      attempts.Take(
          config::LoadProfileText(Printed(completion.Profile(whole)), file, "x", protocol, catalog)
              .problems);
      if (attempts.done()) return;
    }
  }
}

std::string Refusal(const Piece& piece) {
  Attempts attempts;
  for (const bool keys : {false, true}) {
    try {
      Try(WithoutDots(piece.text, keys), piece.file, attempts);
    } catch (const YAML::Exception&) {
    }
    if (attempts.done()) return {};
  }
  return attempts.Text();
}

Lines Documents() {
  Lines files = {"README.md", "CONTRIBUTING.md", "CHANGELOG.md"};
  for (const char* folder : {"docs", "protocols", "config", "packaging"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (entry.path().extension() == ".md") files.push_back(entry.path().string());
    }
  }
  std::ranges::sort(files);
  return files;
}

TEST(Docs, EveryPieceOfYamlIsAccepted) {
  std::size_t pieces = 0;
  std::set<const Exception*> used;
  std::set<std::string> seen;
  for (const std::string& file : Documents()) {
    for (const Piece& piece : Document(file).Pieces()) {
      ++pieces;
      const auto except = std::ranges::find_if(kExceptions, [&](const Exception& one) {
        return one.file == piece.file && piece.text.starts_with(one.begins);
      });
      if (except != std::end(kExceptions)) {
        used.insert(except);
        continue;
      }
      if (!seen.insert(piece.text).second) continue;
      const std::string refusal = Refusal(piece);
      EXPECT_TRUE(refusal.empty()) << piece.file << ":" << piece.line << "\n"
                                   << piece.text << refusal;
    }
  }
  EXPECT_GT(pieces, 200U);
  EXPECT_EQ(used.size(), std::size(kExceptions)) << "an exception that nothing needs";
}

TEST(Docs, ThePackagedFileIsAccepted) {
  const auto loaded = config::LoadFile("packaging/baudgate.yaml", Shipped());
  EXPECT_EQ(Shown(loaded.problems), "");
}

}  // namespace
}  // namespace baudgate::testing
