// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/structured_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/tools/cli/offline/map_place.h"

namespace baudgate {
namespace {

constexpr int kBitsOfAWord = 16;

/// "feeder-1" and "current_l1" → "feeder_1_current_l1".
std::string Identifier(const std::string& device, const std::string& point) {
  std::string name = device + "_" + point;
  for (char& c : name) {
    if (c == '-') c = '_';
  }
  const auto twice = [](char a, char b) { return a == '_' && b == '_'; };
  name.erase(std::unique(name.begin(), name.end(), twice), name.end());
  return name.front() >= '0' && name.front() <= '9' ? "_" + name : name;
}

/// A register is a word, whatever stands in it.
std::string TypeAt(const config::Point& point, const MapPlace& place) {
  if (place.bit) return "BOOL";
  if (point.type == config::Type::boolean) return "WORD";
  if (point.type == config::Type::int8) return "INT";
  if (point.type == config::Type::uint8) return "UINT";
  return config::IecName(point);
}

/// One side of a device's points, inputs or outputs: its registers, and behind them its bits.
class Area {
 public:
  /// `letter`: I or Q; `next`: the first word that is free, which moves behind the area.
  Area(char letter, const config::Device& device, int& next) : letter_(letter) {
    for (const config::Point& point : device.points) {
      const MapPlace place = PlaceOf(device, point);
      if (Has(place)) (place.bit ? bits_ : words_).Take(place);
    }
    words_.base = next;
    bits_.base = words_.base + words_.size();
    next = bits_.base + (bits_.size() + kBitsOfAWord - 1) / kBitsOfAWord;
  }

  bool Has(const MapPlace& place) const {
    return place.served && !(letter_ == 'I' ? place.read_codes : place.write_codes).empty();
  }
  bool empty() const { return words_.size() == 0 && bits_.size() == 0; }

  std::string AddressOf(const MapPlace& place) const {
    if (!place.bit) {
      return fmt::format("%{}W{}", letter_, words_.base + place.address - words_.first);
    }
    const int bit = place.address - bits_.first;
    return fmt::format("%{}X{}.{}", letter_, 2 * bits_.base + bit / 8, bit % 8);
  }

  /// What the PLC's Modbus client is set to.
  void PrintOrders(std::ostream& out) const {
    const bool input = letter_ == 'I';
    if (words_.size() > 0) {
      out << fmt::format("  (* {} {} from {} (function {}): %{}W{}{} *)\n",
                         input ? "read" : "write", Of(words_, "register"), words_.first,
                         input ? "4 or 3" : "16", letter_, words_.base,
                         input ? "" : "; each by itself where there are holes");
    }
    if (bits_.size() > 0) {
      out << fmt::format("  (* {} {} from {} (function {}): %{}X{}.0{} *)\n",
                         input ? "read" : "write", Of(bits_, "bit"), bits_.first,
                         input ? "2 or 1" : "15", letter_, 2 * bits_.base,
                         input ? "" : "; each by itself where there are holes");
    }
  }

 private:
  struct Span {
    int first = -1;
    int end = 0;
    int base = 0;

    void Take(const MapPlace& place) {
      first = first < 0 ? place.address : std::min(first, place.address);
      end = std::max(end, place.address + place.registers);
    }
    int size() const { return first < 0 ? 0 : end - first; }
  };
  static std::string Of(const Span& span, const char* what) {
    return Plural(static_cast<std::size_t>(span.size()), what);
  }

  const char letter_;
  Span words_;
  Span bits_;
};

void PrintVariables(const config::Device& device, const Area& area, const std::string& suffix,
                    std::ostream& out) {
  for (const config::Point& point : device.points) {
    const MapPlace place = PlaceOf(device, point);
    if (!area.Has(place)) continue;
    std::string text = point.description;
    for (std::size_t at = 0; (at = text.find("*)", at)) != std::string::npos;) text[at] = '.';
    out << fmt::format("  {} AT {} : {}; (* {} {}{}{}{}{} *)\n",
                       Identifier(device.name, point.name) + suffix, area.AddressOf(place),
                       TypeAt(point, place), place.bit ? "bit" : "register", place.address,
                       point.unit.empty() ? "" : ", ", point.unit, text.empty() ? "" : ", ", text);
  }
}

}  // namespace

void PrintStructuredText(const config::Config& config, std::ostream& out) {
  out << "(* Points of gateway " << config.name
      << ". Each unit is a Modbus slave of the PLC; the comments say which of its registers are\n"
         "   copied where. %IW0 is %IX0.0 to %IX1.7. Values of several registers have the word "
         "order of their unit. *)\n";
  int next_input = 0;
  int next_output = 0;
  ForEachDevice(config, [&](const config::Line& line, const config::Device& device) {
    const Area inputs('I', device, next_input);
    const Area outputs('Q', device, next_output);
    if (inputs.empty() && outputs.empty()) return;
    out << fmt::format("\nVAR_GLOBAL (* {} on line {}: unit {}, word order {} *)\n", device.name,
                       line.name, *device.unit, config::Name(device.word_order));
    inputs.PrintOrders(out);
    PrintVariables(device, inputs, "", out);
    outputs.PrintOrders(out);
    PrintVariables(device, outputs, "_set", out);
    out << "END_VAR\n";
  });
}

}  // namespace baudgate
