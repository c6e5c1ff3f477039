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

Observer::Observer(const bus::Roster& roster) : roster_(roster) {
  if (bus::Device* const speaker = roster.Speaker()) overheard_.emplace(*speaker, roster);
}

std::unique_ptr<bus::LineObserver> Observe(const bus::Roster& roster) {
  return std::make_unique<Observer>(roster);
}

std::optional<Finding> Observer::OnUnaskedBytes(View bytes, Instant now) {
  return overheard_ ? overheard_->Hear(bytes, now) : std::nullopt;
}

bool Observer::IsNegotiation(View bytes) const { return IsTelnet(bytes); }

void Observer::OnRequest(const bus::Member& member, const protocols::Request& request,
                         Instant now) {
  Bytes unanswered;  // what came to its last request
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

/// The same came to other requests before.
Finding Observer::LookAgain(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool right = IsAnswered(finding.symptom);
  // A Modbus TCP reply says by its number that it is another one's.
  const bool told = exchange_.member()->protocol->tcp && !finding.remedy.empty();
  const bool same = habits_.NoteSame(exchange_, exchange_.outcome() == Outcome::ok);
  if (!same || right || told) return finding;
  const bool text = std::ranges::all_of(heard, IsPrintable);
  return {.symptom = Symptom::same_again,
          .bytes = heard.size(),
          .cause = text ? Quote(heard) : std::string()};
}

/// A greeting of the connection may say why no device answers.
Finding Observer::Greet(Finding finding) {
  const Bytes& heard = exchange_.heard();
  const bool speaks =
      finding.symptom == Symptom::text ||
      (roster_.is_network() && OtherService(heard, exchange_.member()->protocol->tcp));
  greeting_.NoteExchange(heard, speaks);
  if (IsAnswered(finding.symptom) || greeting_.text().empty()) return finding;
  return Greeting(exchange_.AsHearing(roster_), greeting_.text()).value_or(finding);
}

std::vector<bus::EarlierFinding> Observer::TakeChanged() {
  std::vector<bus::EarlierFinding> changed;
  if (auto more = More()) changed.push_back({exchange_.member(), std::move(*more)});
  while (auto earlier = earlier_.Take()) changed.push_back(std::move(*earlier));
  return changed;
}

/// More has come after the end of the exchange. Empty: it looks as before.
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
/// Messages that are further apart are two.
constexpr Duration kLongestPause = 2s;

/// With seven data bits and a parity each character has the same one; without it the eighth bit is
/// always 1.
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

/// With what came before the pause it is a whole message. Between two messages the silence is
/// longer.
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
            .remedy = "let it send ASCII alone, without letters such as umlauts"};
  }
  Finding finding = Examine(hearing);
  const bool unsaid = finding.symptom == Symptom::odd && finding.cause.empty();
  if (unsaid || IsAnswered(finding.symptom)) finding.symptom = Symptom::damaged;
  return finding;
}

}  // namespace baudgate::diagnosis
