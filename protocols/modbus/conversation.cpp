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

/// After so many loopbacks without an answer, while reads are answered, the device does not know
/// them.
constexpr int kSilencesOfAnUnknownFunction = 3;

/// So often a block stays without an answer, while others are answered, before the device is taken
/// to refuse it silently.
constexpr int kSilencesOfARefusedBlock = 3;

/// How long a device that says it is busy is left in peace.
constexpr Duration kBusyWait = 200ms;
constexpr Duration kWorkWait = 1s;

/// The bits or registers that a good reply to a read holds.
struct Data {
  Table table = Table::holding;
  std::size_t address = 0;
  Registers words;  ///< of bit tables 0 and 1

  std::size_t end() const { return address + words.size(); }
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

Bytes PduOf(const Block& block) {
  return ReadRequest(ReadFunction(block.table), block.address, block.count);
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
      return Quality::bad_configuration;
    case kDeviceFailure:
    case kParityError:
      return Quality::bad_device_failure;
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

ModbusConversation::ModbusConversation(Framing framing, const config::Device& device)
    : framing_(framing),
      device_(device),
      settings_(ReadSettings(device.options)),
      slave_(ParseAddress(device.address)),
      plan_(device.points, settings_) {}

Request ModbusConversation::MakeRequest(View pdu) const {
  Request request;
  request.bytes = Wrap(framing_, slave_.value(), pdu);
  request.expect = Expect(framing_, request.bytes);
  request.steady = IsLoopback(pdu);
  return request;
}

// ---------------------------------------------------------------- asking

Result<Request> ModbusConversation::Ask(const Task& task, Instant) {
  if (!slave_) return Error{slave_.error()};
  if (task.kind == Task::Kind::write) {
    const auto pdu = WritePdu(task);
    if (!pdu) return Error{pdu.error()};
    return MakeRequest(*pdu);
  }
  const bool probe = task.kind == Task::Kind::probe;
  if (probe && ProbesByLoopback()) return MakeRequest(LoopbackRequest(kLoopbackData));
  const std::size_t query = probe ? 0 : task.query;
  if (query >= plan_.queries().size()) return Error{"there is no query of this number"};
  return MakeRequest(PduOf(plan_.block(query)));
}

/// In turn with a read, as long as it is not known which of the two the device answers.
bool ModbusConversation::ProbesByLoopback() const {
  if (plan_.queries().empty()) return true;
  if (!settings_.loopback || silent_loopbacks_ >= kSilencesOfAnUnknownFunction) return false;
  return failed_probes_ % 2 == 0;
}

Result<Bytes> ModbusConversation::WritePdu(const Task& task) const {
  if (task.point >= device_.points.size()) return Error{"there is no point of this number"};
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
  if (asked->slave == 0) {
    return fail(Outcome::unexpected, "nobody answers a broadcast, yet this came: " + ToHex(frame));
  }
  if (asked->slave != got->slave) {
    return fail(Outcome::unexpected, "reply of slave " + std::to_string(got->slave) + ", not " +
                                         std::to_string(asked->slave));
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

/// Every point that stands wholly in the reply, and what no point asks for with a label.
void ModbusConversation::AddReadings(Exchanged& exchanged) const {
  const auto data = DataOf(exchanged.request, exchanged.reply);
  if (!data) return;
  const Block block{data->table, static_cast<std::uint16_t>(data->address), data->words.size()};
  std::vector<bool> used(data->words.size(), false);
  for (std::size_t point = 0; point < device_.points.size(); ++point) {
    const auto& place = plan_.place(point);
    if (!place || !block.Covers(*place)) continue;
    const std::size_t at = place->address - data->address;
    const auto words = std::span(data->words).subspan(at, place->count);
    auto [value, quality] = protocols::modbus::Decode(*place, words, settings_);
    exchanged.answer.readings.push_back({point, std::move(value), quality, {}});
    std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(at), place->count, true);
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
  const Block block{*table, *address, *count};
  for (std::size_t point = 0; point < device_.points.size(); ++point) {
    const auto& place = plan_.place(point);
    if (!place || !block.Covers(*place)) continue;
    exchanged.answer.readings.push_back({point, {}, *quality, {}});
  }
}

Answer ModbusConversation::Interpret(View request, View frame) {
  return Decode(request, frame).answer;
}

Answer ModbusConversation::OnFrame(const Task& task, const Request& request, View frame, Instant) {
  Exchanged exchanged = Decode(request.bytes, frame);
  Answer& answer = exchanged.answer;
  std::erase_if(answer.readings, [](const Reading& r) { return r.point == kNoPoint; });
  if (exchanged.reply.empty() || answer.outcome == Outcome::unexpected) return answer;
  if (task.kind == Task::Kind::probe) return AfterProbe(std::move(exchanged));
  if (task.kind == Task::Kind::poll) return AfterPoll(task.query, std::move(exchanged));
  return answer;
}

/// Any answer to a loopback proves life, and it is the same frame every time: a device that does
/// not know the function says so.
Answer ModbusConversation::AfterProbe(Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  if (answer.outcome != Outcome::ok) answer.readings.clear();
  if (answer.outcome == Outcome::no_reply) return answer;
  failed_probes_ = 0;
  if (IsLoopback(exchanged.request)) {
    silent_loopbacks_ = 0;
    loopback_unanswered_ = false;
    if (answer.outcome != Outcome::busy) answer = {};
  } else if (std::exchange(loopback_unanswered_, false)) {
    ++silent_loopbacks_;
  }
  return answer;
}

Answer ModbusConversation::AfterPoll(std::size_t query, Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  if (answer.outcome == Outcome::no_reply || query >= plan_.queries().size() ||
      exchanged.request != PduOf(plan_.block(query))) {
    return answer;
  }
  answered_.insert(KeyOf(query));
  silences_.erase(KeyOf(query));
  if (answer.outcome == Outcome::ok) {
    if (plan_.Restore(query)) answer.then = Then::replan;
    return answer;
  }
  if (answer.outcome != Outcome::unsupported) return answer;
  const bool no_such_place = exchanged.exception != kIllegalFunction;
  if (no_such_place && plan_.Split(query)) {
    answer.reason += "; this block is read in two parts from now on";
    answer.readings.clear();
    answer.then = Then::replan;
  } else if (plan_.Demote(query)) {
    answer.then = Then::replan;
  }
  return answer;
}

ModbusConversation::BlockKey ModbusConversation::KeyOf(std::size_t query) const {
  const Block& block = plan_.block(query);
  return {block.table, block.address};
}

Then ModbusConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                   Instant) {
  if (task.kind == Task::Kind::probe) {
    ++failed_probes_;
    if (request.steady) loopback_unanswered_ = true;
  }
  const bool silent = task.kind == Task::Kind::poll && outcome == Outcome::no_reply;
  if (!silent || task.query >= plan_.queries().size() || answered_.empty()) return Then::done;
  const BlockKey key = KeyOf(task.query);
  if (answered_.contains(key) || ++silences_[key] < kSilencesOfARefusedBlock) return Then::done;
  silences_.erase(key);
  const bool changed = plan_.Split(task.query) || plan_.Demote(task.query);
  return changed ? Then::replan : Then::done;
}

/// The device may be another one now; a function that it did not know gets one more try.
void ModbusConversation::OnReconnect() {
  silent_loopbacks_ = std::min(silent_loopbacks_, kSilencesOfAnUnknownFunction - 1);
  loopback_unanswered_ = false;
  answered_.clear();
  silences_.clear();
  plan_.Forget();
}

std::unique_ptr<Conversation> ModbusBus::MakeConversation(const config::Device& device) {
  return std::make_unique<ModbusConversation>(framing_, device);
}

}  // namespace baudgate::protocols::modbus
