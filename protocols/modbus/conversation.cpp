// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/modbus/expect.h"
#include "protocols/modbus/pdu.h"

namespace baudgate::protocols::modbus {
namespace {

/// What a loopback carries: a pattern that no address or count looks like.
constexpr std::uint16_t kLoopbackData = 0xA55A;

/// How long a device that says it is busy is left in peace.
constexpr Duration kBusyWait = 200ms;
constexpr Duration kWorkWait = 1s;

/// The bits or registers that a good reply to a read holds.
struct Data {
  Table table = Table::holding;
  std::size_t address = 0;
  Registers words;  ///< of bit tables 0 and 1

  Block<Table> block() const { return {table, address, address + words.size(), 1}; }
};

std::optional<Data> DataOf(View request, View reply) {
  const bool both = request[0] == kReadWrite;
  const auto table = both ? Table::holding : TableOf(request[0]);
  const auto address = ByteReader(request).U16Be(1);
  const auto count = ByteReader(request).U16Be(3);
  if (!table || !address || !count) return std::nullopt;
  Data data{*table, *address, Registers(*count)};
  const View bytes = reply.subspan(2);
  for (std::size_t i = 0; i < data.words.size(); ++i) {
    const bool bits = IsBits(*table);
    if (bits ? i / 8 >= bytes.size() : 2 * i + 1 >= bytes.size()) return std::nullopt;
    data.words[i] = bits ? static_cast<std::uint16_t>((bytes[i / 8] >> (i % 8)) & 1U)
                         : ByteReader(bytes).U16Be(2 * i).value_or(0);
  }
  return data;
}

bool IsLoopback(View request) { return request[0] == kDiagnostics && IsMirrored(request); }

/// What an exception means for the exchange: for reads and writes alike.
Outcome OutcomeOf(std::uint8_t exception, bool write) {
  switch (exception) {
    case kIllegalFunction:
      return Outcome::unsupported;
    case kIllegalAddress:
    case kIllegalValue:
      return write ? Outcome::refused : Outcome::unsupported;
    case kAcknowledge:
    case kBusy:
      return Outcome::busy;
    case kNoPath:
    case kNoTarget:
      // It is the gateway on the way that lives, not the device.
      return Outcome::no_reply;
    default:
      return Outcome::refused;
  }
}

/// The quality that an exception gives to the points that were asked for.
std::optional<Quality> QualityOf(std::uint8_t exception) {
  switch (exception) {
    case kIllegalFunction:
    case kIllegalAddress:
    case kIllegalValue:
      return Quality(Quality::bad_configuration, Reason::not_fitted);
    case kDeviceFailure:
    case kParityError:
      return Quality(Quality::bad_device_failure, Reason::device_fault);
    default:
      return std::nullopt;
  }
}

Answer Failed(Outcome outcome, std::string reason) {
  Answer answer;
  answer.outcome = outcome;
  answer.reason = std::move(reason);
  return answer;
}

}  // namespace

ModbusConversation::ModbusConversation(Framing framing, const config::Device& device,
                                       Transactions* transactions)
    : framing_(framing),
      device_(device),
      transactions_(transactions),
      settings_(ReadSettings(device.options)),
      slave_(ParseAddress(device.address, framing).value()),
      places_(ReadPlaces(device.points)),
      plan_(MakePlan(device.points, places_, settings_)),
      probes_(settings_.probe_by_loopback ? ProbeChoice::Own::identification
                                          : ProbeChoice::Own::read) {}

Request ModbusConversation::MakeRequest(View pdu) const {
  Request request;
  request.bytes = Wrap(framing_, slave_, pdu, transactions_ != nullptr ? transactions_->Next() : 0);
  request.expect = Expect(framing_, request.bytes);
  request.distinct = framing_ == Framing::tcp;
  request.steady = IsLoopback(pdu) && !request.distinct;
  return request;
}

// ---------------------------------------------------------------- asking

Result<Request> ModbusConversation::Ask(const Task& task, Instant) {
  if (task.kind == Task::Kind::write) {
    const auto pdu = WritePdu(task);
    if (!pdu) return Error{pdu.error()};
    return MakeRequest(*pdu);
  }
  if (task.kind == Task::Kind::poll) return MakeRequest(ReadOf(plan_.block(task.query)));
  const auto read = probes_.Next(plan_.queries().size());
  if (read) return MakeRequest(ReadOf(plan_.block(*read)));
  Request request = MakeRequest(OwnProbe());
  request.distinct = !request.steady;
  return request;
}

Bytes ModbusConversation::OwnProbe() const {
  const bool loopback = settings_.probe_by_loopback || plan_.queries().empty();
  return loopback ? LoopbackRequest(kLoopbackData) : ReadOf(DistinctRead(plan_));
}

Result<Bytes> ModbusConversation::WritePdu(const Task& task) const {
  const config::Point& point = device_.points[task.point];
  const auto place = WritePlace(point);
  if (!place) return Error{"point " + point.name + ": " + place.error()};
  if (place->form == Form::flag || place->form == Form::bit) {
    const double level = ToDouble(task.value);
    if (level != 0 && level != 1) {
      return Error{"point " + point.name + ": " + ToText(task.value) + " is neither 0 nor 1"};
    }
    const bool on = level == 1;
    if (place->form == Form::bit) {
      const auto mask = static_cast<std::uint16_t>(1U << place->bit);
      return MaskWriteRequest(place->address, static_cast<std::uint16_t>(~mask),
                              on ? mask : std::uint16_t{0});
    }
    return settings_.write_multiple ? WriteCoilsRequest(place->address, {on})
                                    : WriteCoilRequest(place->address, on);
  }
  const auto registers = Encode(*place, task.value, settings_);
  if (!registers) return Error{"point " + point.name + ": " + registers.error()};
  const bool one = registers->size() == 1 && !settings_.write_multiple;
  return one ? WriteRegisterRequest(place->address, registers->front())
             : WriteRegistersRequest(place->address, *registers);
}

// ---------------------------------------------------------------- answers

ModbusConversation::Exchanged ModbusConversation::Decode(View request, View frame) const {
  Exchanged exchanged;
  const auto fail = [&](Outcome outcome, std::string reason) {
    exchanged.answer = Failed(outcome, std::move(reason));
    return exchanged;
  };
  auto asked = Unwrap(framing_, request);
  if (!asked) return fail(Outcome::corrupt, "the request is no Modbus frame: " + ToHex(request));
  auto got = Unwrap(framing_, frame);
  if (!got) return fail(Outcome::corrupt, "the reply is no Modbus frame: " + ToHex(frame));
  if (IsBroadcast(framing_, asked->slave)) {
    return fail(Outcome::unexpected, "nobody answers a broadcast, yet this came: " + ToHex(frame));
  }
  if (asked->slave != got->slave) {
    return fail(Outcome::unexpected, "reply of slave " + std::to_string(got->slave) + ", not " +
                                         std::to_string(asked->slave));
  }
  if (asked->transaction != got->transaction) {
    return fail(Outcome::unexpected, "reply of transaction " + std::to_string(got->transaction) +
                                         ", not " + std::to_string(asked->transaction));
  }
  exchanged.request = std::move(asked->pdu);
  exchanged.reply = std::move(got->pdu);
  Verdict verdict = CheckReply(exchanged.request, exchanged.reply);
  if (verdict.outcome == Outcome::unexpected) {
    return fail(verdict.outcome, std::move(verdict.reason));
  }
  exchanged.exception = verdict.exception;
  if (verdict.outcome == Outcome::ok) {
    AddReadings(exchanged);
    return exchanged;
  }
  const std::uint8_t function = exchanged.request[0];
  exchanged.answer.outcome = OutcomeOf(verdict.exception, !TableOf(function).has_value());
  exchanged.answer.reason = "function " + HexByte(function) + ": " + verdict.reason;
  if (verdict.exception == kBusy) exchanged.answer.wait = kBusyWait;
  if (verdict.exception == kAcknowledge) exchanged.answer.wait = kWorkWait;
  AddFaults(exchanged);
  return exchanged;
}

/// Every point that stands wholly in the reply.
void ModbusConversation::AddReadings(Exchanged& exchanged) const {
  const auto data = DataOf(exchanged.request, exchanged.reply);
  if (!data) return;
  for (std::size_t point = 0; point < places_.size(); ++point) {
    const auto& place = places_[point];
    if (!place || !data->block().Covers(BlockOf(*place))) continue;
    const auto words = std::span(data->words).subspan(place->address - data->address, place->count);
    auto [value, quality] = protocols::modbus::Decode(*place, words, settings_);
    exchanged.answer.readings.push_back({point, std::move(value), quality, {}});
  }
}

/// What the reply holds and no point asks for.
void ModbusConversation::AddLabels(Exchanged& exchanged) const {
  if (exchanged.answer.outcome != Outcome::ok) return;
  const auto data = DataOf(exchanged.request, exchanged.reply);
  if (!data) return;
  std::vector<bool> used(data->words.size(), false);
  for (const auto& place : places_) {
    if (!place || !data->block().Covers(BlockOf(*place))) continue;
    const auto at = static_cast<std::ptrdiff_t>(place->address - data->address);
    std::fill_n(used.begin() + at, place->count, true);
  }
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (used[i]) continue;
    Value value{std::uint64_t{data->words[i]}};
    if (IsBits(data->table)) value = data->words[i] != 0;
    std::string label = std::string(Name(data->table)) + " " + std::to_string(data->address + i);
    exchanged.answer.readings.push_back(
        {kNoPoint, std::move(value), Quality::good, std::move(label)});
  }
}

/// The points that a refused read was for.
void ModbusConversation::AddFaults(Exchanged& exchanged) const {
  const auto quality = QualityOf(exchanged.exception);
  const auto table = TableOf(exchanged.request[0]);
  const auto address = ByteReader(exchanged.request).U16Be(1);
  const auto count = ByteReader(exchanged.request).U16Be(3);
  if (!quality || !table || !address || !count) return;
  const Block<Table> block{*table, *address, std::size_t{*address} + *count, 1};
  for (std::size_t point = 0; point < places_.size(); ++point) {
    const auto& place = places_[point];
    if (!place || !block.Covers(BlockOf(*place))) continue;
    exchanged.answer.readings.push_back({point, {}, *quality, {}});
  }
}

Outcome ModbusConversation::Check(View request, View frame) const {
  return Decode(request, frame).answer.outcome;
}

Answer ModbusConversation::Interpret(View request, View frame) {
  Exchanged exchanged = Decode(request, frame);
  AddLabels(exchanged);
  return std::move(exchanged.answer);
}

Answer ModbusConversation::OnFrame(const Task& task, const Request& request, View frame, Instant) {
  Exchanged exchanged = Decode(request.bytes, frame);
  Answer& answer = exchanged.answer;
  if (exchanged.reply.empty() || answer.outcome == Outcome::unexpected) return answer;
  if (task.kind == Task::Kind::probe) return AfterProbe(std::move(exchanged));
  if (task.kind == Task::Kind::poll) return AfterPoll(task.query, std::move(exchanged));
  return answer;
}

/// To its own probe a device may say that it does not know the function, or has no such registers:
/// it is there.
Answer ModbusConversation::AfterProbe(Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  const bool ok = answer.outcome == Outcome::ok;
  if (!ok) answer.readings.clear();
  if (answer.outcome == Outcome::no_reply) return answer;
  const bool own = exchanged.request == OwnProbe();
  probes_.OnAnswered(own);
  if (own && !ok && answer.outcome != Outcome::busy) answer = {};
  return answer;
}

Answer ModbusConversation::AfterPoll(std::size_t query, Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  if (answer.outcome == Outcome::no_reply) return answer;
  probes_.OnPolled();
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) {
    change = plan_.OnAnswered(query);
  } else if (answer.outcome == Outcome::unsupported) {
    change = plan_.OnRefused(query, exchanged.exception != kIllegalFunction);
  } else {
    plan_.OnHeard(query);
  }
  if (change == PlanChange::split) {
    answer.reason += "; this block is read in two parts from now on";
    answer.readings.clear();
  }
  if (change != PlanChange::nothing) answer.then = Then::replan;
  return answer;
}

Then ModbusConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                   Instant) {
  if (task.kind == Task::Kind::probe) {
    const auto asked = Unwrap(framing_, request.bytes);
    const bool own = asked && asked->pdu == OwnProbe();
    return probes_.OnFailed(own) ? Then::ask_again : Then::done;
  }
  if (task.kind != Task::Kind::poll || outcome != Outcome::no_reply) return Then::done;
  return plan_.OnSilent(task.query) == PlanChange::nothing ? Then::done : Then::replan;
}

void ModbusConversation::OnReconnect() {
  probes_.OnReconnect();
  plan_.OnReconnect();
}

}  // namespace baudgate::protocols::modbus
