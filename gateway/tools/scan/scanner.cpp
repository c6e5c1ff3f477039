// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/scan/scanner.h"

#include <algorithm>

namespace baudgate::scan {
namespace {

/// How often a found device is asked again: two devices with one address do not always collide.
constexpr int kRepeats = 3;
/// How often a question is sent if another master is active, because some replies then collide with
/// its requests.
constexpr int kTriesInTraffic = 4;
/// Fewer bytes than this are a disturbance of the line, no reply.
constexpr std::size_t kLeastOfReply = 3;
constexpr const char* kTwo = "two devices may have this address; give each device its own";

}  // namespace

Scanner::Scanner(const Wish& wish, const ProfileNames& profiles, Wire& wire, Watcher& watcher)
    : wish_(wish), profiles_(profiles), wire_(wire), watcher_(watcher) {
  report_.network = wish.network;
}

Status Scanner::Run() {
  limit_ = wish_.quick ? wire_.Now() + kQuickLimit : Instant::max();
  Listen();
  const std::vector<scan::Sweep> likely = LikelySweeps(wish_);
  const Duration thorough = TimeOf(ThoroughSweeps(wish_, answered_), wish_);
  for (std::size_t i = 0; i < likely.size() && !is_over(); ++i) {
    Sweep(likely[i], thorough + TimeOf(std::span(likely).subspan(i + 1), wish_));
  }
  const std::vector<scan::Sweep> rest = ThoroughSweeps(wish_, answered_);
  for (std::size_t i = 0; i < rest.size() && !is_over(); ++i) {
    Sweep(rest[i], TimeOf(std::span(rest).subspan(i + 1), wish_));
  }
  Finish();
  return status_;
}

/// Applies serial settings. Returns false if the port does not support them; the caller then skips
/// these settings.
bool Scanner::Set(const config::SerialSettings& serial) {
  if (wish_.network) return true;
  const Status set = wire_.Apply(serial);
  if (!set && refused_.insert(serial.ToString()).second) report_.remarks.push_back(set.error());
  return set.ok();
}

/// Applies serial settings that the port had before. A failure ends the scan.
void Scanner::SetBack(const config::SerialSettings& serial) {
  if (wish_.network) return;
  const Status set = wire_.Apply(serial);
  if (set) return;
  status_ = set;
  End();
}

void Scanner::Listen() {
  Duration left = TimeOf(LikelySweeps(wish_), wish_) + TimeOf(ThoroughSweeps(wish_, {}), wish_);
  std::optional<Talk> talk;
  for (const Listening& listening : ListenFirst(wish_)) {
    watcher_.OnProgress({"listening", 0, left + listening.time});
    if (!Set(listening.serial)) continue;
    const auto gathered = wire_.Listen(listening.time);
    if (!gathered) {
      status_ = Error{gathered.error()};
      return End();
    }
    if (gathered->stopped) return End();
    if (gathered->heard.size() < kLeastOfReply) continue;
    Talk here = WhoTalks(wish_.tongues, gathered->heard, listening.serial);
    if (!talk || here.known) talk = std::move(here);
    if (talk->known) break;
  }
  if (talk) TellForeign(talk->text);
}

void Scanner::TellForeign(const std::string& who) {
  if (traffic_) return;
  report_.remarks.push_back(who);
  traffic_ = watcher_.MayTalk(who);
  if (!traffic_) End();
}

void Scanner::Sweep(const scan::Sweep& sweep, Duration behind) {
  if (!Set(sweep.serial)) return;
  const Tongue& tongue = wish_.tongues[sweep.tongue];
  const Duration whole = TimeOf(sweep, wish_);
  const unsigned count = sweep.addresses.last - sweep.addresses.first + 1;
  const std::string where =
      std::string(tongue.protocol->name) + (wish_.network ? "" : " " + sweep.serial.ToString());
  for (unsigned address = sweep.addresses.first; address <= sweep.addresses.last; ++address) {
    if (wire_.Now() > limit_) {
      report_.remarks.push_back("the time limit of --quick was reached before " + where +
                                ", address " + std::to_string(address));
      return End();
    }
    const unsigned left = sweep.addresses.last - address + 1;
    watcher_.OnProgress({where + ", address " + std::to_string(address), report_.found.size(),
                         behind + whole * left / count});
    if (IsKnown(sweep.tongue, address)) continue;
    for (std::size_t mode = 0; mode < sweep.modes && !is_over(); ++mode) {
      Look({sweep.tongue, sweep.serial, address, mode, 0, sweep.patience}, sweep.finds);
      if (IsKnown(sweep.tongue, address)) break;
    }
    if (is_over()) return;
  }
}

/// True if a device was found at this address: one of this protocol, or of the protocol
/// ScanRule::never_at, for whose devices questions of this protocol are writes.
bool Scanner::IsKnown(std::size_t tongue, unsigned address) const {
  const protocols::Protocol& protocol = *wish_.tongues[tongue].protocol;
  return known_.contains({std::string(protocol.name), address}) ||
         known_.contains({std::string(protocol.scan->never_at), address});
}

void Scanner::Look(Asked asked, std::uint32_t finds) {
  bool proof = false;  // true: the reply could be an echo, so the next question must prove it
  for (std::size_t question = 0; question < TongueAt(asked).rule().questions; ++question) {
    if ((finds >> question & 1U) == 0 && !proof) continue;
    asked.question = question;
    Verdict verdict = Exchange(asked);
    if (is_over()) return;
    proof = verdict.what == Verdict::What::maybe && (verdict.echoed || !report_.echo);
    if (OnVerdict(asked, std::move(verdict))) return;
  }
}

/// Sends a question. If another master is active, repeats it while the reply is unclear.
Verdict Scanner::Exchange(const Asked& asked) {
  Verdict verdict = ExchangeOnce(asked);
  for (int tries = 1; traffic_ && tries < kTriesInTraffic && !is_over(); ++tries) {
    const bool unclear =
        verdict.what == Verdict::What::garbled || verdict.what == Verdict::What::damaged ||
        verdict.what == Verdict::What::other || verdict.what == Verdict::What::foreign;
    if (!unclear) break;
    verdict = ExchangeOnce(asked);
  }
  return verdict;
}

Verdict Scanner::ExchangeOnce(const Asked& asked) {
  const Tongue& tongue = TongueAt(asked);
  const Bytes request = tongue.rule().ask(asked.address, asked.mode, asked.question);
  const config::Timing timing = tongue.protocol->timing(asked.serial);
  report_.asked = true;
  auto gathered = wire_.Ask(request, asked.patience, *timing.gap);
  if (!gathered) {
    status_ = Error{gathered.error()};
    End();
    return {};
  }
  if (gathered->stopped) {
    End();
    return {};
  }
  if (gathered->early.size() >= kLeastOfReply) CheckLate(last_);
  if (is_over()) return {};
  if (last_ && last_->address != asked.address) previous_ = last_;
  last_ = asked;
  Verdict verdict = Judge(tongue, asked.mode, request, *gathered);
  if (verdict.what == Verdict::What::foreign) TellForeign(verdict.text);
  report_.echo = report_.echo || verdict.echoed;
  const bool glitch =
      verdict.what == Verdict::What::garbled && gathered->heard.size() < kLeastOfReply;
  if (glitch) verdict.what = Verdict::What::silence;
  return verdict;
}

/// Called after bytes that came without a request, or from another device than the asked one.
/// `late` may have sent them late, so it is asked again with a longer timeout.
void Scanner::CheckLate(std::optional<Asked> late) {
  if (!late || traffic_ || checking_late_ || IsKnown(late->tongue, late->address)) return;
  late->patience = *TongueAt(*late).protocol->timing(late->serial).reply;
  checking_late_ = true;
  Verdict verdict = ExchangeOnce(*late);
  if (!is_over()) OnVerdict(*late, std::move(verdict));
  checking_late_ = false;
}

/// Handles the verdict about the reply to a question. Returns true if this address needs no further
/// question.
bool Scanner::OnVerdict(const Asked& asked, Verdict verdict) {
  switch (verdict.what) {
    case Verdict::What::device: {
      std::vector<std::string> remarks;
      if (verdict.parity && !wish_.network) {
        TakeInOwnFormat(asked, std::move(verdict));
        return true;
      }
      if (verdict.doubled) remarks.emplace_back(kTwo);
      Take(asked, std::move(verdict.sighting), std::move(remarks));
      return true;
    }
    case Verdict::What::damaged:
      if (TryFormats(asked, "characters with a wrong parity came at " + asked.serial.ToString())) {
        return true;
      }
      OnGarbled(asked);
      return IsKnown(asked.tongue, asked.address);
    case Verdict::What::garbled:
      OnGarbled(asked);
      return IsKnown(asked.tongue, asked.address);
    case Verdict::What::other:
      CheckLate(previous_);
      return false;
    default:
      return false;
  }
}

/// Called for a device that accepts any parity: bit 7 of its reply shows its own character format.
/// Asks it in this format, and records the format if the device answers.
void Scanner::TakeInOwnFormat(Asked asked, Verdict verdict) {
  const Asked before = asked;
  asked.serial.data_bits = 7;
  asked.serial.parity = *verdict.parity;
  const std::string remark = "the device answers at " + asked.serial.ToString() +
                             " to requests at " + before.serial.ToString();
  Verdict own;
  if (Set(asked.serial)) own = Exchange(asked);
  if (is_over()) return;
  const bool better = own.what == Verdict::What::device && !own.parity;
  Take(better ? asked : before, better ? own.sighting : verdict.sighting, {remark});
  if (!is_over()) SetBack(before.serial);
}

bool Scanner::TryFormats(const Asked& asked, const std::string& why) {
  if (wish_.network || traffic_) return false;
  bool found = false;
  for (const auto& serial : OtherFormats(asked.serial, *TongueAt(asked).protocol)) {
    Asked other = asked;
    other.serial = serial;
    if (!Set(serial)) continue;
    Verdict verdict = Exchange(other);
    if (is_over()) return false;
    if (verdict.what != Verdict::What::device || verdict.parity) continue;
    Take(other, std::move(verdict.sighting), {why});
    found = true;
    break;
  }
  SetBack(asked.serial);
  return found;
}

/// Repeats a question whose reply was damaged. If all replies are damaged, tries other formats; if
/// that fails, records that two devices may have this address.
void Scanner::OnGarbled(const Asked& asked) {
  if (traffic_ || checking_late_) return;
  for (int repeat = 0; repeat < 2; ++repeat) {
    Verdict verdict = ExchangeOnce(asked);
    if (is_over()) return;
    if (verdict.what == Verdict::What::device) {
      Take(asked, std::move(verdict.sighting), {kTwo});
      return;
    }
    if (verdict.what != Verdict::What::garbled && verdict.what != Verdict::What::damaged) return;
  }
  if (TryFormats(asked, "only damaged replies came at " + asked.serial.ToString())) return;
  const auto same = [&](const Found& one) {
    return one.address == asked.address && one.protocol == TongueAt(asked).protocol->name;
  };
  if (is_over() || std::ranges::any_of(doubtful_, same)) return;
  Found found;
  found.protocol = TongueAt(asked).protocol->name;
  found.serial = asked.serial;
  found.mode = TongueAt(asked).rule().modes[asked.mode];
  found.address = asked.address;
  found.suspect = true;
  found.remarks = {"only damaged replies came: " + std::string(kTwo)};
  doubtful_.push_back(std::move(found));
}

void Scanner::Take(const Asked& asked, protocols::Sighting sighting,
                   std::vector<std::string> remarks) {
  const Tongue& tongue = TongueAt(asked);
  if (!known_.emplace(std::string(tongue.protocol->name), asked.address).second) return;
  const bool known_as_two = std::ranges::find(remarks, kTwo) != remarks.end();
  const bool shared = known_as_two || IsShared(asked, sighting);
  if (!is_over()) AskName(asked, sighting);
  Found found;
  found.protocol = tongue.protocol->name;
  found.serial = asked.serial;
  found.mode = tongue.rule().modes[asked.mode];
  found.address = asked.address;
  found.identity = sighting.identity;
  found.point = sighting.point;
  found.suspect = shared;
  found.remarks = std::move(remarks);
  if (shared && !known_as_two) found.remarks.emplace_back(kTwo);
  const auto listed = profiles_.find(found.protocol);
  for (const std::string& name : sighting.names) {
    if (listed == profiles_.end() || !found.profile.empty()) break;
    const auto profile = listed->second.find(config::SpokenName(name));
    if (profile != listed->second.end()) found.profile = profile->second;
  }
  if (found.profile.empty() && !tongue.rule().assumed_profile.empty()) {
    found.profile = tongue.rule().assumed_profile;
    found.assumed = true;
  }
  Keep(std::move(found));
}

/// Asks a found device again. Returns true if its replies differ or are damaged, which means that
/// two devices have this address.
bool Scanner::IsShared(const Asked& asked, const protocols::Sighting& sighting) {
  for (int repeat = 0; repeat < kRepeats && !is_over(); ++repeat) {
    const Verdict verdict = ExchangeOnce(asked);
    if (is_over()) return false;
    if (verdict.doubled) return true;
    if (verdict.what == Verdict::What::device) {
      if (verdict.sighting.identity != sighting.identity) return true;
    } else if (!traffic_ &&
               (verdict.what == Verdict::What::garbled || verdict.what == Verdict::What::damaged)) {
      return true;
    }
  }
  return false;
}

void Scanner::AskName(const Asked& asked, protocols::Sighting& sighting) {
  Asked more = asked;
  const protocols::ScanRule& rule = TongueAt(asked).rule();
  // A missing reply is not asked for again, because most devices without a name do not support the
  // question.
  for (std::size_t question = 0; question < rule.questions; ++question) {
    if (!sighting.identity.empty()) return;
    more.question = question;
    if (question == asked.question) continue;
    const Verdict verdict = Exchange(more);
    if (is_over()) return;
    if (verdict.what != Verdict::What::device) continue;
    sighting.identity = verdict.sighting.identity;
    sighting.names = verdict.sighting.names;
    if (sighting.point.empty()) sighting.point = verdict.sighting.point;
  }
}

void Scanner::Keep(Found found) {
  found.unit = UnitFor(report_.found, found.address);
  const bool new_wire = std::ranges::none_of(
      answered_, [&](const auto& serial) { return SameWire(serial, found.serial); });
  if (new_wire) answered_.push_back(found.serial);
  watcher_.OnFound(found);
  report_.found.push_back(std::move(found));
}

/// Drops a device of which only damaged replies came if another protocol has found a device at its
/// address, because that device has sent the replies.
void Scanner::Finish() {
  for (Found& doubtful : doubtful_) {
    const bool explained = std::ranges::any_of(
        report_.found, [&](const Found& one) { return one.address == doubtful.address; });
    if (!explained) Keep(std::move(doubtful));
  }
  doubtful_.clear();
  RemarkFormats(report_.found);
  if (report_.echo)
    report_.remarks.emplace_back(
        "the bus sends every request back (echo); set echo: strip at the line");
}

}  // namespace baudgate::scan
