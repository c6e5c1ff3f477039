// The sentences about silence: of all devices, of one, or now and then.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <optional>
#include <vector>

#include "gateway/base/port_holders.h"
#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/absences.h"
#include "gateway/diagnosis/causes/hypotheses.h"

namespace baudgate::control {
namespace {

/// XON and XOFF, where they are an address.
constexpr const char* kFlowControl[] = {"17", "19"};

/// What all devices of a line share, none of which answers.
std::string Shared(const Evidence& evidence) {
  if (!OnWire(evidence)) {
    const std::string counterpart(evidence.traits().counterpart);
    return "check what they share: the server at " + evidence.line->port +
           (evidence.answered || counterpart.empty()
                ? ""
                : "; if that is a plain serial server: protocol: " + counterpart);
  }
  if (evidence.answered) {
    return IsBehindServer(evidence)
               ? std::string("check what they share: port of the serial server, power, wiring")
               : "check what they share: power, wiring, adapter; or " + OtherReader(evidence);
  }
  if (IsBehindServer(evidence)) {
    return "check what they share: power and wiring of the bus, then " + Settings(evidence.first());
  }
  return "check what they share: wiring (A and B), power, " + Settings(evidence.first()) +
         ", direction control of the converter; or " + OtherReader(evidence);
}

/// What is not proven right by a neighbour or by its own past.
std::string Unproven(const Evidence& evidence) {
  if (evidence.device == nullptr) return Shared(evidence);
  const DeviceRecord& record = evidence.first();
  const std::string& address = record.device->address;
  const std::string counterpart(evidence.traits().counterpart);
  if (evidence.answered && !evidence.fell.empty() && !OnWire(evidence)) {
    return "as from " + evidence.fell + " since the same moment: the server at " +
           evidence.line->port + " hangs (restart it), or what is behind it has no power";
  }
  if (evidence.answered && !evidence.fell.empty()) {
    return "as from " + evidence.fell +
           " since the same moment: look at what they share, a branch of the line or its power";
  }
  if (evidence.answered && OnWire(evidence))
    return "check its power and its wire, or whether its settings were changed";
  if (evidence.answered && !OnWire(evidence) && evidence.healthy.empty() &&
      evidence.status->port == LineStatus::Port::open) {
    return "the server at " + evidence.line->port +
           " accepts connections and does not answer: restart it, or look at what is behind it";
  }
  if (!OnWire(evidence)) {
    const bool alone = evidence.healthy.empty() && evidence.status->port == LineStatus::Port::open;
    const std::string what = alone ? "the server at " + evidence.line->port +
                                         " accepts connections and does not answer: is unit " +
                                         address + " right (try " +
                                         (address == "255" ? "1" : "255") + ")? Else restart it"
                                   : "check its power, its unit (" + address +
                                         ") and what is behind " + evidence.line->port;
    return what;
  }
  if (evidence.healthy.empty() && IsBehindServer(evidence)) {
    return "check its power, wire and address (" + address + "), then " + Settings(record) +
           (counterpart.empty() ? "" : "; or set protocol: " + counterpart);
  }
  if (evidence.healthy.empty()) {
    return "check its power and wiring (A and B swapped?), then address (" + address + "), " +
           Settings(record);
  }
  if (std::ranges::find(kFlowControl, address) != std::end(kFlowControl)) {
    return "check its power and wire; or a converter takes its address (" + address +
           ") for XON/XOFF: switch that off";
  }
  return "check its power and wire, then its address (" + address + "), " + Settings(record);
}

/// Single losses at random.
std::string SayLosses(const Evidence& evidence) {
  if (evidence.shared_period) {
    return "every " + FormatAge(*evidence.shared_period) + " requests to it or " + evidence.losing +
           " get no answer: look at what they share: supply, branch of the line, radio or server";
  }
  if (!evidence.losing.empty()) {
    return "requests get no answer when those of " + evidence.losing +
           " get none: look at what they share: supply, branch of the line, radio or server";
  }
  const std::string cause = "single requests get no answer: ";
  if (!OnWire(evidence)) {
    return cause + "the server or the network loses them, or it is asked too fast (raise its poll)";
  }
  if (IsBehindServer(evidence)) {
    return cause + "noise or a bad wire behind the serial server, or the network loses them";
  }
  if (!evidence.healthy.empty()) return cause + "noise, a bad wire or plug at its end";
  return cause + "noise, a bad wire or plug; or " + OtherReader(evidence);
}

/// "it is away for about 4 s every 9 s".
std::string SayAbsences(const Evidence& evidence, const Absences& absences) {
  const std::string every =
      absences.period ? " every " + FormatAge(*absences.period) : std::string(" now and then");
  const std::string length = " away for about " + FormatAge(absences.length);
  const std::string away = absences.times > 1 ? "it is" + length + every : "it was" + length;
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  if (!others.empty()) {
    return away + ", at the same time as " + others +
           ": look at the supply or the branch of the line that they share";
  }
  if (!OnWire(evidence)) {
    return away + ": look at the server (power, restarts, dead connections) and the network (NAT)";
  }
  return away + ": look for restarts, its power and a loose wire";
}

}  // namespace

std::string OtherReader(const Evidence& evidence) {
  return "another program reads the port (" + NameHolders(evidence.line->port) + ")";
}

std::string SaySilent(const Evidence& evidence) {
  const FailureRuns* const failures =
      evidence.device == nullptr ? nullptr : &evidence.device->status.failures;
  const bool now_and_then = failures != nullptr && IsUsualSilence(*failures, evidence.now);
  const Finding* const words =
      evidence.device == nullptr ? nullptr : &evidence.device->status.findings.LatestWords();
  if (evidence.absent && words != nullptr && !words->remedy.empty()) {
    return words->cause + " came, and nothing since: " + words->remedy;
  }
  if ((evidence.absent && !now_and_then) || evidence.failed == evidence.looked) {
    const bool fell = evidence.answered && !evidence.fell.empty();
    return (evidence.answered ? "not a byte comes any more" : "not a byte came") +
           std::string(fell ? ", " : ": ") + Unproven(evidence);
  }
  const auto absences = failures == nullptr ? std::nullopt : FindAbsences(*failures);
  const bool own = absences && !evidence.shared_period && !HasDeadQuery(*evidence.device);
  return own ? SayAbsences(evidence, *absences) : SayLosses(evidence);
}

}  // namespace baudgate::control
