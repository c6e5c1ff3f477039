// The sentences about silence: of all devices, of one, or now and then.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>

#include "gateway/status/hypotheses.h"
#include "gateway/status/hypothesis_words.h"
#include "gateway/status/words.h"

namespace baudgate::control {
namespace {

/// Failures in a row, on the average, from which they are outages and no single losses; and so many
/// times as long a run as single losses of this share make by chance.
constexpr double kOutage = 2.5;
constexpr double kBeyondChance = 1.7;
/// Shorter runs are chance.
constexpr std::size_t kLongRun = 4;
/// The same where its absence lasts longer than single losses do.
constexpr double kLongerThanChance = 1.6;
/// XON and XOFF, where they are an address.
constexpr const char* kFlowControl[] = {"17", "19"};

/// What all devices of a line share, none of which answers.
std::string Shared(const Evidence& evidence) {
  if (!OnWire(evidence)) return "check what they share: the server at " + evidence.line->port;
  if (evidence.answered) {
    return "check what they share: port, power of the bus, wiring (A and B swapped?)";
  }
  if (IsBehindServer(evidence)) {
    return "check what they share: bit rate, parity and wiring at the serial server, power of the "
           "bus, protocol (" +
           evidence.first().device->protocol + ")";
  }
  return "check what they share: wiring (A and B), power, bit rate and parity (" +
         SerialOf(evidence.first()).ToString() + "), direction control of the converter";
}

/// What is not proven right by a neighbour or by its own past.
std::string Unproven(const Evidence& evidence) {
  if (evidence.device == nullptr) return Shared(evidence);
  const DeviceRecord& record = evidence.first();
  const std::string& address = record.device->address;
  if (evidence.answered && !evidence.fell.empty()) {
    return "as from " + evidence.fell +
           " since the same moment: look at what they share, a branch of the line or its power";
  }
  if (evidence.answered && OnWire(evidence)) return "check its power and its wire";
  if (!OnWire(evidence)) {
    const bool other = !evidence.answered && evidence.healthy.empty();
    return "check its power, its unit (" + address + ") and what is behind " + evidence.line->port +
           (other ? "; if that passes RTU on: protocol: modbus_rtu" : std::string());
  }
  if (evidence.healthy.empty() && IsBehindServer(evidence)) {
    const bool modbus = record.device->protocol.starts_with("modbus");
    return "check its power, wire and address (" + address +
           "), and bit rate and parity at the serial server" +
           (modbus ? "; or set protocol: modbus_tcp" : "");
  }
  if (evidence.healthy.empty()) {
    return "check its power and wiring (A and B swapped?), then its settings (" + Settings(record) +
           ", " + record.device->protocol + ")";
  }
  if (std::ranges::find(kFlowControl, address) != std::end(kFlowControl)) {
    return "check its power and wire; or a converter takes its address (" + address +
           ") for XON/XOFF: switch that off";
  }
  const std::string serial =
      IsBehindServer(evidence) ? std::string() : SerialOf(record).ToString() + ", ";
  return "check its power and wire, then its address (" + address +
         "), bit rate, parity and protocol (" + serial + record.device->protocol + ")";
}

/// Single losses at random.
std::string SayLosses(const Evidence& evidence) {
  const std::string cause = "single requests get no answer: ";
  if (!OnWire(evidence)) {
    return cause + "the server or the network loses them, or it is asked too fast (raise its poll)";
  }
  if (IsBehindServer(evidence)) {
    return cause + "noise or a bad wire behind the serial server, or the network loses them";
  }
  if (!evidence.healthy.empty()) return cause + "noise, a bad wire or plug at its end";
  return cause + "noise, a bad wire or plug, or another program that reads the port (fuser -v " +
         evidence.line->port + ")";
}

}  // namespace

bool ComesAndGoes(const Evidence& evidence) {
  if (evidence.device == nullptr || !evidence.answered) return false;
  const Findings& findings = evidence.device->status.findings;
  const std::size_t runs = findings.Runs();
  if (2 * evidence.failed > evidence.looked && findings.LongestRun() == evidence.failed)
    return false;
  if (runs == 0 || findings.LongestRun() < kLongRun) return false;
  // By chance a run of losses is 1 / (1 - share) long, on the average.
  const double good = static_cast<double>(evidence.looked - evidence.failed);
  const double chance = static_cast<double>(evidence.looked) / std::max(good, 1.0);
  const double mean = static_cast<double>(evidence.failed) / static_cast<double>(runs);
  // An absent device is asked more seldom, so that the time of its silence counts as well.
  const double down = Seconds(evidence.minutes.down);
  const double poll = std::max(1.0, Seconds(evidence.device->device->poll));
  const bool away =
      evidence.minutes.outages > 1 && down >= kOutage * poll * evidence.minutes.outages;
  return mean >= std::max(kOutage, kBeyondChance * chance) ||
         (away && mean >= kLongerThanChance * chance);
}

std::string SaySilent(const Evidence& evidence) {
  if (evidence.absent) {
    const bool fell = evidence.answered && !evidence.fell.empty();
    return (evidence.answered ? "not a byte comes any more" : "not a byte came") +
           std::string(fell ? ", " : ": ") + Unproven(evidence);
  }
  if (ComesAndGoes(evidence)) {
    return "it is away for some time and comes back: look for restarts, its power and a loose wire";
  }
  return SayLosses(evidence);
}

}  // namespace baudgate::control
