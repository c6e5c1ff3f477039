// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/observer.h"

#include <algorithm>
#include <bit>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include "gateway/diagnosis/damage/changed_bytes.h"

namespace baudgate::diagnosis {

Observer::Observer(const bus::Roster& roster, bus::PointStore& store)
    : roster_(roster), store_(store) {
  if (bus::Device* const speaker = roster.Speaker()) overheard_.emplace(*speaker, roster);
}

std::unique_ptr<bus::LineObserver> Observe(const bus::Roster& roster, bus::PointStore& store) {
  return std::make_unique<Observer>(roster, store);
}

// ---------------------------------------------------------------- status

void Observer::OnExchange(const bus::EndedExchange& ended, Now now) {
  const bus::Member& member = *ended.member;
  Finding finding = TakeFinding(ended.end.outcome);
  Complete(ended, finding);
  last_[member] = {finding.symptom, finding.asked};
  // An exchange that ended because the connection was closed counts only if bytes came, because the
  // bytes may contain the reason.
  const bool counts = !ended.broadcast && (!ended.cut_off() || finding.bytes > 0);
  if (!counts || member.device == nullptr) return;
  store_.UpdateStatus(member.index, [&](bus::DeviceStatus& status) {
    status.findings.Add(std::move(finding), now.instant);
  });
}

/// Adds to `finding` what the bytes alone do not show: the reason that the device gave, and whether
/// the bus rejected the reply.
void Observer::Complete(const bus::EndedExchange& ended, Finding& finding) {
  const bus::ExchangeEnd& end = ended.end;
  const protocols::Answer& answer = *ended.answer;
  const bus::Unproven* const unproven = ended.unproven;
  const std::string& reason = answer.reason.empty() ? end.reason : answer.reason;
  const bool refuses = ended.answered() && end.outcome != Outcome::ok && !answer.divides;
  finding.outcome = end.outcome;
  finding.ended = end.ended;
  // The reply looks like the reply to the previous request. But the bus has found that it is no
  // copy of an earlier reply (Verdict::odd), so it belongs to this request, and its content does
  // not fit.
  const bool proven = ended.verdict.odd && finding.symptom == Symptom::one_behind;
  if (proven) finding.symptom = Symptom::odd;
  if (refuses || (unproven != nullptr && !unproven->refusal.empty())) {
    finding.symptom = Symptom::refusal;
    if (!refuses) finding.outcome = unproven->refused_as;
    finding.cause = refuses ? reason : unproven->refusal;
    finding.remedy = answer.remedy;
  } else if (unproven != nullptr) {
    finding.symptom = Symptom::doubted;
  } else if (finding.symptom == Symptom::clean && !reason.empty() && !answer.remedy.empty()) {
    finding.symptom = Symptom::no_number;
    finding.cause = answer.reason;
    finding.remedy = answer.remedy;
  } else if (finding.symptom == Symptom::clean && answer.no_number) {
    finding.symptom = Symptom::no_number;
    finding.cause = Printable(ToBytes(*answer.no_number));
  } else if (finding.symptom == Symptom::odd) {
    // Without a reason the reply was good, but belonged to an earlier exchange; so this request got
    // none.
    if (reason.empty()) finding.symptom = Symptom::silence;
    finding.cause = reason;
    finding.remedy = answer.remedy;
  } else if (finding.symptom == Symptom::one_behind && finding.cause.empty()) {
    finding.cause = reason;
  }
}

void Observer::OnPoll(const bus::Device& device, std::size_t query) {
  const Last& last = last_[device];
  store_.UpdateStatus(device.index, [&](bus::DeviceStatus& status) {
    if (query >= status.queries.size()) return;
    bus::QueryCount& count = status.queries[query];
    count.refused = last.symptom == Symptom::refusal ? count.refused + 1 : 0;
    count.symptom = last.symptom;
    count.asked = last.asked;
  });
}

/// Replaces the finding of an earlier exchange of the member, because more bytes came for it.
/// `back`: 0 for its last exchange, 1 for the exchange before.
void Observer::Amend(const bus::Member& member, const Finding& finding, std::size_t back) {
  if (back == 0) last_[member].symptom = finding.symptom;
  if (member.device == nullptr) return;
  store_.UpdateStatus(member.index,
                      [&](bus::DeviceStatus& status) { status.findings.Amend(finding, back); });
}

void Observer::OnUnaskedBytes(View bytes, Instant now) {
  const auto before = overheard_ ? overheard_->Hear(bytes, now) : std::nullopt;
  if (before) Amend(*roster_.Speaker(), *before, 0);
}

void Observer::OnUnasked(const bus::Device& device, Outcome outcome, const std::string& reason,
                         const std::string& remedy, Duration rest, Instant now) {
  Finding finding{.idle = rest};
  if (!ProvesLife(outcome)) {
    finding = overheard_->OnDamaged();
  } else {
    overheard_->OnRead();
    if (!reason.empty()) {
      finding.symptom = Symptom::refusal;
      finding.cause = reason;
      finding.remedy = remedy;
    }
  }
  store_.UpdateStatus(device.index, [&](bus::DeviceStatus& status) {
    status.findings.Add(std::move(finding), now);
  });
}

// ---------------------------------------------------------------- received bytes

bool Observer::IsNegotiation(View bytes) const { return IsTelnet(bytes); }

void Observer::OnRequest(const bus::Member& member, const protocols::Request& request,
                         Instant now) {
  for (const EarlierFinding& changed : TakeChanged()) {
    Amend(*changed.member, changed.finding, changed.back);
  }
  Bytes unanswered;  // bytes that came after the previous request of this member
  if (exchange_.member() == &member) unanswered = exchange_.TakeHeard();
  exchange_.Begin(member, request, member.times, now);
  earlier_.OnBegin(exchange_, std::move(unanswered));
}

void Observer::Hear(View bytes, Instant now) {
  if (exchange_.member() == nullptr) greeting_.Keep(bytes);
  exchange_.Hear(bytes, now);
}

Finding Observer::TakeFinding(Outcome outcome) {
  exchange_.End(outcome);
  if (exchange_.member() == nullptr) return {};
  if (ProvesLife(outcome)) OnAnswered();
  earlier_.NoteSilence(exchange_);
  const bool plain = ProvesLife(outcome) && exchange_.heard().size() == exchange_.frame().size();
  Finding finding = plain ? Plain(exchange_.AsHearing(roster_)) : Look();
  finding = Greet(LookAgain(std::move(finding)));
  finding.idle = exchange_.idle();
  finding.asked = SpecialsOf(exchange_.request().bytes);
  told_ = finding.symptom;
  if (finding.symptom == Symptom::tail_lost || finding.symptom == Symptom::end_lost) {
    earlier_.OnBroken(exchange_);
  }
  return finding;
}

void Observer::OnAnswered() {
  earlier_.OnAnswered(exchange_);
  habits_.OnAnswered(exchange_);
  negotiated_ = IsTelnet(greeting_.OnAnswered(exchange_.heard())) && roster_.is_network();
}

/// Changes the finding to same_again if the same bytes have come after different requests before,
/// unless the request was answered, or a finding with a remedy about Modbus TCP is more certain.
Finding Observer::LookAgain(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool right = IsAnswered(finding.symptom);
  const bool same = habits_.NoteSame(exchange_, exchange_.outcome() == Outcome::ok);
  // A finding about a Modbus TCP reply is certain, because the reply contains a transaction number;
  // but the number is not wrong if the same frame was the right reply before.
  const bool told = exchange_.member()->protocol->tcp && !finding.remedy.empty() &&
                    !habits_.IsLastRight(exchange_);
  if (!same || right || told) return finding;
  const bool text = std::ranges::all_of(heard, IsPrintable);
  return {.symptom = Symptom::same_again,
          .bytes = heard.size(),
          .cause = text ? Quote(heard) : std::string()};
}

/// If no device answers and a greeting explains why, returns a finding about the greeting; else
/// returns `finding`.
Finding Observer::Greet(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool speaks =
      finding.symptom == Symptom::text ||
      (roster_.is_network() && OtherService(heard, exchange_.member()->protocol->tcp));
  greeting_.NoteExchange(heard, speaks);
  if (IsAnswered(finding.symptom) || greeting_.text().empty()) return finding;
  return Greeting(exchange_.AsHearing(roster_), greeting_.text()).value_or(finding);
}

std::vector<EarlierFinding> Observer::TakeChanged() {
  std::vector<EarlierFinding> changed;
  if (auto more = More()) changed.push_back({exchange_.member(), std::move(*more)});
  while (auto earlier = earlier_.Take()) changed.push_back(std::move(*earlier));
  return changed;
}

/// Examines the exchange again if bytes have come after its end. Returns a finding if its symptom
/// has changed.
std::optional<Finding> Observer::More() {
  if (!exchange_.TakeMore()) return std::nullopt;
  Finding finding = Look();
  if (finding.symptom == told_) return std::nullopt;
  if (finding.symptom == Symptom::split) earlier_.OnMended();
  told_ = finding.symptom;
  return finding;
}

Finding Observer::Look() {
  const bool rest = earlier_.FindRest(exchange_);
  const Hearing hearing = exchange_.AsHearing(roster_);
  Finding finding = Examine(hearing);
  if (rest && IsAnswered(finding.symptom)) return Plain(hearing);
  switch (finding.symptom) {
    case Symptom::other_master:
    case Symptom::master_beside:
      if (!earlier_.IsLateEcho(exchange_)) return finding;
      return {.symptom = Symptom::late_echo, .bytes = finding.bytes};
    case Symptom::others_beside:
    case Symptom::copies:
      if (earlier_.FindBeside(exchange_, finding)) return {};
      return habits_.IsCopy(exchange_) ? Finding{.symptom = Symptom::copies} : finding;
    case Symptom::bad_check:
    case Symptom::damaged:
    case Symptom::bytes_lost:
      return habits_.Compare(exchange_, std::move(finding));
    case Symptom::two_replies:
      if (habits_.IsCopy(exchange_)) return {.symptom = Symptom::copies};
      if (const auto late = earlier_.FindLostTry(*exchange_.member(), exchange_.last_came())) {
        return *late;
      }
      [[fallthrough]];
    case Symptom::other_device:
    case Symptom::other_reply:
    case Symptom::odd:
    case Symptom::other_form:
    case Symptom::noise_before:
    case Symptom::noise_behind:
    case Symptom::device_beside:
      return earlier_.Attribute(exchange_, std::move(finding));
    default:
      return finding;
  }
}

namespace {

constexpr std::size_t kMostUnasked = 256;
/// A pause longer than this separates two messages.
constexpr Duration kLongestPause = 2s;

/// True if the eighth bit looks like a parity bit: at least 7 of 8 characters have the same parity,
/// or the bit is always 1 (mark).
bool HasParity(View heard) {
  const auto even =
      std::ranges::count_if(heard, [](auto byte) { return std::popcount(byte) % 2 == 0; });
  const auto size = std::ssize(heard);
  const bool mark = std::ranges::all_of(heard, [](auto byte) { return byte > 0x7F; });
  return mark || 8 * std::max(even, size - even) >= 7 * size;
}

}  // namespace

Overheard::Overheard(const bus::Device& device, const bus::Roster& roster)
    : device_(device), roster_(roster), expect_(device.conversation->Listens()->expect) {}

std::optional<Finding> Overheard::Hear(View bytes, Instant now) {
  std::optional<Finding> before;
  if (now - last_ >= device_.conversation->Listens()->idle) {
    const bool torn = std::exchange(damaged_, false);
    if (torn) before = Look();
    torn_ = torn ? std::move(heard_) : Bytes();
    heard_.clear();
    before_ = std::exchange(pause_, now - last_);
  }
  last_ = now;
  Append(heard_, bytes.first(std::min(bytes.size(), kMostUnasked - heard_.size())));
  return before;
}

Finding Overheard::OnDamaged() {
  damaged_ = true;
  return Look();
}

/// True if heard_ is the second part of the message torn_: together they are a whole message, and
/// the pause between them is short, and shorter than the silence before the first part.
bool Overheard::IsRest() const {
  if (torn_.empty() || pause_ > kLongestPause || 5 * pause_ > 4 * before_) return false;
  const Hearing hearing{
      .protocol = device_.protocol, .options = &device_.options, .expect = &expect_};
  Bytes whole = torn_;
  Append(whole, heard_);
  return !IsWhole(hearing, torn_) && IsWhole(hearing, whole);
}

Finding Overheard::Look() const {
  if (heard_.empty()) return {.symptom = Symptom::damaged};
  if (IsRest()) return {.symptom = Symptom::split, .time = pause_};
  const Hearing hearing{.protocol = device_.protocol,
                        .options = &device_.options,
                        .request = {},
                        .expect = &expect_,
                        .outcome = Outcome::corrupt,
                        .heard = heard_,
                        .arrivals = {},
                        .reply = {},
                        .gap = {},
                        .connection = roster_.is_network(),
                        .foreign = roster_.foreign()};
  Bytes cleared = heard_;
  for (std::uint8_t& byte : cleared) byte &= 0x7F;
  if (cleared != heard_ && IsWhole(hearing, cleared)) {
    if (HasParity(heard_)) return {.symptom = Symptom::eighth_bit};
    return {.symptom = Symptom::other_setting,
            .cause = "characters beyond ASCII come (" + Quote(heard_) + ")",
            .remedy = "set the device to send only ASCII, without letters such as umlauts"};
  }
  Finding finding = Examine(hearing);
  const bool unsaid = finding.symptom == Symptom::odd && finding.cause.empty();
  if (unsaid || IsAnswered(finding.symptom)) finding.symptom = Symptom::damaged;
  return finding;
}

}  // namespace baudgate::diagnosis
