// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/load_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/set4tm/codec.h"

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

std::optional<Instant> LoadSession::due() const {
  std::optional<Instant> soonest;
  for (const State& state : states_) {
    if (state.refused || (soonest && *soonest <= state.due)) continue;
    soonest = state.due;
  }
  return recalled_ ? soonest : std::nullopt;
}

// ---------------------------------------------------------------- what is kept

std::string LoadSession::Said(const State& instead, const LoadPlace& place) const {
  std::string text = std::to_string(meter_.value_or(0)) + ' ';
  for (const State& state : states_) {
    const bool is_this = &state == &instead;
    if (!is_this && (told_meter_ || state.kept.empty())) continue;
    if (text.back() != ' ') text += ';';
    text += fmt::format("{}:{}", state.reader.profile(), is_this ? place.Text() : state.kept);
  }
  return text;
}

void LoadSession::Keep(State& state, std::string_view place, bool another) {
  if (!another && place == state.kept) return;
  state.kept = another ? std::string() : std::string(place);
  state.reader.OnKept(LoadPlace::Parse(place), another);
  state.due = state.reader.GoOn(manner()) ? latest_ : latest_ + kLook;
}

void LoadSession::OnKept(std::string_view said) {
  recalled_ = true;
  const auto head = said.find(' ');
  const auto meter = head == std::string_view::npos
                         ? std::nullopt
                         : ParseInteger<std::uint32_t>(said.substr(0, head));
  if (!meter) return;
  told_meter_.reset();
  const bool another = meter_ && *meter != 0 && *meter != *meter_;
  if (!meter_ && *meter != 0) told_meter_ = *meter;
  for (const std::string_view part : Split(said.substr(head + 1), ';')) {
    for (State& state : states_) {
      const std::string name = std::to_string(state.reader.profile()) + ':';
      if (part.starts_with(name)) Keep(state, part.substr(name.size()), another);
    }
  }
}

void LoadSession::OnMeter(std::uint32_t serial) {
  meter_ = serial;
  const auto told = std::exchange(told_meter_, std::nullopt);
  if (!told || *told == serial) return;
  for (State& state : states_) {
    if (!state.kept.empty()) Keep(state, std::string(state.kept), true);
  }
}

void LoadSession::OnType(std::optional<std::uint8_t> type) {
  const bool is_short = !type || std::ranges::count(kShortTypes, *type) > 0;
  most_ = is_short ? kShortReply : kLongReply;
}

// ---------------------------------------------------------------- what is asked, and comes

Bytes LoadSession::Next(Instant now) {
  latest_ = now;
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

Answer LoadSession::OnData(View data, const Scale& scale, Instant now) {
  State& state = states_[asked_];
  LoadReader& reader = state.reader;
  latest_ = now;
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
      // SET-4TM.03 may put two bytes behind the id (reference, chapter 11).
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
  state.due = more ? now : now + kLook;
  return answer;
}

/// Of profile memory by 0C: 06 does the same. Otherwise this meter has no such profile.
Answer LoadSession::OnRefused(Answer answer, Instant now) {
  State& state = states_[asked_];
  latest_ = state.due = now;
  if (state.reader.step() == LoadReader::Step::memory && tagged_) {
    tagged_ = false;
    for (State& one : states_) one.reader.BreakOff();
    return {};
  }
  state.refused = true;
  answer.readings.clear();
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
    state.due = latest_;
  }
}

std::string LoadSession::Shown() const {
  std::string text;
  if (blind_) return "no load profile: set meter_constant, voltage_ratio and current_ratio";
  for (const State& state : states_) {
    const auto end = state.reader.end();
    const std::string name = NameOfLoad(state.reader.profile());
    if (state.refused) {
      text += (text.empty() ? "" : ", ") + ("no " + name + ": it refuses it");
    } else if (end) {
      text += (text.empty() ? "" : ", ") + name + " read to " + FormatWallTime(WallTime(*end));
    }
    if (!state.refused && state.reader.waits()) {
      text += (text.empty() ? "" : ", ") + name +
              ": the meter has not written the header of its current hour yet";
    }
  }
  return text;
}

}  // namespace baudgate::protocols::set4tm
