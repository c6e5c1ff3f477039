// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/own_units.h"

#include <algorithm>
#include <utility>

#include "gateway/outputs/modbus/registers/register_map.h"

namespace baudgate::modbus {

EventBlock EventWindow::Show(std::uint64_t client, std::uint8_t unit,
                             std::optional<events::Source> source) const {
  const auto asked = firsts_.find({client, unit});
  const std::uint32_t first = asked == firsts_.end() ? 0 : asked->second;
  const auto shown =
      events_ ? events_->Show(source, first, kShownEvents) : events::EventFeed::Page{};
  return EventBlockOf(shown, first);
}

void EventWindow::Forget(std::uint64_t client) {
  std::erase_if(firsts_, [&](const auto& entry) { return entry.first.first == client; });
}

namespace {

std::optional<std::uint32_t> NumberOf(const ModbusRequest& request) {
  if (request.count != 2) return std::nullopt;
  return ByteReader(request.data).U32Be(0);
}

}  // namespace

bool AckRegister::IsFor(const ModbusRequest& request) {
  return request.table() == config::Table::registers && request.start >= kAckRegister &&
         request.start + request.count <= kAckRegister + 2;
}

/// Returns the record of an acknowledgement, in the form of a write to a point named "alarms".
audit::WriteRecord AckRegister::RecordOf(const ModbusRequest& request, const UnitMap& unit,
                                         const bus::Writer& writer) const {
  audit::WriteRecord record;
  record.client = writer.name;
  record.point = "alarms";
  const auto number = NumberOf(request);
  if (number == kAll) {
    record.value = std::string("all");
  } else if (number) {
    record.value = std::int64_t{*number};
  }
  if (unit.kind != UnitMap::Kind::device) return record;
  store_.Read(unit.device, [&](const bus::DeviceRecord& of) {
    record.line = of.line->name;
    record.device = of.device->name;
  });
  return record;
}

ExceptionCode AckRegister::Submit(const ModbusRequest& request, const UnitMap& unit,
                                  const bus::Writer& writer, Instant now,
                                  std::function<void(const WriteResult&)> done) {
  if (alarms_ == nullptr) return kIllegalAddress;
  const auto number = NumberOf(request);
  if (!number) return kIllegalValue;
  audit::WriteRecord record = RecordOf(request, unit, writer);
  events::AckQuery query;
  query.line = record.line;
  query.device = record.device;
  query.all = unit.kind != UnitMap::Kind::device;
  if (*number != kAll) query.number = *number;
  query.by = "modbus " + writer.name;
  const bool wants_one = *number != kAll;
  const auto told = [=, log = log_,
                     done = std::move(done)](const events::Acknowledged& ack) mutable {
    if (ack.alarms == 0 && wants_one) return;
    const bool kept = ack.trouble.empty();
    record.time = record.last = ack.at;
    record.end = kept ? WriteEnd::ok : WriteEnd::unknown;
    record.reason = ack.trouble;
    if (log != nullptr) log->Note(record, now);
    done({.end = *record.end, .reason = record.reason});
  };
  const std::size_t alarms = alarms_->Acknowledge(query, told);
  return alarms == 0 && wants_one ? kIllegalValue : kNoException;
}

void AckRegister::Deny(const ModbusRequest& request, const UnitMap& unit, const bus::Writer& writer,
                       const WriteResult& refused, Now now) {
  if (alarms_ == nullptr || log_ == nullptr) return;
  audit::WriteRecord record = RecordOf(request, unit, writer);
  record.kind = audit::Kind::denied;
  record.time = record.last = now.wall;
  record.end = refused.end;
  record.reason = refused.reason;
  log_->Note(std::move(record), now.instant);
}

ExceptionCode ExceptionOf(const bus::WriteDenial& denial) {
  switch (denial.why) {
    case bus::WriteDenial::Why::read_only:
      return kIllegalAddress;
    case bus::WriteDenial::Why::value:
      return kIllegalValue;
    case bus::WriteDenial::Why::busy:
      return kBusy;
    case bus::WriteDenial::Why::not_selected:
    case bus::WriteDenial::Why::locked:
    case bus::WriteDenial::Why::changed:
      break;
  }
  return kDeviceFailure;
}

ExceptionCode ExceptionOf(const WriteResult& result) {
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

OwnUnits::OwnUnits(const config::Config& config, const bus::PointStore& store,
                   bus::CommandSink& sink, std::function<GatewayBlock()> block,
                   std::shared_ptr<const events::EventFeed> events, const AckRegister& acks)
    : store_(store),
      map_(config),
      events_(std::move(events)),
      block_(std::move(block)),
      gate_(store, sink),
      acks_(acks) {
  pieces_.reserve(kMostBits);
  MakeImages();
}

void OwnUnits::Apply(const config::Config& config) {
  map_ = RegisterMap(config);
  MakeImages();
}

void OwnUnits::MakeImages() {
  images_ = {};
  for (std::size_t id = 0; id < images_.size(); ++id) {
    const UnitMap& unit = map_.unit(static_cast<std::uint8_t>(id));
    if (unit.kind == UnitMap::Kind::device) images_[id] = std::make_unique<RegisterImage>(unit);
  }
}

ExceptionCode OwnUnits::Check(View frame, ModbusRequest& request) const {
  if (map_.unit(UnitOf(frame)).kind == UnitMap::Kind::unmapped) return kNoPath;
  return ParseRequest(frame, request);
}

ExceptionCode OwnUnits::Read(const ModbusRequest& request, Holes holes, Instant now,
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

std::optional<ExceptionCode> OwnUnits::ReadImage(const ModbusRequest& request, Instant now) {
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
  store_.Read(map_.unit(request.unit).device, [&look](const bus::DeviceRecord& record) {
    look.fresh = look.image.Refresh(record, look.now, look.count);
  });
  if (!look.fresh) return std::nullopt;
  return place->table == config::Table::bits ? image->Copy(*place, responder_.bits())
                                             : image->Copy(*place, responder_.registers());
}

ExceptionCode OwnUnits::ReadRecord(const ModbusRequest& request, const UnitMap& unit, Instant now) {
  struct Look {
    OwnUnits& reader;
    const ModbusRequest& request;
    Instant now;
    // The result if the store no longer has the device.
    ExceptionCode exception = kDeviceFailure;
  } look{*this, request, now};
  // A lambda that captures only one reference needs no heap memory in std::function.
  store_.Read(unit.device, [&look](const bus::DeviceRecord& record) {
    OwnUnits& self = look.reader;
    look.exception =
        look.request.table() == config::Table::bits
            ? FillBits(record, self.pieces_, look.now, self.responder_.bits())
            : FillRegisters(record, self.pieces_, look.now, self.responder_.registers());
  });
  return look.exception;
}

ExceptionCode OwnUnits::ReadGateway(const ModbusRequest& request) {
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

/// Fills the registers of the event block. The unit of a device shows the device's events, a unit
/// of the gateway the events of all devices.
void OwnUnits::FillEvents(const ModbusRequest& request, const UnitMap& unit, std::uint64_t client) {
  const auto piece = std::ranges::find(pieces_, Area::events, &Piece::area);
  if (piece == pieces_.end()) return;
  std::optional<events::Source> source;
  if (unit.kind == UnitMap::Kind::device) source = unit.device;
  FillFromBlock(events_.Show(client, request.unit, source), *piece, responder_.registers());
}

ExceptionCode OwnUnits::Write(const ModbusRequest& request, const Asker& asker, Instant now,
                              std::function<void(const WriteResult&)> done) {
  const bus::Writer& writer = asker.writer;
  const UnitMap& unit = map_.unit(request.unit);
  if (IsFirstEvent(request)) {
    const auto first = FirstEvent(request);
    if (!first) return kIllegalValue;
    events_.SetFirst(writer.number, request.unit, *first);
    done({});
    return kNoException;
  }
  if (AckRegister::IsFor(request)) return acks_.Submit(request, unit, writer, now, std::move(done));
  if (unit.kind != UnitMap::Kind::device) return kIllegalAddress;
  const auto point = SelectedPoint(unit, request);
  if (!point) return WritePoints(unit, request, asker, now, std::move(done));
  const ExceptionCode exception = Select(unit, *point, request, writer, now);
  if (exception == kNoException) done({});
  return exception;
}

ExceptionCode OwnUnits::Select(const UnitMap& unit, std::uint32_t point,
                               const ModbusRequest& request, const bus::Writer& writer,
                               Instant now) {
  if (!IsSelectKey(request)) return kIllegalValue;
  const auto denial = gate_.Select(writer, unit.device, point, now);
  return denial ? ExceptionOf(*denial) : kNoException;
}

ExceptionCode OwnUnits::WritePoints(const UnitMap& unit, const ModbusRequest& request,
                                    const Asker& asker, Instant now,
                                    std::function<void(const WriteResult&)> done) {
  const auto device = store_.device(unit.device);
  if (!device) return kDeviceFailure;
  ConvertedWrite converted = ConvertWrites(unit, *device, request);
  if (converted.exception != kNoException) return converted.exception;
  const auto denial = gate_.Submit(asker.writer,
                                   {.device = unit.device,
                                    .parts = std::move(converted.parts),
                                    .deadline = asker.deadline,
                                    .abandoned = asker.abandoned,
                                    .done = std::move(done)},
                                   now);
  return denial ? ExceptionOf(*denial) : kNoException;
}

void OwnUnits::Deny(View frame, const bus::Writer& writer, const WriteResult& refused,
                    const Now& now) {
  ModbusRequest request;
  if (!IsPlainWrite(FunctionOf(frame)) || Check(frame, request) != kNoException) return;
  const UnitMap& unit = map_.unit(request.unit);
  if (AckRegister::IsFor(request)) return acks_.Deny(request, unit, writer, refused, now);
  if (unit.kind != UnitMap::Kind::device) return;
  const auto device = store_.device(unit.device);
  if (!device) return;
  ConvertedWrite converted = ConvertWrites(unit, *device, request);
  gate_.Deny(writer, {.device = unit.device, .parts = std::move(converted.parts)}, refused.reason,
             refused.end);
}

void OwnUnits::Forget(const bus::Writer& writer) {
  gate_.Forget(writer);
  events_.Forget(writer.number);
}

}  // namespace baudgate::modbus
