// FC 5, 6, 15 and 16 become points and raw values.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/registers/write_request.h"

#include <array>
#include <utility>

#include "gateway/modbus/registers/value_registers.h"
#include "gateway/store/conversion.h"

namespace baudgate::modbus {
namespace {

bool BitOf(const ModbusRequest& request, std::size_t at) {
  if (request.function == kWriteCoil) return request.data[0] == 0xFF;
  return ((request.data[at / 8] >> (at % 8)) & 1U) != 0;
}

Value BitValue(const config::Point& point, bool bit) {
  if (point.type == config::Type::boolean) return bit;
  return std::int64_t{bit ? 1 : 0};
}

}  // namespace

Writes ConvertWrites(const UnitMap& unit, const config::Device& device,
                     const ModbusRequest& request) {
  std::vector<Piece> pieces;
  const config::Table table = request.table();
  const auto exception = PlanWrite(unit, table, request.start, request.count, pieces);
  if (exception != kNoException) return {exception, {}};

  std::array<std::uint16_t, kMostWrittenRegisters> registers{};
  if (table == config::Table::registers) {
    const ByteReader data(request.data);
    for (std::size_t i = 0; i < request.count; ++i) registers[i] = data.U16Be(2 * i).value_or(0);
  }
  Writes converted;
  for (const Piece& piece : pieces) {
    const config::Point& point = device.points[piece.index];
    const Value value =
        table == config::Table::bits
            ? BitValue(point, BitOf(request, piece.offset))
            : DecodeRegisters(point, device.word_order,
                              std::span(registers).subspan(piece.offset, piece.count))
                  .value_or(Value());
    auto raw = ToRaw(point, value);  // an error where the registers hold no value
    if (!raw) return {kIllegalValue, {}};
    converted.writes.push_back({piece.index, std::move(*raw)});
  }
  return converted;
}

}  // namespace baudgate::modbus
