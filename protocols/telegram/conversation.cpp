// SPDX-License-Identifier: Apache-2.0
#include "protocols/telegram/conversation.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/telegram/field.h"
#include "protocols/telegram/rules.h"

namespace baudgate::protocols::telegram {
namespace {

constexpr const char* kNotReady =
    "check whether the measured value is unstable (vibration, draught, load), or the device is in "
    "a menu";

AnswerReader::Places PlacesOf(const Description& description, const config::Device& device) {
  AnswerReader::Places places;
  for (const config::Point& point : device.points) {
    auto& place = places.emplace_back();
    if (point.access == config::Access::write) continue;
    auto parsed = ParseRead(point);
    if (parsed && description.Find(parsed->call.telegram)) place = std::move(*parsed);
  }
  return places;
}

std::vector<std::optional<Call>> CallsOf(const AnswerReader::Places& places) {
  std::vector<std::optional<Call>> calls;
  for (const auto& place : places) {
    calls.push_back(place ? std::optional(place->call) : std::nullopt);
  }
  return calls;
}

}  // namespace

AnswerReader::AnswerReader(const Description& description, const Bound& bound,
                           const config::Device& device)
    : description_(description),
      places_(PlacesOf(description, device)),
      questions_(description, bound, CallsOf(places_)) {}

Answer AnswerReader::Read(std::size_t telegram, const Bound& known, const Bound& sent,
                          View frame) const {
  const Reply reply = DecodeReply(description_.telegrams[telegram], frame, known);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(telegram, sent, reply, answer);
  return answer;
}

void AnswerReader::AddReadings(std::size_t telegram, const Bound& sent, const Reply& reply,
                               Answer& answer) const {
  if (reply.outcome == Outcome::busy) answer.remedy = kNotReady;
  if (reply.outcome == Outcome::ok) answer.remedy = reply.remedy;
  const bool refused = reply.outcome == Outcome::unsupported;
  if (reply.outcome != Outcome::ok && !refused) return;
  for (const std::size_t i : questions_.AskedBy(telegram, sent)) {
    if (refused) {
      answer.readings.push_back({i, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
      continue;
    }
    Decoded decoded = ValueAt(*places_[i], reply);
    answer.readings.push_back({i, std::move(decoded.value), decoded.quality, {}});
  }
}

Outcome AnswerReader::Check(View request, View frame) const {
  const auto sent = description_.Recognise(request);
  if (!sent) return Outcome::corrupt;
  return DecodeReply(description_.telegrams[sent->telegram], frame, sent->values).outcome;
}

Answer AnswerReader::Interpret(View request, View frame) const {
  const auto sent = description_.Recognise(request);
  if (!sent) {
    return {Outcome::corrupt,
            "request '" + Printable(request) + "' is not a telegram of its profile"};
  }
  const Reply reply = DecodeReply(description_.telegrams[sent->telegram], frame, sent->values);
  Answer answer{reply.outcome, reply.reason};
  AddReadings(sent->telegram, sent->values, reply, answer);
  if (reply.outcome != Outcome::ok) return answer;
  const auto asked = questions_.AskedBy(sent->telegram, sent->values);
  for (const auto& [name, field] : reply.fields) {
    const auto field_of = [this](std::size_t point) { return places_[point]->field; };
    if (std::ranges::find(asked, name, field_of) != std::ranges::end(asked)) continue;
    answer.readings.push_back({kNoPoint, field.decoded.value, field.decoded.quality,
                               description_.telegrams[sent->telegram].name + "." + name});
  }
  return answer;
}

Answer AnswerReader::ReadUnasked(View message, const Bound& bound) const {
  Answer why{Outcome::corrupt, "'" + Printable(message) + "' is not a telegram of its profile"};
  for (std::size_t i = 0; i < description_.telegrams.size(); ++i) {
    if (!description_.telegrams[i].listen) continue;
    Answer answer = Read(i, bound, bound, message);
    if (answer.outcome != Outcome::unexpected) return answer;
  }
  return why;
}

namespace {

constexpr std::size_t kMostOthers = 3;
constexpr std::size_t kLongestBegin = 10;
constexpr std::size_t kShortestWord = 2;

/// Returns the word by which users know a telegram: a word in its fixed characters, such as "MDA",
/// or else its name.
std::string WordOf(const Telegram& telegram) {
  for (const Element& element : telegram.receive.front().pattern.elements) {
    std::string word;
    for (const std::uint8_t byte : element.literal) {
      if (std::isalnum(byte) != 0) word += static_cast<char>(byte);
    }
    if (word.size() >= kShortestWord) return word;
  }
  return telegram.name;
}

/// Returns the beginning of a message, up to the first comma or blank: "$GPGSV".
std::string BeginOf(View message) {
  const std::string_view text = Trim(AsText(message));
  return Printable(ToBytes(text.substr(0, std::min(text.find_first_of(", "), kLongestBegin))));
}

std::string Joined(const std::vector<std::string>& words, const std::string& last) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    text += i == 0 ? "" : i + 1 == words.size() ? last : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace

Listening::Listening(const Description& description, const Bound& bound,
                     const AnswerReader::Places& places)
    : description_(description), bound_(bound) {
  for (std::size_t i = 0; i < description.telegrams.size(); ++i) {
    const Telegram& telegram = description.telegrams[i];
    const bool read = std::ranges::any_of(
        places, [&](const auto& place) { return place && place->call.telegram == telegram.name; });
    if (telegram.listen && read && !telegram.receive.empty()) awaited_.push_back({i, false, {}});
  }
}

/// True if the message is the awaited telegram. Sets Awaited::came if its fields have the values in
/// bound_, else Awaited::said, which names a field that differs.
bool Listening::Take(Awaited& awaited, View message) const {
  for (const Form& form : description_.telegrams[awaited.telegram].receive) {
    const Match match = MatchAll(form, message, bound_);
    if (match.kind != Match::Kind::whole) continue;
    awaited.came = awaited.came || !match.other;
    if (!match.other) return true;
    for (const auto& [name, value] : ValuesOf(form, match)) {
      const auto bound = bound_.find(name);
      if (bound == bound_.end() || SameValue(value, bound->second)) continue;
      awaited.said = name + ": " + ToText(value);
    }
    return true;
  }
  return false;
}

void Listening::OnMessage(View message) {
  bool taken = false;
  for (Awaited& awaited : awaited_) taken = Take(awaited, message) || taken;
  if (taken || others_.size() >= kMostOthers) return;
  std::string begin = "'" + BeginOf(message) + "'";
  if (std::ranges::find(others_, begin) == others_.end()) others_.push_back(std::move(begin));
}

std::string Listening::Missing() const {
  std::vector<std::string> missing;
  for (const Awaited& awaited : awaited_) {
    if (awaited.came) continue;
    const std::string word = WordOf(description_.telegrams[awaited.telegram]);
    if (!awaited.said.empty()) {
      return word + " comes with another unit than configured (" + awaited.said +
             "); set parameters: { " + awaited.said + " }";
    }
    missing.push_back(word);
  }
  if (missing.empty()) return {};
  const std::string none = "no " + Joined(missing, " and no ") + " comes";
  if (missing.size() < awaited_.size() || others_.empty()) {
    return none + ": switch the message on at the device, or remove its points from the profile";
  }
  return none + ", but " + Joined(others_, " and ") +
         ": check whether another device is at this port, or these messages are switched off in "
         "the device";
}

void Exchanges::Begin(std::size_t telegram) {
  const Telegram& meant = description_.telegrams[telegram];
  steps_.clear();
  meant_ = telegram;
  at_ = 0;
  outcome_ = Outcome::none;
  reason_.clear();
  for (const std::size_t one : meant.before) {
    if (done_once_.contains(one)) continue;
    steps_.push_back({Step::Part::before, one});
  }
  steps_.push_back({Step::Part::meant, telegram});
  for (const std::size_t one : meant.behind) steps_.push_back({Step::Part::behind, one});
}

void Exchanges::BeginAgain() {
  Forget();
  Begin(meant_);
}

bool Exchanges::Advance() {
  if (!under_way()) return false;
  const Step& done = steps_[at_];
  if (description_.telegrams[done.telegram].once) done_once_.insert(done.telegram);
  ++at_;
  return under_way();
}

bool Exchanges::Fail() {
  Forget();
  // If neither a telegram before nor the main telegram was sent, there is nothing to close.
  const bool begun = at_ > 0 || (under_way() && steps_[at_].part != Step::Part::before);
  while (under_way() && steps_[at_].part != Step::Part::behind) ++at_;
  const bool closes = begun && under_way() && steps_[at_].part == Step::Part::behind;
  if (!closes) Break();
  return closes;
}

namespace {

constexpr Duration kUsualIdle = 500ms;  // this silence ends an incomplete unasked message
constexpr Duration kLongestMessage = 5s;
constexpr int kRefusals = 3;  // number of refusals in a row; a damaged answer can look like one

/// Returns `settings`, with an empty description if they have none. Nothing is sent to a device
/// with an empty description.
Settings WithDescription(Settings settings) {
  if (!settings.description) settings.description = std::make_shared<const Description>("");
  return settings;
}

std::optional<Standing> StandingOf(const Settings& settings) {
  const Description& description = *settings.description;
  if (!description.listens()) return std::nullopt;
  Standing standing;
  standing.rule = CutTelegram;
  standing.expect = ExpectUnasked(settings);
  standing.whole = kLongestMessage;
  standing.marked = true;
  for (const Telegram& telegram : description.telegrams) {
    if (!telegram.listen) continue;
    standing.idle = std::max(telegram.idle, standing.idle);
    for (const Form& form : telegram.receive) {
      standing.marked = standing.marked && !form.pattern.elements.front().is_field();
    }
  }
  if (standing.idle == Duration::zero()) standing.idle = kUsualIdle;
  return standing;
}

}  // namespace

TelegramConversation::TelegramConversation(const config::Device& device, const Settings& settings)
    : device_(device),
      settings_(WithDescription(settings)),
      bound_(BoundOf(settings_, device.address)),
      reader_(*settings_.description, bound_, device),
      listening_(*settings_.description, bound_, reader_.places()),
      plan_({.may_join = {},
             .refused = WhenRefused::ask_rarely,
             .refusals = kRefusals,
             .is_often = OftenOf(device)}),
      standing_(StandingOf(settings_)),
      identification_(*settings_.description, device.identity),
      own_probe_(OwnProbe(*settings_.description, reader_.places(), bound_)),
      probes_(!own_probe_                  ? ProbeChoice::Own::none
              : identification_.telegram() ? ProbeChoice::Own::identification
                                           : ProbeChoice::Own::read),
      exchanges_(*settings_.description) {
  for (std::size_t i = 0; i < reader_.places().size(); ++i) {
    const auto& place = reader_.places()[i];
    if (!place || TelegramOf(*settings_.description->Find(place->call.telegram)).listen) continue;
    plan_.Add(device.points[i].group, i, place->call);
  }
  plan_.Make();
}

Status TelegramConversation::Begin(const Task& task, Instant now) {
  filled_ = bound_;
  repeated_ = false;
  Call call;
  if (task.kind == Task::Kind::write) {
    auto written = ParseWrite(device_.points[task.point]);
    if (!written) return Error{written.error()};
    call = std::move(*written);
    filled_.insert_or_assign(std::string(kValue), task.value);
  } else {
    call = plan_.block(task.query).key;
  }
  for (const auto& [name, text] : call.parameters) filled_.insert_or_assign(name, text);
  const auto telegram = settings_.description->Find(call.telegram);
  if (!telegram || !TelegramOf(*telegram).send) {
    return Error{"'" + call.telegram +
                 "' is not a telegram that can be sent; name a telegram with 'send'"};
  }
  const bool is_false = task.kind == Task::Kind::write &&
                        TelegramOf(*telegram).value_field() == nullptr && ToDouble(task.value) != 1;
  if (is_false) {
    return Error{"only true can be written here, which sends the telegram '" + call.telegram + "'"};
  }
  // A value that cannot be written is refused before any telegram is sent.
  if (const auto bytes = BytesOf(*telegram); !bytes) return Error{bytes.error()};
  identifies_ = identification_.IsDue(now);
  if (identifies_) filled_ = bound_;
  exchanges_.Begin(identifies_ ? *identification_.telegram() : *telegram);
  return {};
}

Result<Request> TelegramConversation::Ask(const Task& task, Instant now) {
  if (task.kind != Task::Kind::poll && task.kind != Task::Kind::probe &&
      task.kind != Task::Kind::write) {
    return Error{"a device with protocol telegram has no events"};
  }
  if (std::exchange(goes_on_, false) && exchanges_.under_way()) return AskStep();
  if (task.kind == Task::Kind::probe) return AskProbe();
  own_ = false;
  if (Status status = Begin(task, now); !status) return Error{status.error()};
  return AskStep();
}

Result<Request> TelegramConversation::AskProbe() {
  filled_ = bound_;
  identifies_ = repeated_ = false;
  const std::size_t count = plan_.queries().size();
  std::size_t best = 0;
  while (best + 1 < count && !plan_.IsProven(best)) ++best;
  const auto read = probes_.Next(count, count > 0 && plan_.IsProven(best) ? best : 0);
  own_ = !read && own_probe_.has_value();
  if (own_) {
    identifies_ = own_probe_ == identification_.telegram();
    exchanges_.Begin(*own_probe_);
    return AskStep();
  }
  if (count == 0)
    return Error{"no telegram can read from the device; add 'reads: yes' to a telegram that reads"};
  const Call& call = plan_.block(read.value_or(0)).key;
  for (const auto& [name, text] : call.parameters) filled_.insert_or_assign(name, text);
  exchanges_.Begin(*settings_.description->Find(call.telegram));
  return AskStep();
}

/// Returns the bytes of a telegram. Fails if they are also the bytes of another telegram in the
/// description, because the device would answer that telegram.
Result<Bytes> TelegramConversation::BytesOf(std::size_t telegram) const {
  auto bytes = Build(*TelegramOf(telegram).send, filled_);
  if (!bytes) return bytes;
  const auto sent = settings_.description->Recognise(*bytes);
  if (sent && sent->telegram == telegram) return bytes;
  return Error{"'" + TelegramOf(telegram).name + "' with these values " +
               (sent ? "has the same bytes as telegram '" + TelegramOf(sent->telegram).name + "'"
                     : "does not fit its own pattern in 'send'")};
}

Result<Request> TelegramConversation::AskStep() {
  using Part = Exchanges::Step::Part;
  const Exchanges::Step& step = exchanges_.step();
  const Telegram& telegram = TelegramOf(step.telegram);
  Request request;
  auto bytes = BytesOf(step.telegram);
  if (!bytes) {
    exchanges_.Break();
    return Error{bytes.error()};
  }
  request.bytes = std::move(*bytes);
  request.expect = Expect(request.bytes, settings_);
  if (exchanges_.is_first()) {
    context_.clear();
    told_.clear();
    said_ = Quality::good;
  }
  if (step.part != Part::behind) request.context = context_;
  if (step.part == Part::meant) {
    request.steady = own_ && identifies_;
    request.unlike_polls = own_ && !identifies_;
  }
  request.prepares = step.part == Part::before || identifies_;
  request.closes = step.part == Part::behind;
  request.reply = telegram.wait;
  request.quiet = telegram.pause;
  return request;
}

Answer TelegramConversation::OnFrame(const Task& task, const Request& request, View frame,
                                     Instant now) {
  if (!exchanges_.under_way()) return Interpret(request.bytes, frame);
  const Exchanges::Step step = exchanges_.step();
  Answer answer = ReadStep(step.telegram, request, frame);
  // The frame answers another exchange, so the task has not advanced.
  if (answer.outcome == Outcome::unexpected) return answer;
  NoteTold(step, request);
  return AfterStep(task, std::move(answer), now);
}

Answer TelegramConversation::ReadStep(std::size_t number, const Request& request, View frame) {
  const Telegram& telegram = TelegramOf(number);
  const Match match = MatchAll(*telegram.send, request.bytes, {});
  Bound known = ValuesOf(*telegram.send, match);
  known.insert(told_.begin(), told_.end());
  const auto part = exchanges_.step().part;
  if (part != Exchanges::Step::Part::meant || identifies_) {
    const Reply reply = DecodeReply(telegram, frame, known);
    if (part == Exchanges::Step::Part::meant) identification_.OnReply(reply);
    if (part == Exchanges::Step::Part::before) said_ = std::min(said_, reply.quality);
    return {reply.outcome, reply.reason, identifies_ ? std::string() : reply.remedy};
  }
  Answer answer = reader_.Read(number, known, filled_, frame);
  for (Reading& reading : answer.readings) {
    if (!(said_ < reading.quality)) continue;
    reading.quality = said_;
    if (IsBad(said_)) reading.value = {};
  }
  return answer;
}

/// Records the fields and bytes of a finished step of the part `before`, because the meaning of
/// later answers depends on them, see Questions.
void TelegramConversation::NoteTold(const Exchanges::Step& step, const Request& request) {
  const Telegram& telegram = TelegramOf(step.telegram);
  if (step.part != Exchanges::Step::Part::before) return;
  told_.merge(ValuesOf(*telegram.send, MatchAll(*telegram.send, request.bytes, {})));
  if (!telegram.once) Append(context_, request.bytes);
}

Then TelegramConversation::OnSent(const Task& task, const Request& request, Instant now) {
  if (exchanges_.under_way()) NoteTold(exchanges_.step(), request);
  return AfterStep(task, {}, now).then == Then::ask_again ? Then::ask_again : Then::done;
}

Answer TelegramConversation::AfterStep(const Task& task, Answer answer, Instant now) {
  using Part = Exchanges::Step::Part;
  const Part part = exchanges_.under_way() ? exchanges_.step().part : Part::behind;
  if (part == Part::meant || answer.outcome != Outcome::ok) {
    exchanges_.EndAs(answer.outcome, answer.reason);
  }
  const bool more = answer.outcome == Outcome::ok ? exchanges_.Advance() : exchanges_.Fail();
  if (more) {
    answer.then = Then::ask_again;
    goes_on_ = true;
    return answer;
  }
  if (part == Part::behind && exchanges_.outcome() != Outcome::none) {
    answer.outcome = exchanges_.outcome();
    answer.reason = exchanges_.reason();
  }
  if (task.kind == Task::Kind::probe) {
    if (ProvesLife(answer.outcome)) probes_.OnAnswered(own_);
    // The device is present, even if it refuses its own probe.
    const bool refused =
        answer.outcome == Outcome::refused || answer.outcome == Outcome::unsupported;
    if (own_ && refused) answer = {};
    return answer;
  }
  if (std::exchange(identifies_, false)) return GoOnKnown(task, std::move(answer), now);
  if (task.kind == Task::Kind::poll) AfterPoll(task.query, answer, now);
  return answer;
}

/// Continues after the request for the device's name. If the name is wrong, polls go on, but a
/// write is refused.
Answer TelegramConversation::GoOnKnown(const Task& task, Answer answer, Instant now) {
  const bool goes_on = task.kind == Task::Kind::poll || !trouble();
  if (answer.outcome != Outcome::ok) identification_.OnNoName(now);
  if (goes_on && ProvesLife(answer.outcome)) {
    answer.then = Then::ask_again;
  } else if (!goes_on) {
    answer.outcome = Outcome::refused;
    answer.reason = trouble().text;
  }
  return answer;
}

void TelegramConversation::AfterPoll(std::size_t query, Answer& answer, Instant now) {
  probes_.OnPolled();
  PlanChange change = PlanChange::nothing;
  if (answer.outcome == Outcome::ok) change = plan_.OnAnswered(query, now);
  if (answer.outcome == Outcome::busy || answer.outcome == Outcome::refused) {
    change = plan_.OnHeard(query, now);
  }
  if (answer.outcome == Outcome::unsupported) {
    // A damaged answer can look like a refusal, so an item counts as missing only after three
    // refusals.
    if (!plan_.IsLastRefusal(query)) answer.readings.clear();
    change = plan_.OnRefused(query, now);
  }
  if (ProvesLife(answer.outcome)) {
    for (const std::size_t point : plan_.SilentlyRefused(query)) {
      answer.readings.push_back({point, {}, {Quality::bad_configuration, Reason::not_fitted}, {}});
    }
  }
  if (change != PlanChange::nothing) answer.then = Then::replan;
}

Then TelegramConversation::OnFailure(const Task& task, const Request&, Outcome outcome,
                                     Instant now) {
  const bool silent = outcome == Outcome::no_reply;
  exchanges_.EndAs(outcome, std::string(Name(outcome)));
  const bool closes = exchanges_.Fail();
  if (!closes) exchanges_.Break();
  if (task.kind == Task::Kind::probe) {
    const bool another = probes_.OnFailed(own_ && silent);
    goes_on_ = closes;
    return closes || another ? Then::ask_again : Then::done;
  }
  if (std::exchange(identifies_, false)) {
    identification_.OnNoName(now);
    goes_on_ = false;
    // If the device is only written to, no other request shows whether it is present, so the write
    // is sent.
    const bool goes_on = task.kind == Task::Kind::poll || plan_.queries().empty();
    return goes_on ? Then::ask_again : Then::done;
  }
  if (silent) identification_.OnLost();
  if (closes) {
    goes_on_ = true;
    return Then::ask_again;
  }
  if (task.kind != Task::Kind::poll || !silent) return Then::done;
  return plan_.OnSilent(task.query, now) == PlanChange::nothing ? Then::done : Then::replan;
}

/// Repeats a read together with the telegrams that go before it. The read alone could be answered
/// for another channel: the device may have restarted, or selects a channel for one telegram only.
std::optional<Request> TelegramConversation::Instead(const Request& request, Outcome outcome,
                                                     Instant) {
  const bool hangs = !request.context.empty() && exchanges_.under_way();
  if (!hangs || !request.expect.repeatable) return std::nullopt;
  if (outcome == Outcome::unexpected) return request;  // the right answer can still come
  if (repeated_ || 2 * exchanges_.size() >= std::size_t{kMostSteps}) return std::nullopt;
  repeated_ = true;
  exchanges_.BeginAgain();
  auto first = AskStep();
  return first ? std::optional(std::move(*first)) : std::nullopt;
}

void TelegramConversation::OnReconnect() {
  goes_on_ = identifies_ = false;
  identification_.OnReconnect();
  exchanges_.Break();
  exchanges_.Forget();
  probes_.OnReconnect();
  plan_.OnReconnect();
}

config::Timing TelegramConversation::LeastTimes(Duration) const {
  config::Timing times;
  for (const Telegram& telegram : settings_.description->telegrams) {
    if (telegram.idle > times.gap.value_or(Duration::zero())) times.gap = telegram.idle;
  }
  return times;
}

}  // namespace baudgate::protocols::telegram
