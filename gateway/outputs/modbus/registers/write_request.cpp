// FC 5, 6, 15 and 16 become points and their values, as users see them.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/write_request.h"

#include <array>
#include <utility>

#include "gateway/outputs/modbus/registers/value_registers.h"

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

std::optional<std::uint32_t> SelectedPoint(const UnitMap& unit, const ModbusRequest& request) {
  if (request.table() != config::Table::registers || request.count != 1) return std::nullopt;
  if (request.start < config::kSelectOffset) return std::nullopt;
  const auto found =
      unit.selects.find(static_cast<std::uint16_t>(request.start - config::kSelectOffset));
  if (found == unit.selects.end()) return std::nullopt;
  return found->second;
}

bool IsSelectKey(const ModbusRequest& request) {
  return ByteReader(request.data).U16Be(0) == config::kSelectKey;
}

bool IsFirstEvent(const ModbusRequest& request) {
  return request.table() == config::Table::registers && request.start >= config::kEventBlock &&
         request.start + request.count <= config::kEventBlock + 2;
}

std::optional<std::uint32_t> FirstEvent(const ModbusRequest& request) {
  if (request.count != 2) return std::nullopt;
  return ByteReader(request.data).U32Be(0);
}

ConvertedWrite ConvertWrites(const UnitMap& unit, const config::Device& device,
                             const ModbusRequest& request) {
  std::vector<Piece> pieces;
  const config::Table table = request.table();
  const auto exception = PlanWrite(unit, table, request.start, request.count, pieces);
  if (exception != kNoException) return {exception};

  std::array<std::uint16_t, kMostWrittenRegisters> registers{};
  if (table == config::Table::registers) {
    const ByteReader data(request.data);
    for (std::size_t i = 0; i < request.count; ++i) registers[i] = data.U16Be(2 * i).value_or(0);
  }
  ConvertedWrite converted;
  for (const Piece& piece : pieces) {
    const config::Point& point = device.points[piece.index];
    const Value value =
        table == config::Table::bits
            ? BitValue(point, BitOf(request, piece.offset))
            : DecodeRegisters(point, device.word_order,
                              std::span(registers).subspan(piece.offset, piece.count))
                  .value_or(Value());
    if (!HasValue(value)) return {kIllegalValue};
    converted.parts.push_back({piece.index, value});
  }
  return converted;
}

}  // namespace baudgate::modbus
