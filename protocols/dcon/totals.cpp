// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/totals.h"

#include <algorithm>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr std::uint64_t kModulusOfDecimal = 65536;
constexpr int kUnansweredTotals = 2;
// Added to the time between two readings, because the times of readings are inexact.
constexpr Duration kSlack = 2s;

/// If a count has decreased, the counter has rolled over or was cleared. It has rolled over if the
/// pulses since the last count are at most 1/kPartOfRollOver of the counter's range.
constexpr std::uint64_t kPartOfRollOver = 4;

std::string_view Cut(std::string_view& text, char at) {
  const auto end = std::min(text.find(at), text.size());
  const std::string_view part = Trim(text.substr(0, end));
  text.remove_prefix(std::min(end + 1, text.size()));
  return part;
}

}  // namespace

Totals::Totals(const Settings& settings, const Probing::Reads& reads)
    : settings_(settings), reads_(reads) {
  for (const auto& read : reads) {
    if (!read || !read->total || Find(read->command) != nullptr) continue;
    Counter counter;
    counter.command = read->command;
    counter.modulus =
        read->form == Form::decimal ? kModulusOfDecimal : settings.counter_maximum + 1;
    counters_.push_back(std::move(counter));
  }
}

Totals::Counter* Totals::Find(std::string_view command) {
  const auto found = std::ranges::find(counters_, command, &Counter::command);
  return found == counters_.end() ? nullptr : &*found;
}

bool Totals::WantsRestart(std::string_view command) const {
  return is_due_ && context_ &&
         std::ranges::find(counters_, command, &Counter::command) != counters_.end();
}

void Totals::OnRestart(std::optional<bool> restarted) {
  is_due_ = false;
  silences_ = 0;
  context_ = restarted.has_value();
  if (!restarted.value_or(false)) return;
  for (Counter& counter : counters_) BeginAnew(counter);
}

void Totals::OnNothing() {
  if (++silences_ == kUnansweredTotals) OnRestart(std::nullopt);
}

void Totals::OnReconnect() {
  is_due_ = true;
  silences_ = 0;
  context_ = true;
  for (Counter& counter : counters_) counter.seen.reset();
}

void Totals::OnCleared(std::string_view command) {
  if (Counter* counter = Find(command)) BeginAnew(*counter);
}

/// True if a counter can count `step` pulses in `time`, according to the option count_rate.
bool Totals::CanCount(std::uint64_t step, Duration time) const {
  const std::chrono::duration<double> seconds = time + kSlack;
  return settings_.count_rate == 0 ||
         static_cast<double>(step) <= settings_.count_rate * seconds.count();
}

void Totals::BeginAnew(Counter& counter) {
  counter.begins_anew = true;
  counter.seen.reset();
}

void Totals::Believe(Counter& counter, const Seen& seen, std::uint64_t step) {
  counter.total += step;
  counter.count = seen.count;
  counter.at = seen.at;
  counter.begins_anew = false;
}

/// True if the reading `seen` can follow the last confirmed count without a roll-over or a clear:
/// the count has not decreased, and its increase is possible in the time (CanCount).
bool Totals::Follows(const Counter& counter, const Seen& seen) const {
  return seen.count < counter.modulus && seen.count >= *counter.count &&
         (!counter.at || CanCount(seen.count - *counter.count, seen.at - *counter.at));
}

/// Returns the pulses since the last confirmed count if the count has decreased: the pulses over a
/// roll-over, or 0 after a clear.
std::uint64_t Totals::StepTo(const Counter& counter, const Seen& seen) const {
  if (seen.count >= *counter.count || seen.count >= counter.modulus) return 0;
  const std::uint64_t step = seen.count + counter.modulus - *counter.count;
  const bool can = !counter.at || CanCount(step, seen.at - *counter.at);
  return can && step <= counter.modulus / kPartOfRollOver ? step : 0;
}

/// Takes a reading of a counter. Returns false as long as its count is unconfirmed. A changed count
/// is confirmed when the next reading is equal or higher by a possible step. The lower of the two
/// counts is then accepted, because that many pulses were counted even if one reading is damaged.
bool Totals::TakeCount(Counter& counter, const Seen& seen) {
  const std::optional<Seen> before = std::exchange(counter.seen, seen);
  const bool confirmed = before && seen.count >= before->count &&
                         CanCount(seen.count - before->count, seen.at - before->at);
  if (!counter.count || counter.begins_anew) {
    if (confirmed) Believe(counter, *before, counter.count ? 0 : before->count);
    return confirmed;
  }
  const bool follows = Follows(counter, seen);
  if (follows && seen.count == *counter.count) {
    Believe(counter, seen, 0);
    return true;
  }
  if (!confirmed || follows != Follows(counter, *before)) {
    if (!follows) is_due_ = true;
    return false;
  }
  Believe(counter, *before, follows ? before->count - *counter.count : StepTo(counter, *before));
  return true;
}

bool Totals::IsTotal(const Reading& reading) const {
  return reading.point < reads_.size() && reads_[reading.point] && reads_[reading.point]->total;
}

void Totals::Leave(Answer& answer) const {
  std::erase_if(answer.readings, [this](const Reading& reading) { return IsTotal(reading); });
}

Totals::Again Totals::Take(std::string_view command, Answer& answer, Instant now) {
  Counter* counter = Find(command);
  if (counter == nullptr) return Again::no;
  const auto is_total = [this](const Reading& reading) { return IsTotal(reading); };
  const auto first = std::ranges::find_if(answer.readings, is_total);
  if (first == answer.readings.end()) return Again::no;
  if (!std::holds_alternative<std::uint64_t>(first->value)) return Again::no;
  const auto count = std::get<std::uint64_t>(first->value);
  if (!TakeCount(*counter, {count, now})) {
    Leave(answer);
    return Again::unconfirmed;
  }
  for (Reading& reading : answer.readings) {
    if (is_total(reading)) reading.value = counter->total;
  }
  Note(now);
  return counter->count != count ? Again::has_moved : Again::no;
}

void Totals::Note(Instant now) {
  if (noted_ && now - *noted_ < kBetweenNotes) return;
  std::string text;
  for (const Counter& counter : counters_) {
    if (!counter.count) continue;
    text += (text.empty() ? "" : "; ") + counter.command + " " + std::to_string(*counter.count) +
            " " + std::to_string(counter.total);
  }
  if (text == memory_) return;
  memory_ = std::move(text);
  noted_ = now;
}

void Totals::Recall(std::string_view memory) {
  memory_ = memory;
  while (!memory.empty()) {
    std::string_view part = Cut(memory, ';');
    Counter* counter = Find(Cut(part, ' '));
    const auto count = ParseInteger<std::uint64_t>(Cut(part, ' '));
    const auto total = ParseInteger<std::uint64_t>(part);
    if (counter == nullptr || !count || !total || *count >= counter->modulus) continue;
    counter->count = count;
    counter->total = *total;
  }
}

}  // namespace baudgate::protocols::dcon
