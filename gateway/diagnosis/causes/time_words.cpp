// The sentences about time: replies that are late or in pieces, requests that come too soon or
// behind a rest.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/hypotheses.h"
#include "gateway/diagnosis/causes/words.h"

namespace baudgate::control {
namespace {

using enum Symptom;

/// No device that needs a pause needs a shorter one.
constexpr Duration kPause = 100ms;
/// A device that needs more loses every other request, or it is a radio.
constexpr Duration kUsualPause = 200ms;
/// More is hardly meant.
constexpr Duration kLongestQuiet = 3s;
/// A suggested time is so much longer than what was seen.
constexpr double kMargin = 1.25;
/// Nothing is lost by a longer idle time.
constexpr double kWideMargin = 1.5;

/// A time for the configuration, in round numbers: "150ms".
std::string Suggest(Duration seen, double margin = kMargin) {
  const double ms = margin * std::chrono::duration<double, std::milli>(seen).count();
  const double step = ms < 100 ? 10 : ms < 1000 ? 50 : 500;
  const auto round = static_cast<std::int64_t>(step * std::ceil(ms / step + 0.01));
  return fmt::format("{}ms", round);
}

/// "and timing.gap is 50 ms: set timing: { gap: 150ms } at the device".
std::string AndSet(const char* time, std::optional<Duration> now, Duration seen) {
  return fmt::format("and timing.{} is {} ms: set timing: {{ {}: {} }} in the configuration", time,
                     Milliseconds(now.value_or(Duration{})), time, Suggest(seen));
}

}  // namespace

std::string SayLate(const Evidence& evidence) {
  const auto reply = evidence.first().status.timing.reply;
  const Duration seen = evidence.Last(late).time;
  const std::string& others = evidence.away.empty() ? evidence.losing : evidence.away;
  // A device that is always slow is so by itself.
  const bool stalls =
      evidence.line->is_network() && !others.empty() && 2 * evidence.failed < evidence.looked;
  return fmt::format("its replies come up to {} ms after the request, ", Milliseconds(seen)) +
         AndSet("reply", reply, std::max(seen, reply.value_or(Duration{}))) +
         (stalls ? "; those of " + others +
                       " are late at the same times: look for stalls of the "
                       "network or the server"
                 : "");
}

std::string SaySplit(const Evidence& evidence) {
  const Duration seen = evidence.Last(split).time;
  const std::string pauses =
      fmt::format("come in pieces, with pauses of up to {} ms", Milliseconds(seen));
  if (evidence.first().status.unasked) {
    return "they " + pauses + ": set idle: " + Suggest(seen, kWideMargin) +
           " in the configuration, or switch the packing of the serial server off";
  }
  return "its replies " + pauses + ", " + AndSet("gap", evidence.first().status.timing.gap, seen);
}

std::string SayTooFast(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  const Duration pause = findings.ShortPause();
  const auto known = findings.ShortestAnswered();
  const std::string cause = fmt::format(
      "requests get no answer that come soon ({} ms) behind a telegram: ", Milliseconds(pause));
  const Duration probable = std::max<Duration>(kPause, 2 * pause);
  const auto set = [](Duration quiet, double margin) {
    return "timing: { quiet: " + Suggest(quiet, margin) + " } in the configuration";
  };
  if (!known || *known > kLongestQuiet)
    return cause + "try " + set(probable, kMargin) + ", then more";
  // It has answered behind this pause, and behind no shorter one.
  const Duration enough = std::max<Duration>(kPause, *known);
  if (pause >= kUsualPause) return cause + "it loses every other one, or needs " + set(enough, 1);
  if (enough <= kMargin * kWideMargin * probable) return cause + "set " + set(enough, 1);
  return cause + "try " + set(probable, kMargin) + ", then more (" + Suggest(enough, 1) +
         " is enough)";
}

std::string SayAsleep(const Evidence& evidence) {
  return "requests get no answer behind a rest of " +
         FormatAge(evidence.device->status.findings.LongRest()) +
         ", and their repeats do: it or its radio sleeps: shorten its poll, or switch sleep off";
}

}  // namespace baudgate::control
