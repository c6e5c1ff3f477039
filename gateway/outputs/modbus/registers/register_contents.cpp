// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/registers/register_contents.h"

#include <algorithm>

#include "gateway/base/time.h"
#include "gateway/outputs/modbus/registers/register_map.h"

namespace baudgate::modbus {

namespace {

/// Shown in place of a good or uncertain quality if the point's registers cannot hold its value.
constexpr Quality kDoesNotFit{Quality::bad_configuration, Reason::out_of_range};

std::uint64_t Count(Duration duration, Duration unit) {
  return duration < Duration::zero() ? 0 : static_cast<std::uint64_t>(duration / unit);
}

std::uint16_t AgeRegister(const bus::DeviceRecord& record, std::uint32_t point, Instant now) {
  const auto age = AgeAt(record, point, now);
  if (!age) return 0xFFFF;
  return Saturated<std::uint16_t>(Count(*age, 100ms));
}

bool FitsRegisters(const config::Point& point, config::WordOrder order, const Value& value) {
  // A number has at most 64 bits (4 registers). EncodeRegisters cuts a long text, so a text fits.
  std::array<std::uint16_t, 4> scratch;
  if (point.type == config::Type::string) return HasValue(value);
  return EncodeRegisters(point, order, value,
                         std::span(scratch).first(config::RegisterCount(point)));
}

/// Returns the quality that clients read: kDoesNotFit if the stored value is good or uncertain, but
/// the registers or the bit cannot hold it.
Quality ShownQuality(const bus::DeviceRecord& record, std::uint32_t index, Instant now) {
  const Quality quality = QualityAt(record, index, now);
  if (IsBad(quality)) return quality;
  const config::Point& point = record.device->points[index];
  const Value& value = record.points[index].value;
  if (!HasValue(value)) return quality;
  const bool fits = point.table == config::Table::bits
                        ? EncodeBit(value).has_value()
                        : FitsRegisters(point, record.device->word_order, value);
  return fits ? quality : kDoesNotFit;
}

/// Writes to `out` what Show chooses: the value, the point's substitute or "no value". Returns
/// false if the request must be answered with an exception.
bool FillValue(const bus::DeviceRecord& record, std::uint32_t index, Instant now,
               std::span<std::uint16_t> out) {
  const config::Point& point = record.device->points[index];
  const config::WordOrder order = record.device->word_order;
  const Value& value = record.points[index].value;
  Quality quality = QualityAt(record, index, now);
  const bool held = EncodeRegisters(point, order, value, out);
  if (!held && HasValue(value) && !IsBad(quality)) quality = kDoesNotFit;
  switch (Show(point, record.device->on_bad, quality, held)) {
    case Shown::held:
      return true;
    case Shown::exception:
      return false;
    case Shown::substitute:
      if (EncodeRegisters(point, order, point.on_fault.value.ToValue(), out)) return true;
      break;
    case Shown::no_value:
      break;
  }
  EncodeNoValue(point, order, out);
  return true;
}

}  // namespace

DeviceBlock DeviceBlockOf(const bus::DeviceStatus& status, Instant now) {
  DeviceBlock block{};
  block[0] = static_cast<std::uint16_t>(status.state);
  block[1] = static_cast<std::uint16_t>(status.last_outcome);
  Put32(block, 2,
        status.last_ok ? Saturated<std::uint32_t>(Count(now - *status.last_ok, 1ms)) : 0xFFFFFFFFU);
  Put32(block, 4, status.exchanges);
  Put32(block, 6, status.Count(Outcome::ok));
  Put32(block, 8, status.Count(Outcome::no_reply));
  Put32(block, 10, status.Count(Outcome::corrupt));
  Put32(block, 12, status.retries);
  block[14] = Saturated<std::uint16_t>(Count(status.round_trips.last(), 1ms));
  block[15] = Saturated<std::uint16_t>(Count(status.round_trips.mean(), 1ms));
  return block;
}

GatewayBlock GatewayBlockOf(const GatewayFigures& info, const ModbusCounters& counters) {
  GatewayBlock block{};
  block[0] = Saturated<std::uint16_t>(std::uint64_t{info.version_major} * 10000 +
                                      std::uint64_t{info.version_minor} * 100 + info.version_patch);
  block[1] = Saturated<std::uint16_t>(info.lines);
  Put32(block, 2, Saturated<std::uint32_t>(Count(info.uptime, 1s)));
  block[4] = Saturated<std::uint16_t>(info.devices);
  block[5] = Saturated<std::uint16_t>(info.devices_online);
  block[6] = Saturated<std::uint16_t>(counters.clients);
  block[7] = Saturated<std::uint16_t>(info.lines_up);
  // These counters wrap to 0 after 2^32 - 1 instead of staying there, because clients compute
  // differences.
  Put32(block, 8, static_cast<std::uint32_t>(counters.requests));
  Put32(block, 10, static_cast<std::uint32_t>(counters.exceptions));
  return block;
}

ExceptionCode FillRegisters(const bus::DeviceRecord& record, std::span<const Piece> pieces,
                            Instant now, std::span<std::uint16_t> out) {
  for (const Piece& piece : pieces) {
    const auto place = out.subspan(piece.offset, piece.count);
    switch (piece.area) {
      case Area::value:
        if (!FillValue(record, piece.index, now, place)) return kNoTarget;
        break;
      case Area::quality:
        std::ranges::fill(place, ShownQuality(record, piece.index, now).word());
        break;
      case Area::age:
        std::ranges::fill(place, AgeRegister(record, piece.index, now));
        break;
      case Area::status:
        FillFromBlock(DeviceBlockOf(record.status, now), piece, out);
        break;
      // gateway/outputs/modbus/service/own_units.cpp fills the registers of events.
      case Area::events:
      case Area::hole:
        std::ranges::fill(place, std::uint16_t{0});
        break;
    }
  }
  return kNoException;
}

ExceptionCode FillBit(const bus::DeviceRecord& record, std::uint32_t index, Instant now, bool alone,
                      std::uint8_t& out) {
  const config::Point& point = record.device->points[index];
  const auto held = EncodeBit(record.points[index].value);
  const Quality quality = ShownQuality(record, index, now);
  switch (Show(point, record.device->on_bad, quality, held.has_value())) {
    case Shown::held:
      out = *held ? 1 : 0;
      return kNoException;
    case Shown::exception:
      return kNoTarget;
    case Shown::substitute:
      out = point.on_fault.value != 0 ? 1 : 0;
      return kNoException;
    case Shown::no_value:
      out = 0;
      return alone ? kNoTarget : kNoException;
  }
  return kNoTarget;
}

ExceptionCode FillBits(const bus::DeviceRecord& record, std::span<const Piece> pieces, Instant now,
                       std::span<std::uint8_t> out) {
  for (const Piece& piece : pieces) {
    if (piece.area == Area::hole) {
      std::ranges::fill(out.subspan(piece.offset, piece.count), std::uint8_t{0});
    } else if (piece.area == Area::quality) {
      out[piece.offset] = IsGood(ShownQuality(record, piece.index, now)) ? 1 : 0;
    } else if (const auto exception =
                   FillBit(record, piece.index, now, pieces.size() == 1, out[piece.offset]);
               exception != kNoException) {
      return exception;
    }
  }
  return kNoException;
}

void FillFromBlock(std::span<const std::uint16_t> block, const Piece& piece,
                   std::span<std::uint16_t> out) {
  std::ranges::copy(block.subspan(piece.index, piece.count), out.subspan(piece.offset).begin());
}

namespace {

void PutEvent(EventBlock& block, std::size_t at, const events::EventRecord& event) {
  const Duration since = std::max(event.device_time.time_since_epoch(), Duration::zero());
  Put32(block, at, static_cast<std::uint32_t>(event.seq));
  Put32(block, at + 2, Saturated<std::uint32_t>(static_cast<std::uint64_t>(since / 1s)));
  block[at + 4] = static_cast<std::uint16_t>(since % 1s / 1ms);
  block[at + 5] = static_cast<std::uint16_t>(event.clock);
  block[at + 6] = Saturated<std::uint16_t>(event.channel);
  Put32(block, at + 7, event.code);
  block[at + 9] = static_cast<std::uint16_t>(event.state);
}

}  // namespace

EventBlock EventBlockOf(const events::EventFeed::Page& shown, std::uint32_t first) {
  EventBlock block{};
  const std::size_t count = std::min(shown.events.size(), kShownEvents);
  Put32(block, 0, first);
  Put32(block, 2, static_cast<std::uint32_t>(shown.newest));
  Put32(block, 4, static_cast<std::uint32_t>(shown.oldest));
  Put32(block, 6, Saturated<std::uint32_t>(shown.lost));
  block[8] = static_cast<std::uint16_t>(count);
  for (std::size_t i = 0; i < count; ++i) {
    PutEvent(block, kEventHead + i * kEventRecord, shown.events[i]);
  }
  return block;
}

}  // namespace baudgate::modbus
