// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/unit_reader.h"

#include <algorithm>
#include <utility>

namespace baudgate::modbus {

UnitReader::UnitReader(const PointStore& store, const RegisterMap& map, const EventWindow& events,
                       std::function<GatewayBlock()> block)
    : store_(store), map_(map), events_(events), block_(std::move(block)) {
  pieces_.reserve(kMostBits);
  Renew();
}

void UnitReader::Renew() {
  images_ = {};
  for (std::size_t id = 0; id < images_.size(); ++id) {
    const UnitMap& unit = map_.unit(static_cast<std::uint8_t>(id));
    if (unit.kind == UnitMap::Kind::device) images_[id] = std::make_unique<RegisterImage>(unit);
  }
}

ExceptionCode UnitReader::Read(const ModbusRequest& request, Holes holes, Instant now,
                               std::uint64_t client) {
  if (const auto answer = ReadImage(request, now)) return *answer;
  const UnitMap& unit = map_.unit(request.unit);
  auto exception = PlanRead(unit, request.table(), request.start, request.count, pieces_, holes);
  if (exception != kNoException) return exception;
  exception =
      unit.kind == UnitMap::Kind::gateway ? ReadGateway(request) : ReadRecord(request, unit, now);
  if (exception == kNoException) FillEvents(request, unit, client);
  return exception;
}

std::optional<ExceptionCode> UnitReader::ReadImage(const ModbusRequest& request, Instant now) {
  RegisterImage* const image = images_[request.unit].get();
  if (image == nullptr) return std::nullopt;
  const auto place = image->Find(request.table(), request.start, request.count);
  if (!place) return std::nullopt;
  struct Look {
    RegisterImage& image;
    std::size_t count;
    Instant now;
    bool fresh = false;
  } look{*image, request.count, now};
  store_.Read(map_.unit(request.unit).device, [&look](const DeviceRecord& record) {
    look.fresh = look.image.Refresh(record, look.now, look.count);
  });
  if (!look.fresh) return std::nullopt;
  return place->table == config::Table::bits ? image->Copy(*place, responder_.bits())
                                             : image->Copy(*place, responder_.registers());
}

ExceptionCode UnitReader::ReadRecord(const ModbusRequest& request, const UnitMap& unit,
                                     Instant now) {
  struct Look {
    UnitReader& reader;
    const ModbusRequest& request;
    Instant now;
    ExceptionCode exception = kNoException;
  } look{*this, request, now};
  // One captured reference keeps std::function off the heap.
  store_.Read(unit.device, [&look](const DeviceRecord& record) {
    UnitReader& self = look.reader;
    look.exception =
        look.request.table() == config::Table::bits
            ? FillBits(record, self.pieces_, look.now, self.responder_.bits())
            : FillRegisters(record, self.pieces_, look.now, self.responder_.registers());
  });
  return look.exception;
}

ExceptionCode UnitReader::ReadGateway(const ModbusRequest& request) {
  if (request.table() != config::Table::registers) return kIllegalAddress;
  const GatewayBlock block = block_();
  for (const Piece& piece : pieces_) {
    if (piece.area == Area::status) {
      FillFromBlock(block, piece, responder_.registers());
    } else {
      std::ranges::fill(responder_.registers().subspan(piece.offset, piece.count), 0);
    }
  }
  return kNoException;
}

/// A device shows its own events, the gateway all.
void UnitReader::FillEvents(const ModbusRequest& request, const UnitMap& unit,
                            std::uint64_t client) {
  const auto piece = std::ranges::find(pieces_, Area::events, &Piece::area);
  if (piece == pieces_.end()) return;
  std::optional<events::Source> source;
  if (unit.kind == UnitMap::Kind::device) source = unit.device;
  FillFromBlock(events_.Show(client, request.unit, source), *piece, responder_.registers());
}

}  // namespace baudgate::modbus
