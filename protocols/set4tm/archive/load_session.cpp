// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/load_session.h"

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/base/time.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/meter/status.h"

namespace baudgate::protocols::set4tm {
namespace {

/// Memory of profiles 1, 2, 3 (reference, chapter 11).
constexpr std::array<std::uint8_t, 3> kMemoryOf = {0x03, 0x08, 0x09};
constexpr std::uint8_t kPointer = 0x04;
constexpr std::uint8_t kInterval = 0x06;
/// Data of a reply: 16 bytes of old meters, 93 of all others (reference, chapter 3).
constexpr std::size_t kShortReply = 16;
constexpr std::size_t kLongReply = 88;
constexpr std::array<std::uint8_t, 4> kShortTypes = {0, 2, 4, 9};

/// The first profile is asked for without its number: all meters know that.
Bytes Ask(std::uint8_t parameter, unsigned profile) {
  Bytes pdu = {kRead, parameter};
  if (profile > 1) pdu.push_back(static_cast<std::uint8_t>(profile - 1));
  return pdu;
}

}  // namespace

LoadSession::LoadSession(const Settings& settings) {
  if (!settings.time_zone) return;
  for (const unsigned profile : settings.load_profiles) {
    const auto bytes = static_cast<std::size_t>(settings.load_records) * kLoadRecord;
    states_.push_back({.reader = {profile, *settings.time_zone, bytes}});
  }
}

std::optional<Instant> LoadSession::NextDue() const {
  std::optional<Instant> soonest;
  for (const State& state : states_) {
    if (!state.refused) soonest = Soonest({soonest, state.due});
  }
  return soonest;
}

// ---------------------------------------------------------------- what is kept

std::string LoadSession::Said(const State& instead, const LoadPlace& place) const {
  KeptParts kept{.meter = meter_.serial()};
  for (const State& state : states_) {
    const bool is_this = &state == &instead;
    if (!is_this && (meter_.is_open() || state.kept.empty())) continue;
    kept.parts.push_back(
        {std::to_string(state.reader.profile()), is_this ? place.Text() : state.kept});
  }
  return kept.Text();
}

void LoadSession::Keep(State& state, std::string_view place, bool another) {
  if (!another && place == state.kept) return;
  state.kept = another ? std::string() : std::string(place);
  state.reader.OnKept(LoadPlace::Parse(place), another);
  state.due = state.reader.GoOn(manner()) ? latest() : latest() + kLook;
}

void LoadSession::Recall(std::string_view said) {
  const auto kept = KeptParts::Parse(said);
  if (!kept) return;
  const bool another = meter_.OnKept(kept->meter);
  for (const KeptParts::Part& part : kept->parts) {
    for (State& state : states_) {
      if (part.name == std::to_string(state.reader.profile())) Keep(state, part.text, another);
    }
  }
}

void LoadSession::OnMeter(std::uint32_t serial) {
  if (!meter_.OnMeter(serial)) return;
  for (State& state : states_) {
    if (!state.kept.empty()) Keep(state, std::string(state.kept), true);
  }
}

void LoadSession::OnType(std::optional<std::uint8_t> type) {
  const bool is_short = !type || std::ranges::count(kShortTypes, *type) > 0;
  most_ = is_short ? kShortReply : kLongReply;
}

// ---------------------------------------------------------------- what is asked, and comes

Bytes LoadSession::NextPdu() {
  const auto first = std::ranges::min_element(
      states_, {}, [](const State& state) { return std::pair(state.refused, state.due); });
  asked_ = static_cast<std::size_t>(first - states_.begin());
  const LoadReader& reader = first->reader;
  if (reader.step() == LoadReader::Step::interval) return Ask(kInterval, reader.profile());
  if (reader.step() == LoadReader::Step::pointer) return Ask(kPointer, reader.profile());
  const MemoryRead::Stretch stretch = reader.stretch();
  Bytes pdu = {kMemory};
  if (tagged_) pdu = {kMemoryTagged, ++id_};
  const auto byte = [](std::size_t number) { return static_cast<std::uint8_t>(number & 0xFFU); };
  Append(pdu, Bytes{kMemoryOf[reader.profile() - 1], byte(stretch.address >> 8U),
                    byte(stretch.address), byte(stretch.count)});
  return pdu;
}

Answer LoadSession::TakeData(View data, const Scale& scale) {
  State& state = states_[asked_];
  LoadReader& reader = state.reader;
  Answer answer;
  bool more = true;
  switch (reader.step()) {
    case LoadReader::Step::interval:
      more = data.size() == 2 && reader.OnInterval(data[1]);
      break;
    case LoadReader::Step::pointer:
      blind_ = !FactorOf(Measure::energy, scale);
      more = !blind_ && reader.OnPointer(data, manner());
      break;
    case LoadReader::Step::memory: {
      // SET-4TM.03 may put two bytes after the id (reference, chapter 11).
      const std::size_t count = reader.stretch().count;
      if (data.size() < count) break;
      LoadReader::Taken taken = reader.OnMemory(data.last(count), scale, manner());
      more = taken.more;
      if (taken.records.empty()) break;
      answer.batch = EventBatch{};
      answer.batch->said = Said(state, taken.place);
      answer.batch->past = std::move(taken.records);
      break;
    }
  }
  state.due = more ? latest() : latest() + kLook;
  return answer;
}

/// If reading memory by 0C is refused, 06 does the same. Otherwise this meter has no such profile.
Answer LoadSession::Refused(Answer answer) {
  State& state = states_[asked_];
  state.due = latest();
  if (state.reader.step() == LoadReader::Step::memory && tagged_) {
    tagged_ = false;
    for (State& one : states_) one.reader.BreakOff();
    return {};
  }
  state.refused = true;
  return answer;
}

void LoadSession::OnFailure(Instant now) {
  if (states_.empty()) return;
  states_[asked_].reader.BreakOff();
  states_[asked_].due = now + kRest;
}

void LoadSession::OnReconnect() {
  tagged_ = true;
  for (State& state : states_) {
    state.reader.OnReconnect();
    state.refused = false;
    state.due = latest();
  }
}

void LoadSession::ForgetRefusals() {
  for (State& state : states_) {
    if (std::exchange(state.refused, false)) state.due = latest();
  }
}

std::string LoadSession::Shown() const {
  if (blind_) return "no load profile: set meter_constant, voltage_ratio and current_ratio";
  std::vector<std::string> shown;
  for (const State& state : states_) {
    const auto end = state.reader.end();
    const std::string name = NameOfLoad(state.reader.profile());
    if (state.refused) {
      shown.push_back("no " + name + ": it refuses it");
      continue;
    }
    if (!state.reader.trouble().empty()) shown.push_back(name + ": " + state.reader.trouble());
    if (end) shown.push_back(name + " read to " + FormatWallTime(WallTime(*end)));
    if (state.reader.waits()) {
      shown.push_back(name + ": the meter has not written the header of its current hour yet");
    }
  }
  return Listed(shown);
}

}  // namespace baudgate::protocols::set4tm
