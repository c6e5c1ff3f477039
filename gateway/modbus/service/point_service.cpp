// Answers requests from the point store and hands writes to the lines.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/service/point_service.h"

#include <algorithm>
#include <utility>

#include "gateway/modbus/registers/event_block.h"
#include "gateway/modbus/registers/write_request.h"

namespace baudgate::modbus {

PointService::PointService(const config::Config& config, const PointStore& store, CommandSink& sink,
                           std::function<GatewayBlock()> block, const ModbusLinks& links)
    : store_(store),
      gate_(store, sink),
      block_(std::move(block)),
      map_(config),
      events_(links.events),
      acks_(store, links.alarms, links.writes) {
  pieces_.reserve(kMostBits);
  MakeImages();
}

void PointService::Apply(const config::Config& config) {
  map_ = RegisterMap(config);
  MakeImages();
}

void PointService::MakeImages() {
  images_ = {};
  for (std::size_t id = 0; id < images_.size(); ++id) {
    const UnitMap& unit = map_.unit(static_cast<std::uint8_t>(id));
    if (unit.kind == UnitMap::Kind::device) images_[id] = std::make_unique<RegisterImage>(unit);
  }
}

ExceptionCode PointService::Check(View frame, ModbusRequest& request) const {
  if (map_.unit(UnitOf(frame)).kind == UnitMap::Kind::unmapped) return kNoPath;
  return ParseRequest(frame, request);
}

ExceptionCode PointService::Read(const ModbusRequest& request, Holes holes, Instant now,
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

std::optional<ExceptionCode> PointService::ReadImage(const ModbusRequest& request, Instant now) {
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

ExceptionCode PointService::ReadRecord(const ModbusRequest& request, const UnitMap& unit,
                                       Instant now) {
  struct Look {
    PointService& points;
    const ModbusRequest& request;
    Instant now;
    ExceptionCode exception = kNoException;
  } look{*this, request, now};
  // One captured reference keeps std::function off the heap.
  store_.Read(unit.device, [&look](const DeviceRecord& record) {
    PointService& self = look.points;
    look.exception =
        look.request.table() == config::Table::bits
            ? FillBits(record, self.pieces_, look.now, self.responder_.bits())
            : FillRegisters(record, self.pieces_, look.now, self.responder_.registers());
  });
  return look.exception;
}

ExceptionCode PointService::ReadGateway(const ModbusRequest& request) {
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
void PointService::FillEvents(const ModbusRequest& request, const UnitMap& unit,
                              std::uint64_t client) {
  const auto piece = std::ranges::find(pieces_, Area::events, &Piece::area);
  if (piece == pieces_.end()) return;
  const auto asked = first_events_.find({client, request.unit});
  const std::uint32_t first = asked == first_events_.end() ? 0 : asked->second;
  std::optional<events::Source> source;
  if (unit.kind == UnitMap::Kind::device) source = unit.device;
  const auto shown =
      events_ ? events_->Show(source, first, kShownEvents) : events::EventFeed::Shown{};
  FillFromBlock(EventBlockOf(shown, first), *piece, responder_.registers());
}

ExceptionCode PointService::Submit(const ModbusRequest& request, const Asker& asker, Instant now,
                                   Done done) {
  const Writer& writer = asker.writer;
  const UnitMap& unit = map_.unit(request.unit);
  if (IsFirstEvent(request)) {
    const auto first = FirstEvent(request);
    if (!first) return kIllegalValue;
    first_events_[{writer.number, request.unit}] = *first;
    done({});
    return kNoException;
  }
  if (AckRegister::IsFor(request)) return acks_.Submit(request, unit, writer, now, std::move(done));
  if (unit.kind != UnitMap::Kind::device) return kIllegalAddress;
  if (const auto point = SelectedPoint(unit, request)) {
    if (!IsSelectKey(request)) return kIllegalValue;
    if (const auto denial = gate_.Select(writer, unit.device, *point, now)) {
      return ExceptionOf(*denial);
    }
    done({});
    return kNoException;
  }
  ConvertedWrite converted = ConvertWrites(unit, store_.device(unit.device), request);
  if (converted.exception != kNoException) return converted.exception;
  const auto denial = gate_.Submit(writer,
                                   {.device = unit.device,
                                    .parts = std::move(converted.parts),
                                    .deadline = asker.deadline,
                                    .abandoned = asker.abandoned,
                                    .done = std::move(done)},
                                   now);
  return denial ? ExceptionOf(*denial) : kNoException;
}

void PointService::Forget(const Writer& writer) {
  gate_.Forget(writer);
  std::erase_if(first_events_, [&](const auto& of) { return of.first.first == writer.number; });
}

void PointService::Deny(View frame, const Writer& writer, const WriteResult& refused,
                        const Now& now) {
  ModbusRequest request;
  if (!IsPlainWrite(FunctionOf(frame)) || Check(frame, request) != kNoException) return;
  const UnitMap& unit = map_.unit(request.unit);
  if (AckRegister::IsFor(request)) return acks_.Deny(request, unit, writer, refused, now);
  if (unit.kind != UnitMap::Kind::device) return;
  ConvertedWrite converted = ConvertWrites(unit, store_.device(unit.device), request);
  gate_.Deny(writer, {.device = unit.device, .parts = std::move(converted.parts)}, refused.reason,
             refused.end);
}

ExceptionCode PointService::ExceptionOf(const WriteDenial& denial) {
  switch (denial.why) {
    case WriteDenial::Why::read_only:
      return kIllegalAddress;
    case WriteDenial::Why::value:
      return kIllegalValue;
    case WriteDenial::Why::busy:
      return kBusy;
    case WriteDenial::Why::not_selected:
    case WriteDenial::Why::locked:
      break;
  }
  return kDeviceFailure;
}

ExceptionCode PointService::ExceptionOf(const WriteResult& result) {
  if (result.unfit) return kIllegalValue;
  switch (result.end) {
    case WriteEnd::ok:
      return kNoException;
    case WriteEnd::differs:
    case WriteEnd::refused:
    case WriteEnd::denied:
      return kDeviceFailure;
    case WriteEnd::busy:
      return kBusy;
    case WriteEnd::unknown:
    case WriteEnd::not_sent:
      break;
  }
  return kNoTarget;
}

}  // namespace baudgate::modbus
