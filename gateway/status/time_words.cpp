// The sentences about time: replies that are late or in pieces, requests that come too soon or
// behind a rest.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gateway/base/shown.h"
#include "gateway/status/hypothesis_words.h"
#include "gateway/status/words.h"

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

}  // namespace

std::string SayLate(const Evidence& evidence) {
  const Duration reply = evidence.first().status.timing.reply.value_or(Duration{});
  const Duration seen = evidence.Last(late).time;
  return fmt::format(
      "its replies come up to {} ms after the request, and timing.reply is {} ms: set timing: {{ "
      "reply: {} }} at the device",
      Milliseconds(seen), Milliseconds(reply), Suggest(std::max(seen, reply)));
}

std::string SaySplit(const Evidence& evidence) {
  if (evidence.first().status.unasked) {
    const Duration pause = evidence.Last(split).time;
    return fmt::format(
        "they come in pieces, with pauses of up to {} ms: set idle: {} at the device, or switch "
        "the "
        "packing of the serial server off",
        Milliseconds(pause), Suggest(pause, kWideMargin));
  }
  const Duration gap = evidence.first().status.timing.gap.value_or(Duration{});
  const Duration seen = evidence.Last(split).time;
  return fmt::format(
      "its replies come in pieces, with pauses of up to {} ms, and timing.gap is {} ms: set "
      "timing: {{ gap: {} }} at the device",
      Milliseconds(seen), Milliseconds(gap), Suggest(seen));
}

std::string SayTooFast(const Evidence& evidence) {
  const Findings& findings = evidence.device->status.findings;
  const Duration pause = findings.ShortPause();
  const auto known = findings.ShortestAnswered();
  const std::string cause = fmt::format(
      "requests get no answer that come soon ({} ms) behind a telegram: ", Milliseconds(pause));
  if (!known || *known > kLongestQuiet) {
    return cause + "try timing: { quiet: " + Suggest(std::max<Duration>(kPause, 2 * pause)) +
           " } at the device, then more";
  }
  // It has answered behind this pause, and behind no shorter one.
  const std::string quiet =
      "timing: { quiet: " + Suggest(std::max<Duration>(kPause, *known), 1) + " } at the device";
  return cause +
         (pause < kUsualPause ? "set " + quiet : "it loses every other one, or needs " + quiet);
}

std::string SayAsleep(const Evidence& evidence) {
  return "requests get no answer behind a rest of " +
         FormatAge(evidence.device->status.findings.LongRest()) +
         ", and their repeats do: it or its radio sleeps: shorten its poll, or switch sleep off";
}

}  // namespace baudgate::control
