// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/probing.h"

#include <algorithm>

namespace baudgate::protocols::dcon {
namespace {

constexpr const char* kReadAll = "#";
constexpr std::size_t kProbesOfOwnMode = 3;  // then one of the other

/// Rough length of a reply, to find the cheapest probe.
std::size_t Cost(Form form, std::size_t points) {
  if (form == Form::numbers) return 2 + 7 * points;
  return form == Form::words ? 2 + 4 * points : 10;
}

/// What is answered as no poll is: the name, or one channel where polls read all of them together.
/// Empty: there is no such request.
std::string OwnProbe(const Settings& settings, const Probing::Reads& reads, bool polls,
                     std::size_t channels) {
  if (settings.identify || !polls) return kAskName;
  // One channel is a poll of its own where any command but `#` begins with '#'.
  bool all_together = false;
  for (const auto& read : reads) {
    if (!read || read->command[0] != '#') continue;
    if (read->command != kReadAll) return {};
    all_together = true;
  }
  if (!all_together || channels < 2) return {};
  std::size_t first = channels;
  for (const auto& read : reads) {
    if (read && read->command == kReadAll) first = std::min<std::size_t>(first, read->index);
  }
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return first < kDigits.size() ? kReadAll + std::string(1, kDigits[first]) : std::string();
}

ProbeChoice::Own KindOf(std::string_view own) {
  if (own.empty()) return ProbeChoice::Own::none;
  return own == kAskName ? ProbeChoice::Own::identification : ProbeChoice::Own::read;
}

}  // namespace

Probing::Probing(const Settings& settings, const Reads& reads, const QueryPlan<Read>& plan,
                 std::size_t channels)
    : settings_(settings),
      plan_(plan),
      own_(OwnProbe(settings, reads, !plan.queries().empty(), channels)),
      choice_(KindOf(own_)) {}

bool Probing::IsInOtherMode() const {
  return settings_.identify && unanswered_ % (kProbesOfOwnMode + 1) == kProbesOfOwnMode;
}

/// A read in place of its own probe: the cheapest that is known to work; while none is, the first,
/// because profiles begin with what always works.
std::string Probing::Command(const Identification& identification) const {
  std::vector<std::string> reads;
  std::size_t best = 0;
  std::size_t best_cost = 0;
  for (std::size_t query = 0; query < plan_.queries().size(); ++query) {
    const Read& read = plan_.block(query).key;
    const bool allowed =
        Identification::IsHarmless(read.command) || identification.Allows(read.command);
    if (!IsRepeatable(read.command) || !allowed) continue;
    reads.push_back(read.command);
    const std::size_t cost = Cost(read.form, plan_.queries()[query].points.size());
    if (!plan_.IsProven(query) || (best_cost != 0 && cost >= best_cost)) continue;
    best = reads.size() - 1;
    best_cost = cost;
  }
  const auto read = choice_.Next(reads.size(), best);
  if (read) return reads[*read];
  return own_.empty() ? kAskName : own_;
}

void Probing::OnAnswered(std::string_view command) {
  unanswered_ = 0;
  choice_.OnAnswered(IsOwn(command));
}

void Probing::OnPolled() {
  unanswered_ = 0;
  choice_.OnPolled();
}

bool Probing::OnFailed(bool own, bool silent) {
  unanswered_ = silent ? unanswered_ + 1 : 0;
  return choice_.OnFailed(own && silent);
}

}  // namespace baudgate::protocols::dcon
