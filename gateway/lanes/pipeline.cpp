// SPDX-License-Identifier: Apache-2.0
#include "gateway/lanes/pipeline.h"

#include <algorithm>
#include <utility>

#include "gateway/base/modbus_pdu.h"

namespace baudgate {
namespace {

/// Replies to older requests of a lane are nobody's.
constexpr std::size_t kKept = 64;
constexpr std::size_t kUnitAt = 6;
constexpr std::size_t kFunctionAt = 7;

std::uint16_t NumberOf(View message) { return ByteReader(message).U16Be(0).value_or(0); }

bool IsBusy(View message) {
  return message.size() == kFunctionAt + 2 && (message[kFunctionAt] & modbus::kExceptionBit) != 0 &&
         message[kFunctionAt + 1] == modbus::kBusy;
}

std::string NameOf(std::uint8_t unit) { return "unit " + std::to_string(unit); }

}  // namespace

void Pipeline::OnOpened() {
  for (Lane& lane : lanes_) lane = {};
  turns_.clear();
  asked_.clear();
  alone_.reset();
  assembler_ = {};
  out_.clear();
}

void Pipeline::OnLost(Instant now) {
  if (UnderWay() < 2) return;
  signs_.push_back(now);
  Sign("it closes the connection when several requests are under way", now);
}

std::size_t Pipeline::UnderWay() const {
  return static_cast<std::size_t>(
      std::ranges::count_if(lanes_, [](const Lane& lane) { return lane.under_way; }));
}

/// Signs in OnLost stand each for itself; all others are counted here.
void Pipeline::Sign(std::string text, Instant now) {
  if (signs_.empty() || now - signs_.back() >= kApart) signs_.push_back(now);
  std::erase_if(signs_, [now](Instant at) { return now - at > kSignsCount; });
  if (signs_.size() >= kMostSigns && verdict_.empty()) verdict_ = std::move(text);
}

// ---------------------------------------------------------------- out

void Pipeline::OnRequest(std::size_t lane, View request, Instant now) {
  if (!verdict_.empty() || request.size() <= kFunctionAt) return;
  std::erase(turns_, lane);
  lanes_[lane].under_way = false;
  lanes_[lane].waiting.assign(request.begin(), request.end());
  turns_.push_back(lane);
  Pump(now);
}

void Pipeline::Pump(Instant now) {
  if (!verdict_.empty()) return out_.clear();
  if (alone_ && alone_->sent && now >= alone_->until) {
    // Whoever is silent so long is silent whoever else is asked.
    Asked& asked = LastOf(lanes_[alone_->lane]);
    asked.alone = false;
    units_[asked.unit] = {.suspect = false, .absent = true};
    alone_.reset();
  }
  for (;;) {
    const auto next =
        std::ranges::find_if(turns_, [&](std::size_t lane) { return MayGo(lane, now); });
    if (next == turns_.end()) return;
    const std::size_t lane = *next;
    turns_.erase(next);
    Send(lane);
    if (alone_ && alone_->lane == lane) {
      *alone_ = {lane, true, now + kAlone};
    } else if (alone_ && alone_->sent) {
      alone_.reset();  // it is alone no more
    }
  }
}

bool Pipeline::MayGo(std::size_t lane, Instant now) {
  const Bytes& request = lanes_[lane].waiting;
  if (!modbus::IsRead(request[kFunctionAt])) return true;
  if (!alone_ && units_[request[kUnitAt]].suspect) alone_ = {lane, false, now + kClear};
  if (!alone_) return true;
  return alone_->lane == lane && !alone_->sent && (UnderWay() == 0 || now >= alone_->until);
}

/// A repetition has the number of the first try.
std::uint16_t Pipeline::Number(std::size_t lane, View request) {
  const std::array<std::uint8_t, 2> own = {request[0], request[1]};
  auto& numbers = lanes_[lane].numbers;
  if (!numbers.empty()) {
    const Asked& before = LastOf(lanes_[lane]);
    const bool same = before.number == own && before.unit == request[kUnitAt];
    if (same && !before.answered) return numbers.back();
  }
  do ++next_;
  while (asked_.contains(next_));
  asked_[next_] = {.lane = lane, .number = own, .unit = request[kUnitAt]};
  numbers.push_back(next_);
  if (numbers.size() > kKept) {
    asked_.erase(numbers.front());
    numbers.pop_front();
  }
  return next_;
}

void Pipeline::Send(std::size_t lane) {
  Bytes request = std::exchange(lanes_[lane].waiting, {});
  const std::uint16_t number = Number(lane, request);
  Asked& asked = LastOf(lanes_[lane]);
  asked.given_up = false;
  asked.shared = UnderWay() > 0;
  asked.alone = alone_ && alone_->lane == lane && !asked.shared;
  for (const Lane& other : lanes_) {
    if (!other.under_way) continue;
    LastOf(other).shared = true;
    LastOf(other).alone = false;
  }
  lanes_[lane].under_way = true;
  request[0] = static_cast<std::uint8_t>(number >> 8);
  request[1] = static_cast<std::uint8_t>(number);
  out_.push_back(std::move(request));
}

void Pipeline::OnNoReply(std::size_t lane, Instant now) {
  Lane& its = lanes_[lane];
  const bool unsent = std::erase(turns_, lane) > 0;
  its.waiting.clear();
  if (std::exchange(its.under_way, false) && !unsent) {
    Asked& asked = LastOf(its);
    Unit& unit = units_[asked.unit];
    asked.given_up = true;
    if (asked.alone) {
      unit = {.suspect = false, .absent = true};
    } else if (asked.shared && !unit.absent) {
      unit.suspect = true;
    }
  }
  if (alone_ && alone_->lane == lane) alone_.reset();
  Pump(now);
}

std::vector<Bytes> Pipeline::TakeOut() { return std::exchange(out_, {}); }

std::optional<Instant> Pipeline::Deadline() const {
  return alone_ ? std::optional(alone_->until) : std::nullopt;
}

// ---------------------------------------------------------------- in

std::vector<Pipeline::Reply> Pipeline::OnBytes(View bytes, Instant now) {
  std::vector<Reply> replies;
  while (!bytes.empty() && verdict_.empty()) {
    const auto space = assembler_.Space();
    const std::size_t count = std::min(space.size(), bytes.size());
    std::ranges::copy(bytes.first(count), space.begin());
    assembler_.Commit(count);
    bytes = bytes.subspan(count);
    View message;
    while (verdict_.empty() && assembler_.Take(message) == modbus::MbapAssembler::State::frame) {
      heard_ = now;
      const auto found = asked_.find(NumberOf(message));
      if (found == asked_.end()) {
        verdict_ = "it sends a reply with a number that no request has";
        break;
      }
      Asked& asked = found->second;
      if (message[kUnitAt] != asked.unit) {
        verdict_ =
            "it answers a request to " + NameOf(asked.unit) + " as " + NameOf(message[kUnitAt]);
        break;
      }
      Bytes own(message.begin(), message.end());
      std::ranges::copy(asked.number, own.begin());
      replies.push_back({asked.lane, std::move(own)});
      OnReply(asked, message, now);
    }
    if (verdict_.empty() && !assembler_.Defect().empty()) {
      verdict_ = "what it sends is no Modbus TCP message: " + std::string(assembler_.Defect());
    }
  }
  Pump(now);
  return replies;
}

void Pipeline::OnReply(Asked& asked, View message, Instant now) {
  if (std::exchange(asked.answered, true)) return;
  Lane& lane = lanes_[asked.lane];
  const bool late = asked.given_up;
  if (&LastOf(lane) == &asked) lane.under_way = false;
  if (asked.alone) alone_.reset();
  const bool busy = IsBusy(message);
  const bool was_suspect = units_[asked.unit].suspect;
  units_[asked.unit] = {.suspect = busy && asked.shared, .absent = false};
  if (asked.alone && was_suspect && !busy) {
    Sign(NameOf(asked.unit) + " answers only when nothing else is asked", now);
  } else if (late && asked.shared) {
    Sign(NameOf(asked.unit) + " answers too late when several requests are under way", now);
  }
}

}  // namespace baudgate
