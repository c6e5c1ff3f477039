// SPDX-License-Identifier: Apache-2.0
#include "protocols/modbus/conversation.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/rules.h"

namespace baudgate::protocols::modbus {

std::optional<Bytes> Identification::Next() {
  if (identity_.names.empty() || identity_.ignore) return std::nullopt;
  if (std::exchange(again_, false)) OnReconnect();
  if (done_) return std::nullopt;
  const bool objects = step_ == Step::objects;
  asked_ = ReadOf({objects ? Space{Table::identity, kBasic} : Space{Table::server, 0}, 0, 1, 1});
  return asked_;
}

void Identification::OnAnswer(const std::optional<Data>& data) {
  std::vector<std::string> names;
  if (data && step_ == Step::server) names = {data->texts.at(0)};
  if (data && step_ == Step::objects && data->texts.contains(kProduct)) {
    const auto vendor = data->texts.find(kVendor);
    names = {data->texts.at(kProduct)};
    if (vendor != data->texts.end()) names.push_back(vendor->second + " " + names[0]);
  }
  std::erase_if(names, [](const std::string& name) { return config::SpokenName(name).empty(); });
  const bool silent = names.empty();
  if (!silent) Judge(names);
  done_ = !silent || step_ == Step::server;
  step_ = step_ == Step::objects ? Step::server : Step::over;
}

/// Sets trouble_ from the names that the device reports. There is no trouble if the profile lists
/// one of them; otherwise the most serious contradiction counts.
void Identification::Judge(const std::vector<std::string>& names) {
  trouble_ = {};
  DeviceTrouble worst;
  for (const std::string& name : names) {
    DeviceTrouble found = JudgeName(identity_, name);
    if (found.text.empty()) return;
    if (worst.text.empty() || (found && !worst)) worst = std::move(found);
  }
  trouble_ = std::move(worst);
}

void Identification::OnReconnect() {
  step_ = Step::objects;
  done_ = false;
}

namespace {

/// The data of a loopback. This pattern is unlikely to occur as an address or count.
constexpr std::uint16_t kLoopbackData = 0xA55A;
/// The maximum number of reads in OwnProbes. If the device refuses one, the next one is used.
constexpr std::size_t kMostProbes = 3;

/// Pauses after exceptions of the device: kBusyWait after "busy", kWorkWait after "acknowledge",
/// which means that the device is still working on the request.
constexpr Duration kBusyWait = 200ms;
constexpr Duration kWorkWait = 1s;

bool IsLoopback(View request) { return request[0] == kDiagnostics && IsMirrored(request); }

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
      // A gateway between this program and the device has sent these exceptions: the device did not
      // answer.
      return Outcome::no_reply;
    default:
      return Outcome::refused;
  }
}

/// True if the address of the request looks like one from a manual: 3xxxx for inputs, 4xxxx for
/// holding registers. The address in a PDU is another number.
bool IsOfManual(View request) {
  constexpr unsigned kFirst = 30001;
  constexpr unsigned kLast = 49999;
  const auto begin = request.size() > 4 ? ByteReader(request).U16Be(1) : std::nullopt;
  return TableOf(request[0]) && begin && *begin >= kFirst && *begin <= kLast;
}

const char* RemedyOf(std::uint8_t exception, View request) {
  switch (exception) {
    case kIllegalFunction:
      return "check whether the profile fits the device: it has no such function; read another "
             "table (input, holding)";
    case kIllegalAddress:
      if (IsOfManual(request)) {
        return "40001 in a manual is holding 0 here, and 30001 is input 0; correct the address";
      }
      return "check whether the profile fits the device: it does not have these registers; correct "
             "or remove the points";
    case kIllegalValue:
      return "check whether the profile fits the device; if it does, read fewer registers at once "
             "(set block at the device)";
    case kAcknowledge:
    case kBusy:
      return "";
    case kNoPath:
      return "check the unit number, and in the Modbus gateway before the device its route and "
             "port";
    case kNoTarget:
      return "check power, wiring and address of the device behind the gateway";
    case kDeviceFailure:
    case kParityError:
      return "the device has a fault; inspect, restart or replace it";
    default:
      return "check whether the profile fits the device";
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
                                       const Settings& settings, Transactions* transactions)
    : framing_(framing),
      device_(device),
      transactions_(transactions),
      settings_(settings),
      slave_(ParseAddress(device.address, framing).value()),
      places_(ReadLocations(device.points)),
      plan_(MakePlan(device.points, places_, settings_, OftenOf(device))),
      writing_(device, settings_),
      identification_(device.identity),
      probes_(settings_.probe_by_loopback ? ProbeChoice::Own::identification
                                          : ProbeChoice::Own::read) {
  for (std::uint32_t point = 0; point < places_.size(); ++point) {
    if (places_[point]) by_place_.push_back(point);
  }
  std::ranges::sort(by_place_, {}, [this](std::uint32_t point) { return BeginIn(point); });
}

std::pair<Space, std::size_t> ModbusConversation::BeginIn(std::uint32_t point) const {
  return {places_[point]->space(), BeginOf(*places_[point])};
}

Request ModbusConversation::MakeRequest(View pdu) const {
  Request request;
  request.bytes = Wrap(framing_, slave_, pdu, transactions_ != nullptr ? transactions_->Next() : 0);
  request.expect = Expect(framing_, request.bytes);
  request.numbered = framing_ == Framing::tcp;
  request.steady = IsLoopback(pdu);
  const auto time = settings_.reply_times.find(pdu[0]);
  if (time != settings_.reply_times.end()) request.reply = time->second;
  return request;
}

Result<Request> ModbusConversation::Ask(const Task& task, Instant) {
  if (task.kind == Task::Kind::write) {
    const auto step = writing_.Next(task);
    if (!step) return Error{step.error()};
    Request request = MakeRequest(step->pdu);
    request.prepares = step->reads;
    return request;
  }
  writing_.Forget();
  if (task.kind == Task::Kind::poll) {
    const auto first = identification_.Next();
    Request request = MakeRequest(first ? *first : PollPdu(task.query));
    if (first) request.expect.repeatable = false;
    return request;
  }
  const auto read = probes_.Next(plan_.queries().size());
  if (read) return MakeRequest(PollPdu(*read));
  const std::vector<Bytes> own = OwnProbes();
  Request request = MakeRequest(own[own_probe_ % own.size()]);
  request.unlike_polls = !request.steady;
  return request;
}

std::vector<Bytes> ModbusConversation::OwnProbes() const {
  std::vector<Bytes> probes;
  if (!settings_.probe_by_loopback) {
    for (const Block<Space>& read : DistinctReads(plan_)) {
      if (probes.size() < kMostProbes) probes.push_back(ReadOf(read));
    }
  }
  if (probes.empty()) probes.push_back(LoopbackRequest(kLoopbackData));
  return probes;
}

std::optional<std::size_t> ModbusConversation::OwnProbeOf(View pdu) const {
  const std::vector<Bytes> own = OwnProbes();
  const auto found =
      std::ranges::find_if(own, [&](const Bytes& one) { return std::ranges::equal(one, pdu); });
  if (found == own.end()) return std::nullopt;
  return static_cast<std::size_t>(found - own.begin());
}

/// Returns the PDU of a query. If an identification comes in several replies, the next request
/// begins with the object that the last reply has named; the first request begins with the first
/// object.
Bytes ModbusConversation::PollPdu(std::size_t query) const {
  Block<Space> block = plan_.block(query);
  if (block.key.table == Table::identity) {
    block.begin = block.begin >= kFirstOwnObject ? kFirstOwnObject : 0;
    if (next_object_ && next_object_->first == block.key) block.begin = next_object_->second;
  }
  return ReadOf(block);
}

ModbusConversation::Exchanged ModbusConversation::Decode(View request, View frame) const {
  Exchanged exchanged = Judge(request, frame);
  if (exchanged.answer.outcome == Outcome::ok) {
    exchanged.data = DataOf(exchanged.request, exchanged.reply);
    AddReadings(exchanged);
  } else if (exchanged.exception != 0) {
    AddFaults(exchanged);
  }
  return exchanged;
}

ModbusConversation::Exchanged ModbusConversation::Judge(View request, View frame) const {
  Exchanged exchanged;
  const auto fail = [&](Outcome outcome, std::string reason) {
    exchanged.answer = Failed(outcome, std::move(reason));
    return exchanged;
  };
  auto asked = Unwrap(framing_, request);
  if (!asked) return fail(Outcome::corrupt, "the request is not a Modbus frame: " + ToHex(request));
  auto got = UnwrapReply(framing_, frame);
  if (!got) return fail(Outcome::corrupt, "the reply is not a Modbus frame: " + ToHex(frame));
  if (IsBroadcast(framing_, asked->slave)) {
    return fail(Outcome::unexpected,
                "no device answers a broadcast, but this came: " + ToHex(frame));
  }
  if (asked->slave != got->slave) {
    return fail(Outcome::unexpected, "the reply is from slave " + std::to_string(got->slave) +
                                         ", not " + std::to_string(asked->slave));
  }
  if (asked->transaction != got->transaction) {
    return fail(Outcome::unexpected, "the reply is to transaction " +
                                         std::to_string(got->transaction) + ", not " +
                                         std::to_string(asked->transaction));
  }
  exchanged.request = std::move(asked->pdu);
  exchanged.reply = std::move(got->pdu);
  Verdict verdict = CheckReply(exchanged.request, exchanged.reply);
  if (verdict.outcome == Outcome::unexpected) {
    return fail(verdict.outcome, std::move(verdict.reason));
  }
  exchanged.exception = verdict.exception;
  if (verdict.outcome == Outcome::ok) return exchanged;
  const std::uint8_t function = exchanged.request[0];
  exchanged.answer.outcome = OutcomeOf(verdict.exception, !TableOf(function).has_value());
  exchanged.answer.reason = "function " + HexByte(function) + ": " + verdict.reason;
  exchanged.answer.remedy = RemedyOf(verdict.exception, exchanged.request);
  if (verdict.exception == kBusy) exchanged.answer.wait = kBusyWait;
  if (verdict.exception == kAcknowledge) exchanged.answer.wait = kWorkWait;
  return exchanged;
}

/// Returns the outcome of a reply. For Modbus TCP it compares only the PDUs, because transaction
/// number and unit of `request` may differ from what was sent, and the frame rule has compared
/// them.
Outcome ModbusConversation::Check(View request, View frame) const {
  if (framing_ != Framing::tcp || std::min(request.size(), frame.size()) < kTcpOverhead) {
    return Judge(request, frame).answer.outcome;
  }
  Bytes asked(request.begin(), request.end());
  std::copy_n(frame.begin(), 2, asked.begin());
  asked[kTcpOverhead - 1] = frame[kTcpOverhead - 1];
  return Judge(asked, frame).answer.outcome;
}

Answer ModbusConversation::Interpret(View request, View frame) {
  Exchanged exchanged = Decode(request, frame);
  AddLabels(exchanged);
  return std::move(exchanged.answer);
}

Answer ModbusConversation::OnFrame(const Task& task, const Request& request, View frame,
                                   Instant now) {
  Exchanged exchanged = Decode(request.bytes, frame);
  Answer& answer = exchanged.answer;
  if (exchanged.reply.empty() || answer.outcome == Outcome::unexpected) return answer;
  if (task.kind == Task::Kind::probe) return AfterProbe(std::move(exchanged));
  if (task.kind == Task::Kind::write) return AfterWrite(std::move(exchanged));
  if (identification_.IsAskedBy(exchanged.request)) {
    return AfterIdentification(std::move(exchanged));
  }
  return AfterPoll(task.query, std::move(exchanged), now);
}

/// Takes the reply to a request of a write task. If the request was a read before the write, the
/// task goes on. The exception "acknowledge" to a write counts as ok: the device is still working,
/// and a later poll shows the result.
Answer ModbusConversation::AfterWrite(Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  answer.readings.clear();
  if (exchanged.request[0] != kReadHolding || answer.outcome != Outcome::ok) {
    writing_.Forget();
    const bool written = exchanged.request[0] != kReadHolding;
    if (written && exchanged.exception == kAcknowledge) {
      answer.outcome = Outcome::ok;
      answer.reason.clear();
    }
    if (exchanged.request[0] == kMaskWrite && exchanged.exception == kIllegalFunction) {
      answer.reason +=
          "; set bit_write: read_write, because the device has no function 22 (mask write)";
    }
    return answer;
  }
  const Status same = writing_.OnRead(*ByteReader(exchanged.reply).U16Be(2));
  if (!same) return Failed(Outcome::refused, same.error());
  answer.then = Then::ask_again;
  return answer;
}

/// Takes the reply to an identification, then continues with the poll, whatever the reply is.
Answer ModbusConversation::AfterIdentification(Exchanged exchanged) {
  identification_.OnAnswer(exchanged.data);
  Answer answer;
  answer.then = Then::ask_again;
  return answer;
}

/// Takes the reply to a probe. A refusal of the own probe (unknown function, no such registers)
/// also proves that the device is there. But any request could get the same refusal, so another own
/// probe is sent at once, if there is one.
Answer ModbusConversation::AfterProbe(Exchanged exchanged) {
  Answer answer = std::move(exchanged.answer);
  const bool ok = answer.outcome == Outcome::ok;
  if (!ok) answer.readings.clear();
  if (answer.outcome == Outcome::no_reply) return answer;
  const auto own = OwnProbeOf(exchanged.request);
  probes_.OnAnswered(own.has_value());
  if (own && answer.outcome == Outcome::unsupported) {
    const bool more = *own + 1 < OwnProbes().size();
    own_probe_ = more ? *own + 1 : 0;
    answer = {};
    if (more) answer.then = Then::ask_again;
  } else if (own && !ok && answer.outcome != Outcome::busy) {
    answer = {};
  }
  plan_.OnProbed();
  return answer;
}

Answer ModbusConversation::AfterPoll(std::size_t query, Exchanged exchanged, Instant now) {
  Answer answer = std::move(exchanged.answer);
  if (answer.outcome == Outcome::no_reply) return answer;
  probes_.OnPolled();
  identification_.OnPolled();
  next_object_.reset();
  if (exchanged.data && exchanged.data->follows) {
    next_object_ = {exchanged.data->space, *exchanged.data->follows};
    answer.then = Then::ask_again;
    return answer;
  }
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) {
    change = plan_.OnAnswered(query, now);
  } else if (answer.outcome == Outcome::unsupported) {
    change = plan_.OnRefused(query, now, exchanged.exception != kIllegalFunction);
  } else {
    change = plan_.OnHeard(query, now);
  }
  if (change == PlanChange::split) {
    answer.reason += "; the gateway now reads this block in two parts";
    answer.remedy.clear();
    answer.divides = true;
    answer.readings.clear();
  }
  if (change != PlanChange::nothing) answer.then = Then::replan;
  for (const std::size_t point : plan_.SilentlyRefused(query)) {
    answer.readings.push_back({point, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
  }
  return answer;
}

Then ModbusConversation::OnFailure(const Task& task, const Request& request, Outcome outcome,
                                   Instant now) {
  writing_.Forget();
  if (task.kind == Task::Kind::probe) {
    const auto asked = Unwrap(framing_, request.bytes);
    const bool own = asked && OwnProbeOf(asked->pdu);
    return probes_.OnFailed(own) ? Then::ask_again : Then::done;
  }
  next_object_.reset();
  if (task.kind != Task::Kind::poll) return Then::done;
  const auto asked = Unwrap(framing_, request.bytes);
  if (asked && identification_.IsAskedBy(asked->pdu)) {
    if (outcome == Outcome::busy) return Then::done;
    identification_.OnAnswer(std::nullopt);
    return Then::ask_again;
  }
  identification_.OnPolled();
  if (outcome != Outcome::no_reply) return Then::done;
  return plan_.OnSilent(task.query, now) == PlanChange::nothing ? Then::done : Then::replan;
}

void ModbusConversation::OnReconnect() {
  writing_.Forget();
  probes_.OnReconnect();
  own_probe_ = 0;
  plan_.OnReconnect();
  identification_.OnReconnect();
  next_object_.reset();
}

namespace {

/// Returns the quality that the requested points get after an exception. Empty: their quality does
/// not change.
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

}  // namespace

std::vector<std::size_t> ModbusConversation::PointsIn(const Block<Space>& block) const {
  const auto from = [&](std::size_t place) {
    return std::ranges::lower_bound(by_place_, std::pair(block.key, place), {},
                                    [this](std::uint32_t point) { return BeginIn(point); });
  };
  const bool some = IsAddressed(block.key.table);
  std::vector<std::size_t> points(from(some ? block.begin : 0), from(some ? block.end : 0x10000));
  std::ranges::sort(points);
  return points;
}

void ModbusConversation::AddReadings(Exchanged& exchanged) const {
  if (!exchanged.data) return;
  const Data& data = *exchanged.data;
  for (const std::size_t point : PointsIn(data.block())) {
    const auto& place = places_[point];
    const bool there = place->form == Form::object ? data.texts.contains(place->address)
                                                   : data.block().Covers(BlockOf(*place));
    // An earlier reply has contained the objects before the first requested object.
    const bool earlier = place->form == Form::object && place->address < data.address;
    if (there || (data.whole && !earlier))
      exchanged.answer.readings.push_back(ReadingOf(point, data));
  }
}

/// Returns the reading of a point from a reply. If the device has no such data (an empty queue, an
/// unknown object), the quality is bad.
Reading ModbusConversation::ReadingOf(std::size_t point, const Data& data) const {
  const Location& place = *places_[point];
  const Quality absent = place.table == Table::queue
                             ? Quality(Quality::bad, Reason::not_ready)
                             : Quality(Quality::bad_configuration, Reason::not_fitted);
  if (place.form == Form::object) {
    const auto text = data.texts.find(place.address);
    if (text == data.texts.end()) return {point, {}, absent, {}};
    return {point, text->second, Quality::good, {}};
  }
  const Block<Space> block = BlockOf(place);
  if (!data.block().Covers(block)) return {point, {}, absent, {}};
  const auto words = std::span(data.words).subspan(block.begin - data.address, block.size());
  auto [value, quality] = DecodeBlock(place, words, settings_, device_.points[point].sentinels);
  return {point, std::move(value), quality, {}};
}

/// Adds labelled readings for the values in the reply that no point reads.
void ModbusConversation::AddLabels(Exchanged& exchanged) const {
  if (exchanged.answer.outcome != Outcome::ok || !exchanged.data) return;
  const Data& data = *exchanged.data;
  std::vector<bool> used(data.words.size(), false);
  std::vector<std::size_t> spoken;
  for (const std::size_t point : PointsIn(data.block())) {
    const auto& place = places_[point];
    if (place->form == Form::object) spoken.push_back(place->address);
    if (place->form == Form::object || !data.block().Covers(BlockOf(*place))) continue;
    const auto mark = [&](std::size_t address, std::size_t count) {
      std::fill_n(used.begin() + static_cast<std::ptrdiff_t>(address - data.address), count, true);
    };
    mark(place->address, place->count);
    if (place->scale) mark(*place->scale, 1);
  }
  const auto add = [&](std::size_t address, Value value) {
    exchanged.answer.readings.push_back(
        {kNoPoint, std::move(value), Quality::good, LabelOf(data.space, address)});
  };
  for (const auto& [object, text] : data.texts) {
    if (std::ranges::find(spoken, object) == spoken.end()) add(object, text);
  }
  for (std::size_t i = 0; i < used.size() && data.space.table != Table::server; ++i) {
    if (used[i]) continue;
    const bool bits = IsBits(data.space.table);
    add(data.address + i, bits ? Value(data.words[i] != 0) : Value(std::uint64_t{data.words[i]}));
  }
}

void ModbusConversation::AddFaults(Exchanged& exchanged) const {
  const auto quality = QualityOf(exchanged.exception);
  const auto block = protocols::modbus::BlockOf(exchanged.request);
  if (!quality || !block) return;
  for (const std::size_t point : PointsIn(*block)) {
    if (!block->Covers(BlockOf(*places_[point]))) continue;
    exchanged.answer.readings.push_back({point, {}, *quality, {}});
  }
}

}  // namespace baudgate::protocols::modbus
