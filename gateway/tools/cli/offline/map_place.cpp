// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/map_place.h"

namespace baudgate {
namespace {

constexpr int kLastFiveDigitAddress = 9998;

// The 1-based notation of PLC manuals: five digits as long as they last, then six.
std::string Conventional(char table, int address) {
  const bool five = address <= kLastFiveDigitAddress;
  std::string number = std::to_string(address + 1);
  const std::size_t digits = five ? 4 : 5;
  number.insert(0, digits > number.size() ? digits - number.size() : 0, '0');
  return table + number;
}

}  // namespace

MapPlace PlaceOf(const config::Device& device, const config::Point& point) {
  MapPlace place;
  place.served = device.unit && point.modbus;
  if (!place.served) return place;
  const bool writable = point.writing.allowed;
  place.bit = point.table == config::Table::bits;
  place.address = *point.modbus;
  place.registers = place.bit ? 1 : static_cast<int>(config::RegisterCount(point));
  place.tables = place.bit ? "discrete, coil" : "input, holding";
  if (point.access != config::Access::write) place.read_codes = place.bit ? "2,1" : "4,3";
  if (writable && place.bit) place.write_codes = "5,15";
  if (writable && !place.bit) place.write_codes = place.registers == 1 ? "6,16" : "16";
  place.conventional = Conventional(place.bit ? '1' : '3', place.address) + "/" +
                       Conventional(place.bit ? '0' : '4', place.address);
  return place;
}

void ForEachDevice(const config::Config& config,
                   const std::function<void(const config::Line&, const config::Device&)>& visit) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) visit(line, device);
  }
}

}  // namespace baudgate
