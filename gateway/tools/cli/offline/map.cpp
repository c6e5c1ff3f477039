// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/map.h"

#include <nlohmann/json.hpp>

#include "config/loader.h"
#include "config/model/modbus_addresses.h"
#include "gateway/base/exit_code.h"
#include "gateway/tools/cli/offline/check.h"
#include "gateway/tools/cli/offline/map_place.h"
#include "gateway/tools/cli/offline/structured_text.h"
#include "gateway/tools/cli/offline/type_text.h"
#include "gateway/tools/terminal/text_table.h"

namespace baudgate {
namespace {

using Json = nlohmann::ordered_json;
using config::kAgeOffset;
using config::kQualityOffset;
using config::TextTable;

/// What clients may do; empty: nothing.
std::string AccessText(const config::Point& point) {
  if (point.writing.allowed) return std::string(config::Name(point.access));
  return point.access == config::Access::write ? "" : "r";
}

// The order of words means nothing for values that take one register.
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

/// The register that is written before the point; empty: none is needed.
std::string SelectText(const MapPlace& place, const config::Point& point) {
  const bool selects = point.writing.select && point.writing.allowed;
  return selects ? Number(place, config::kSelectOffset) : "";
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
  out << "Addresses count from 0 as on the wire (mbpoll -0); PLC is the same place in 1-based "
         "notation.\n"
         "Each register N has its quality (OPC code) at N + 20000 and its age in 0.1 s at N + "
         "40000;"
         "\na bit N is good when the bit N + 20000 is set. Every unit has its device status block "
         "at 9000\nand its events at 9016 to 9095; units 0 and 255 are the gateway itself.\n";
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
  TextTable table({"line",    "device",   "modbus_unit", "point",  "table",
                   "read_fc", "write_fc", "address",     "plc",    "registers",
                   "type",    "order",    "unit",        "access", "group",
                   "quality", "age",      "dds_key",     "read",   "description"});
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
                 point.description});
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
      points.push_back({{"line", line.name},
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
                        {"dds_key", Key(config, device, point)}});
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

}  // namespace baudgate
