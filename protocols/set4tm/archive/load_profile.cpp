// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/load_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "gateway/base/text.h"
#include "protocols/set4tm/meter/clock.h"

namespace baudgate::protocols::set4tm {

MemoryRead::MemoryRead(const std::vector<Stretch>& stretches, std::size_t most, bool twice)
    : twice_(twice) {
  for (Stretch rest : stretches) {
    while (rest.count > 0) {
      const std::size_t count = std::min(rest.count, most);
      pieces_.push_back({rest.address, count});
      rest = {rest.address + count, rest.count - count};
    }
  }
  read_.resize(pieces_.size());
}

MemoryRead::Stretch MemoryRead::Next() const {
  const bool again = count_ >= pieces_.size();
  return pieces_[again ? 2 * pieces_.size() - 1 - count_ : count_];
}

void MemoryRead::OnPiece(View bytes) {
  const bool again = count_ >= pieces_.size();
  Bytes& piece = read_[again ? 2 * pieces_.size() - 1 - count_ : count_];
  differs_ = differs_ || (again && !std::ranges::equal(piece, bytes));
  piece.assign(bytes.begin(), bytes.end());
  done_ = ++count_ == (twice_ ? 2 : 1) * pieces_.size();
  if (!done_ || differs_) return;
  for (const Bytes& one : read_) Append(bytes_, one);
}

namespace {

constexpr std::size_t kSum = 6;
constexpr std::uint16_t kIncomplete = 0x8000;
constexpr std::array<const char*, 4> kProfileNames = {"active_import", "active_export",
                                                      "reactive_import", "reactive_export"};

std::uint8_t SumOf(View header) {
  const View summed = header.first(kSum);
  return static_cast<std::uint8_t>(std::accumulate(summed.begin(), summed.end(), 0U));
}

/// Parses the four bytes hour, day, month and year; the minute is set to 0.
std::optional<CivilZone::Civil> HourOf(View bytes) {
  return CivilOf(Bytes{0, 0, bytes[0], 0, bytes[1], bytes[2], bytes[3]});
}

bool FillsAnHour(unsigned minutes) { return minutes != 0 && minutes <= 60 && 60 % minutes == 0; }

}  // namespace

std::optional<LoadHeader> ParseLoadHeader(View record) {
  if (record.size() != kLoadRecord || record[kSum] != SumOf(record)) return std::nullopt;
  const auto begin = HourOf(record);
  if (!begin || record[4] > 1 || !FillsAnHour(record[5])) return std::nullopt;
  return LoadHeader{*begin, record[4] == 0, record[5]};
}

Bytes BytesOf(const LoadHeader& header) {
  const Bytes civil = BytesOf(header.begin);
  Bytes record = {civil[2],
                  civil[4],
                  civil[5],
                  civil[6],
                  static_cast<std::uint8_t>(!header.summer),
                  static_cast<std::uint8_t>(header.minutes)};
  record.push_back(SumOf(record));
  record.push_back(0);
  return record;
}

CivilZone::Utc UtcOf(const LoadHeader& header, const CivilZone& zone) {
  const CivilZone::Moment moment = zone.ToUtc(header.begin);
  const bool first = moment.fit == CivilZone::Fit::twice && header.summer;
  return moment.utc - std::chrono::hours(first ? 1 : 0);
}

LoadSlice ParseLoadSlice(View record) {
  LoadSlice slice;
  for (std::size_t i = 0; i < slice.counts.size(); ++i) {
    const std::uint16_t word = ByteReader(record).U16Be(2 * i).value_or(kIncomplete);
    slice.counts[i] = {static_cast<std::uint16_t>(word & ~unsigned{kIncomplete}),
                       (word & kIncomplete) != 0};
  }
  return slice;
}

std::optional<LoadPointer> ParseLoadPointer(View data) {
  if (data.size() != 7) return std::nullopt;
  const auto minute = static_cast<std::uint8_t>(data[0] & 0x7FU);
  const auto at = CivilOf(Bytes{0, minute, data[1], 0, data[2], data[3], data[4]});
  if (!at) return std::nullopt;
  const auto hour = std::chrono::floor<std::chrono::hours>(*at);
  return LoadPointer{hour, static_cast<unsigned>((*at - hour) / std::chrono::minutes(1)),
                     (data[0] & 0x80U) != 0, *ByteReader(data).U16Be(5)};
}

std::optional<LoadRing::Hour> LoadRing::HourOf(const LoadPointer& pointer) const {
  const std::size_t behind = kLoadRecord * (1 + pointer.minute / minutes);
  if (pointer.address % kLoadRecord != 0 || pointer.address < behind ||
      pointer.address - behind + block() > bytes)
    return std::nullopt;
  return Hour{pointer.address - behind, pointer.minute / minutes};
}

std::optional<LoadRing::Hour> LoadRing::HourBehind(const LoadPointer& pointer) const {
  if (pointer.address % kLoadRecord != 0 || pointer.address > bytes) return std::nullopt;
  return Hour{pointer.address + block() > bytes ? 0 : pointer.address, 0};
}

std::string NameOfLoad(unsigned profile) { return "load_" + std::to_string(profile); }

PastRecord RecordOf(unsigned profile, const LoadHeader& header, std::size_t slice,
                    const LoadSlice& counts, const CivilZone& zone, const Scale& scale) {
  const std::chrono::minutes span(header.minutes);
  PastRecord record;
  record.series = NameOfLoad(profile);
  record.begin = UtcOf(header, zone).time_since_epoch() + static_cast<std::int64_t>(slice) * span;
  record.span = span;
  const auto factor = FactorOf(Measure::energy, scale);
  for (std::size_t i = 0; i < kProfileNames.size(); ++i) {
    PastValue value{kProfileNames[i], {}, Quality::bad_configuration, i < 2 ? "kW" : "kvar"};
    if (factor) {
      value.value = counts.counts[i].pulses * factor->multiply * 60 /
                    (factor->divide * static_cast<double>(header.minutes));
      value.quality = counts.counts[i].incomplete ? Quality::uncertain_sub_normal : Quality::good;
    }
    record.values.push_back(std::move(value));
  }
  return record;
}

std::string LoadPlace::Text() const {
  std::string text = fmt::format("{:04X}:", address);
  for (const std::uint8_t byte : header) text += HexByte(byte);
  return text + fmt::format(":{}", taken);
}

std::optional<LoadPlace> LoadPlace::Parse(std::string_view text) {
  const auto words = Split(text, ':');
  if (words.size() != 3) return std::nullopt;
  const auto address = ParseInteger<std::uint16_t>(words[0], 16);
  auto header = ParseHex(words[1]);
  const auto taken = ParseInteger<std::uint8_t>(words[2]);
  const auto hour = header ? ParseLoadHeader(*header) : std::nullopt;
  if (!address || !hour || !taken || *taken > hour->slices()) return std::nullopt;
  return LoadPlace{*address, std::move(*header), *taken};
}

CivilZone::Utc LoadReader::EndOf(const LoadPlace& place) const {
  const auto header = ParseLoadHeader(place.header);
  return UtcOf(*header, zone_) +
         static_cast<std::int64_t>(place.taken) * std::chrono::minutes(header->minutes);
}

std::optional<CivilZone::Utc> LoadReader::end() const {
  return place_ ? std::optional(EndOf(*place_)) : floor_;
}

void LoadReader::OnKept(std::optional<LoadPlace> place, bool another) {
  if (!place) return;
  floor_.reset();
  place_ = std::move(place);
  if (another) Lose();
}

/// Drops the stored position, because its hour is no longer in the ring, or is that of another
/// meter. Reading continues with the oldest hour in the ring.
void LoadReader::Lose() {
  floor_ = EndOf(*place_);
  place_.reset();
  knows_interval_ = false;
  BreakOff();
}

void LoadReader::OnReconnect() {
  knows_interval_ = false;
  BreakOff();
}

void LoadReader::BreakOff() {
  pointer_.reset();
  scan_.reset();
  read_.reset();
}

LoadReader::Step LoadReader::step() const {
  if (!knows_interval_) return Step::interval;
  return pointer_ && read_ ? Step::memory : Step::pointer;
}

bool LoadReader::OnInterval(unsigned minutes) {
  trouble_.clear();
  if (minutes == 0 || minutes > 60 || 60 % minutes != 0) {
    trouble_ = fmt::format(
        "the interval of {} minutes that the meter reports (08 06) does not divide an hour, so the "
        "profile is not read",
        minutes);
    return false;
  }
  ring_.minutes = minutes;
  knows_interval_ = true;
  return true;
}

bool LoadReader::OnPointer(View data, const Manner& manner) {
  pointer_ = ParseLoadPointer(data);
  waits_ = false;
  trouble_.clear();
  const bool goes_on = GoOn(manner);
  if (!current_)
    trouble_ = "the meter reports an invalid record pointer (08 04: " + ToHex(data) +
               "), so this load profile is not read";
  return goes_on;
}

bool LoadReader::GoOn(const Manner& manner) {
  read_.reset();
  current_.reset();
  if (pointer_ && knows_interval_) {
    current_ = ring_.HourOf(*pointer_);
    const auto reached = place_ ? HourAfter(place_->address) : ring_.HourBehind(*pointer_);
    if (current_ && place_ && !reached) {
      Lose();
      return true;
    }
    if (place_ || !current_) current_ = reached;
  }
  const bool plans = current_ && (place_ ? PlanHours(manner) : PlanScan(manner));
  if (!plans) pointer_.reset();
  return plans;
}

/// Returns the hour that is being written, if it is a whole number of hours after the hour at
/// `address`. The pointer names the next slice of this hour, or, while its header is not written,
/// the position after the last record. Only one of these two meanings gives a whole number of
/// hours.
std::optional<LoadRing::Hour> LoadReader::HourAfter(std::size_t address) const {
  for (const auto& hour : {ring_.HourOf(*pointer_), ring_.HourBehind(*pointer_)}) {
    if (hour && Reaches(address, hour->address)) return hour;
  }
  return std::nullopt;
}

bool LoadReader::Reaches(std::size_t from, std::size_t current) const {
  std::size_t address = from;
  for (std::size_t hours = 0; address != current; ++hours) {
    if (hours > ring_.hours()) return false;
    address = ring_.Next(address);
  }
  return true;
}

/// True if the position at `address` has the header of the hour that belongs there. Only the header
/// of the hour that is being written can be missing: until the meter writes it, the position has a
/// header of an older hour, or none.
bool LoadReader::IsWritten(std::size_t address, const std::optional<LoadHeader>& header) const {
  return current_->address != address || (header && header->begin == pointer_->hour);
}

/// Plans the next read in the search for a first header, which can be at any position. If the
/// memory has wrapped, the search starts at the oldest hour, which the meter will overwrite next.
bool LoadReader::PlanScan(const Manner& manner) {
  const std::size_t current = current_->address;
  const std::size_t end = current + (current_->finished > 0 ? kLoadRecord : 0);
  if (!scan_) scan_ = pointer_->wrapped ? ring_.Next(current) : 0;
  if (*scan_ + kLoadRecord > ring_.bytes) scan_ = 0;
  if (*scan_ == end) {
    scan_ = current;  // the header may be written until the next look
    if (scanned_ && !waits_) {
      scan_.reset();
      trouble_ = fmt::format(
          "no header of an hour was found in the meter's memory before its record pointer (08 04: "
          "{:04X})",
          pointer_->address);
    }
    return false;
  }
  const std::size_t room = (*scan_ < end ? end : ring_.bytes) - *scan_;
  const std::size_t most = std::min(manner.most, room);
  const MemoryRead::Stretch stretch{*scan_, most - most % kLoadRecord};
  read_.emplace(std::vector{stretch}, manner.most, manner.twice);
  return true;
}

bool LoadReader::PlanHours(const Manner& manner) {
  const std::size_t current = current_->address;
  const auto slices = [&](std::size_t address) {
    return address == current ? current_->finished : ring_.block() / kLoadRecord - 1;
  };
  const auto size = [](std::size_t count) { return kLoadRecord * (1 + count); };
  const std::size_t place = place_->address;
  blocks_ = {{place, slices(place), 0}};
  std::size_t total = size(slices(place));
  for (std::size_t last = place; last != current;) {
    const std::size_t next = ring_.Next(last);
    const std::size_t count = slices(next);
    const bool fits = next == last + ring_.block() && total + size(count) <= manner.most;
    if (count == 0 || !fits) break;
    blocks_.push_back({next, count, total});
    total += size(count);
    last = next;
  }
  if (blocks_.size() > 1 || place_->taken < slices(place)) {
    read_.emplace(std::vector{MemoryRead::Stretch{place, total}}, manner.most, manner.twice);
    return true;
  }
  // The header of the hour that was read last and the next hour do not fit into one read, so they
  // are read separately.
  blocks_[0].slices = 0;
  std::vector<MemoryRead::Stretch> stretches = {{place, kLoadRecord}};
  if (place == current) {
    if (ParseLoadHeader(place_->header)->begin == pointer_->hour) return false;
  } else {
    const std::size_t next = ring_.Next(place);
    if (slices(next) == 0) return false;
    blocks_.push_back({next, slices(next), kLoadRecord});
    stretches.push_back({next, size(slices(next))});
  }
  read_.emplace(stretches, manner.most, manner.twice);
  return true;
}

LoadReader::Taken LoadReader::OnMemory(View bytes, const Scale& scale, const Manner& manner) {
  Taken taken;
  taken.more = true;
  read_->OnPiece(bytes);
  if (!read_->done()) return taken;
  const Bytes whole = std::exchange(read_, std::nullopt)->bytes();
  const bool alike = !whole.empty();
  if (alike && !place_) {
    TakeScan(whole);
  } else if (!alike || !TakeHours(whole, scale, taken)) {
    BreakOff();
    taken.more = false;
    return taken;
  }
  if (taken.records.empty() && step() != Step::interval && pointer_) taken.more = GoOn(manner);
  return taken;
}

void LoadReader::TakeScan(View bytes) {
  for (std::size_t at = 0; at + kLoadRecord <= bytes.size(); at += kLoadRecord) {
    const View record = bytes.subspan(at, kLoadRecord);
    const auto header = ParseLoadHeader(record);
    const std::size_t address = *scan_ + at;
    if (!IsWritten(address, header)) waits_ = true;
    if (!header || header->minutes != ring_.minutes || header->begin > pointer_->hour ||
        !IsWritten(address, header) || !HourAfter(address))
      continue;
    place_ = LoadPlace{address, Bytes(record.begin(), record.end()), 0};
    scan_.reset();
    scanned_ = false;
    return;
  }
  *scan_ += bytes.size();
  scanned_ = true;
}

/// Adds the records of the hours that were read. Returns false if there was nothing new.
bool LoadReader::TakeHours(View bytes, const Scale& scale, Taken& taken) {
  LoadPlace place = *place_;
  bool moved = false;
  for (const Block& block : blocks_) {
    const View hour = bytes.subspan(block.offset, kLoadRecord * (1 + block.slices));
    const View head = hour.first(kLoadRecord);
    const bool first = &block == &blocks_.front();
    if (first && !std::ranges::equal(head, place.header)) {
      Lose();
      return true;
    }
    const auto header = ParseLoadHeader(head);
    if (!IsWritten(block.address, header)) {
      waits_ = true;
      break;
    }
    if (!header || header->minutes != ring_.minutes) {
      if (moved) break;
      Lose();
      scan_ = block.address;
      return true;
    }
    if (!first) place = {block.address, Bytes(head.begin(), head.end()), 0};
    for (; place.taken < block.slices; ++place.taken, moved = true) {
      const LoadSlice slice =
          ParseLoadSlice(hour.subspan(kLoadRecord * (1 + place.taken), kLoadRecord));
      Add(RecordOf(profile_, *header, place.taken, slice, zone_, scale), taken.records);
    }
  }
  if (taken.records.empty()) place_ = place;
  taken.place = std::move(place);
  return moved;
}

/// Adds a record. If the stored position was lost (floor_), records before the end of the last
/// reported record are dropped, and a gap after it becomes a record without values.
void LoadReader::Add(PastRecord record, std::vector<PastRecord>& records) const {
  if (floor_) {
    const Duration floor = floor_->time_since_epoch();
    if (record.begin < floor) return;
    if (records.empty() && record.begin > floor) {
      records.push_back({record.series, floor, record.begin - floor, {}});
    }
  }
  records.push_back(std::move(record));
}

}  // namespace baudgate::protocols::set4tm
