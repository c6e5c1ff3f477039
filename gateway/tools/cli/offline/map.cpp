// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/map.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "config/loader.h"
#include "config/model/modbus.h"
#include "gateway/base/exit_code.h"
#include "gateway/base/shown.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/profiles.h"
#include "gateway/tools/terminal/tables.h"

namespace baudgate::tools {
namespace {

constexpr int kLastFiveDigitAddress = 9998;

// Returns a register number as in PLC manuals, counted from 1: five digits if they suffice, else
// six.
std::string Conventional(char table, int address) {
  const bool five = address <= kLastFiveDigitAddress;
  std::string number = std::to_string(address + 1);
  const std::size_t digits = five ? 4 : 5;
  number.insert(0, digits > number.size() ? digits - number.size() : 0, '0');
  return table + number;
}

void ForEachDevice(const config::Config& config,
                   const std::function<void(const config::Line&, const config::Device&)>& visit) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) visit(line, device);
  }
}

}  // namespace

MapPlace PlaceOf(const config::Device& device, const config::Point& point) {
  MapPlace place;
  place.served = device.unit && point.modbus;
  if (!place.served) return place;
  place.bit = point.table == config::Table::bits;
  place.address = *point.modbus;
  place.registers = static_cast<int>(config::PlacesOf(point));
  place.tables = place.bit ? "discrete, coil" : "input, holding";
  place.read_codes = fmt::format("{}", fmt::join(config::ReadFunctions(point), ","));
  place.write_codes = fmt::format("{}", fmt::join(config::WriteFunctions(point), ","));
  place.conventional = Conventional(place.bit ? '1' : '3', place.address) + "/" +
                       Conventional(place.bit ? '0' : '4', place.address);
  return place;
}

namespace {

using Json = nlohmann::ordered_json;
using config::kAgeOffset;
using config::kQualityOffset;

/// Returns what Modbus clients are allowed to do: "r", "rw"; empty: nothing.
std::string AccessText(const config::Point& point) {
  const auto access = config::AllowedAccess(point);
  return access ? std::string(config::Name(*access)) : "";
}

// Returns the word order, which matters only for values of several registers.
std::string OrderText(const config::Device& device, const MapPlace& place) {
  return place.served && place.registers > 1 ? std::string(config::Name(device.word_order)) : "";
}

std::string Number(const MapPlace& place, int offset) {
  return place.served ? std::to_string(place.address + offset) : "";
}

bool IsReadable(const config::Point& point) { return point.access != config::Access::write; }

std::string QualityText(const MapPlace& place, const config::Point& point) {
  return IsReadable(point) ? Number(place, kQualityOffset) : "";
}

std::string AgeText(const MapPlace& place, const config::Point& point) {
  return place.bit || !IsReadable(point) ? "" : Number(place, kAgeOffset);
}

/// Returns the number of the select register, to be written before the point is written; empty: the
/// point needs no selection.
std::string SelectText(const MapPlace& place, const config::Point& point) {
  const bool selects = point.writing.select && point.writing.allowed;
  return selects ? Number(place, config::kSelectOffset) : "";
}

/// Returns "0 off, 3 run"; empty: the point has no states.
std::string StatesText(const config::Point& point) {
  std::string text;
  for (const config::StateText& state : *point.states) {
    text += (text.empty() ? "" : ", ") + std::to_string(state.value) + " " + state.text;
  }
  return text;
}

std::string PrecisionText(const config::Point& point) {
  return point.precision ? std::to_string(*point.precision) : "";
}

std::string Key(const config::Config& config, const config::Device& device,
                const config::Point& point) {
  if (!config.dds.enabled) return "";
  return config.name + "/" + device.name + "/" + point.name;
}

TextTable DeviceTable(const config::Device& device) {
  TextTable table({"point", "address", "PLC", "regs", "type", "unit", "read FC", "write FC",
                   "select", "group", "quality", "age"});
  for (const config::Point& point : device.points) {
    const MapPlace place = PlaceOf(device, point);
    table.Add({point.name, Number(place, 0), place.conventional,
               place.served ? std::to_string(place.registers) : "", TypeText(point), point.unit,
               place.read_codes, place.write_codes, SelectText(place, point),
               config::PeriodText(point), QualityText(place, point), AgeText(place, point)});
  }
  return table;
}

void PrintDevice(const config::Config& config, const config::Line& line,
                 const config::Device& device, std::ostream& out) {
  out << "device " << device.name << " on line " << line.name << ": ";
  if (device.unit) {
    out << "unit " << static_cast<int>(*device.unit) << ", word order "
        << config::Name(device.word_order);
  } else {
    out << "not on Modbus (no unit)";
  }
  if (config.dds.enabled) out << "; DDS key " << config.name << "/" << device.name << "/POINT";
  out << '\n';
  const TextTable table = DeviceTable(device);
  if (!table.empty()) table.PrintAligned(out, "  ");
  out << '\n';
}

void PrintTable(const config::Config& config, std::ostream& out) {
  ForEachDevice(config, [&](const config::Line& line, const config::Device& device) {
    PrintDevice(config, line, device, out);
  });
  out << "Addresses count from 0 as on the wire (mbpoll -0); the column PLC counts from 1.\n"
         "Each register N has its quality (OPC code) at N + 20000 and its age in 0.1 s at N + "
         "40000;\n"
         "a bit N is good when the bit N + 20000 is set. Every unit has its device status block at "
         "9000\n"
         "and its events at 9016 to 9095; units 0 and 255 are the gateway itself.\n";
}

void PrintMarkdown(const config::Config& config, std::ostream& out) {
  out << "# Registers of " << config.name << '\n';
  ForEachDevice(config, [&](const config::Line& line, const config::Device& device) {
    out << "\n## " << device.name << "\n\n";
    if (!device.title.empty()) out << device.title << ", line " << line.name << ". ";
    out << (device.unit ? "Modbus unit " + std::to_string(*device.unit) + ", word order " +
                              std::string(config::Name(device.word_order))
                        : std::string("Not on Modbus (no unit)"))
        << ".\n\n";
    DeviceTable(device).PrintMarkdown(out);
  });
}

void PrintCsv(const config::Config& config, std::ostream& out) {
  TextTable table({"line",     "device",      "modbus_unit", "point",     "table", "read_fc",
                   "write_fc", "address",     "plc",         "registers", "type",  "order",
                   "unit",     "access",      "group",       "quality",   "age",   "dds_key",
                   "read",     "description", "precision",   "states"});
  ForEachDevice(config, [&](const config::Line& line, const config::Device& device) {
    for (const config::Point& point : device.points) {
      const MapPlace place = PlaceOf(device, point);
      table.Add({line.name,
                 device.name,
                 place.served ? std::to_string(*device.unit) : "",
                 point.name,
                 place.tables,
                 place.read_codes,
                 place.write_codes,
                 Number(place, 0),
                 place.conventional,
                 place.served ? std::to_string(place.registers) : "",
                 TypeText(point),
                 OrderText(device, place),
                 point.unit,
                 AccessText(point),
                 config::PeriodText(point),
                 QualityText(place, point),
                 AgeText(place, point),
                 Key(config, device, point),
                 point.read,
                 point.description,
                 PrecisionText(point),
                 StatesText(point)});
    }
  });
  table.PrintCsv(out);
}

Json ModbusJson(const config::Device& device, const config::Point& point, const MapPlace& place) {
  if (!place.served) return nullptr;
  Json json = {{"unit", *device.unit},          {"table", place.bit ? "bits" : "registers"},
               {"address", place.address},      {"registers", place.registers},
               {"plc", place.conventional},     {"read_fc", place.read_codes},
               {"write_fc", place.write_codes}, {"word_order", OrderText(device, place)}};
  if (IsReadable(point)) json["quality"] = place.address + kQualityOffset;
  if (IsReadable(point) && !place.bit) json["age"] = place.address + kAgeOffset;
  if (!SelectText(place, point).empty()) json["select"] = place.address + config::kSelectOffset;
  return json;
}

void PrintJson(const config::Config& config, std::ostream& out) {
  Json points = Json::array();
  ForEachDevice(config, [&](const config::Line& line, const config::Device& device) {
    for (const config::Point& point : device.points) {
      Json one = {{"line", line.name},
                  {"device", device.name},
                  {"point", point.name},
                  {"type", TypeText(point)},
                  {"iec", config::IecName(point)},
                  {"unit", point.unit},
                  {"access", AccessText(point)},
                  {"group", config::PeriodText(point)},
                  {"read", point.read},
                  {"description", *point.description},
                  {"modbus", ModbusJson(device, point, PlaceOf(device, point))},
                  {"dds_key", Key(config, device, point)}};
      if (point.precision) one["precision"] = *point.precision;
      for (const config::StateText& state : *point.states) {
        one["states"][std::to_string(state.value)] = state.text;
      }
      points.push_back(std::move(one));
    }
  });
  const Json result = {{"gateway", config.name}, {"points", std::move(points)}};
  out << result.dump(2, ' ', false, Json::error_handler_t::replace) << '\n';
}

}  // namespace

int RunMap(const std::string& file, const config::Catalog& catalog, MapFormat format,
           std::ostream& out, std::ostream& err) {
  const config::Loaded loaded = config::LoadFile(file, catalog);
  PrintProblems(loaded.problems, err);
  if (!loaded.ok()) return kExitBadConfiguration;
  switch (format) {
    case MapFormat::table:
      PrintTable(loaded.config, out);
      break;
    case MapFormat::csv:
      PrintCsv(loaded.config, out);
      break;
    case MapFormat::structured_text:
      PrintStructuredText(loaded.config, out);
      break;
    case MapFormat::markdown:
      PrintMarkdown(loaded.config, out);
      break;
    case MapFormat::json:
      PrintJson(loaded.config, out);
      break;
  }
  return 0;
}

namespace {

constexpr int kBitsOfAWord = 16;

/// Returns a PLC identifier. Example: "feeder-1" and "current_l1" → "feeder_1_current_l1".
std::string Identifier(const std::string& device, const std::string& point) {
  std::string name = device + "_" + point;
  for (char& c : name) {
    if (c == '-') c = '_';
  }
  const auto twice = [](char a, char b) { return a == '_' && b == '_'; };
  name.erase(std::unique(name.begin(), name.end(), twice), name.end());
  return name.front() >= '0' && name.front() <= '9' ? "_" + name : name;
}

/// Returns the IEC type. A register is a word, so a boolean in a register is a WORD.
std::string TypeAt(const config::Point& point, const MapPlace& place) {
  if (place.bit) return "BOOL";
  if (point.type == config::Type::boolean) return "WORD";
  if (point.type == config::Type::int8) return "INT";
  if (point.type == config::Type::uint8) return "UINT";
  return config::IecName(point);
}

/// The addresses of one device in the PLC's inputs or in its outputs: registers, then bits.
class Area {
 public:
  /// `letter`: I for inputs, Q for outputs. `next` is the first free word; the constructor sets it
  /// to the first word behind this area.
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

  /// Prints comments with the registers and bits that the PLC's Modbus client must copy.
  void PrintOrders(std::ostream& out) const {
    const bool input = letter_ == 'I';
    if (words_.size() > 0) {
      out << fmt::format("  (* {} {} from {} (function {}): %{}W{}{} *)\n",
                         input ? "read" : "write", Of(words_, "register"), words_.first,
                         input ? "4 or 3" : "16", letter_, words_.base,
                         input ? "" : "; where an address is missing, write each value by itself");
    }
    if (bits_.size() > 0) {
      out << fmt::format("  (* {} {} from {} (function {}): %{}X{}.0{} *)\n",
                         input ? "read" : "write", Of(bits_, "bit"), bits_.first,
                         input ? "2 or 1" : "15", letter_, 2 * bits_.base,
                         input ? "" : "; where an address is missing, write each value by itself");
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
    if (point.states) text += (text.empty() ? "" : ": ") + StatesText(point);
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
      << ". Each unit is a Modbus slave of the PLC; the comments show where its registers are\n"
         "   copied to. %IW0 is %IX0.0 to %IX1.7. Values of several registers have the word order "
         "of their unit. *)\n";
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

}  // namespace baudgate::tools
