// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_gate.h"

#include <utility>

#include "gateway/bus/points/conversion.h"
#include "gateway/bus/writes/interlock.h"
#include "gateway/bus/writes/write_limits.h"

namespace baudgate {
namespace {

using Why = WriteDenial::Why;

std::string NotSelected(Selections::Verdict verdict, const config::Point& point) {
  switch (verdict) {
    case Selections::Verdict::foreign:
      return "'" + point.name + "' is selected by another client";
    case Selections::Verdict::expired:
      return "the selection of '" + point.name + "' ended " +
             FormatDuration(point.writing.select_time) + " after it was made";
    default:
      return "'" + point.name + "' has to be selected before it is written";
  }
}

/// The first limit or interlock that forbids one of these now.
std::optional<WriteDenial> WhyNotNow(const PointStore& store, std::uint32_t device,
                                     const std::vector<WriteAsk::Part>& parts, Instant now) {
  for (const WriteAsk::Part& part : parts) {
    const config::Point& point = store.device(device).points[part.point];
    if (auto beyond = WhyBeyond(store, device, point, part.value, now)) {
      return WriteDenial{beyond->known ? Why::value : Why::locked, std::move(beyond->text)};
    }
    if (auto why = WhyLocked(store, point, part.value, now)) {
      return WriteDenial{Why::locked, std::move(*why)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<WriteDenial> WriteGate::Submit(const Writer& writer, WriteAsk ask, Instant now) {
  TakeAsMeant(ask);
  if (auto denial = Check(writer, ask, now)) {
    Deny(writer, ask, denial->text);
    return denial;
  }
  const config::Device& device = store_.device(ask.device);
  WriteCommand command;
  command.device = ask.device;
  command.client = writer.name;
  command.request = std::move(ask.request);
  command.deadline = ask.deadline;
  command.abandoned = ask.abandoned;
  command.done = std::move(ask.done);
  auto& writes = command.kind.emplace<Writes>();
  std::vector<WriteAsk::Part> guarded;
  store_.Read(ask.device, [&](const DeviceRecord& record) {
    for (const WriteAsk::Part& part : ask.parts) {
      const config::Point& point = device.points[part.point];
      PointWrite write{part.point, ToRaw(point, part.value).value()};
      if (!IsBad(QualityAt(record, part.point, now)))
        write.before = record.points[part.point].value;
      writes.push_back(std::move(write));
      if (IsGuarded(point)) guarded.push_back(part);
    }
  });
  if (!guarded.empty()) {
    command.why_not = [&store = store_, device = ask.device,
                       guarded](Instant at) -> std::optional<std::string> {
      auto denial = WhyNotNow(store, device, guarded, at);
      if (!denial) return std::nullopt;
      return std::move(denial->text);
    };
  }
  if (sink_.Submit(std::move(command))) return std::nullopt;
  return WriteDenial{Why::busy, "too many writes wait for the line; try again"};
}

void WriteGate::TakeAsMeant(WriteAsk& ask) const {
  for (WriteAsk::Part& part : ask.parts) {
    part.value = AsMeant(store_.device(ask.device).points[part.point], part.value);
  }
}

std::optional<WriteDenial> WriteGate::WouldDeny(const WriteAsk& ask, Instant now) const {
  WriteAsk meant = ask;
  TakeAsMeant(meant);
  if (auto denial = CheckValues(meant)) return denial;
  return CheckInterlocks(meant, now);
}

std::optional<WriteDenial> WriteGate::Check(const Writer& writer, const WriteAsk& ask,
                                            Instant now) {
  // A selection is used up by the first try, whatever becomes of it.
  const std::optional<std::string> not_selected = WhyNotSelected(writer, ask, now);
  if (auto denial = CheckValues(ask)) return denial;
  if (not_selected) return WriteDenial{Why::not_selected, *not_selected};
  return CheckInterlocks(ask, now);
}

/// Permission and limits.
std::optional<WriteDenial> WriteGate::CheckValues(const WriteAsk& ask) const {
  const config::Device& device = store_.device(ask.device);
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = device.points[part.point];
    if (point.writing.allowed) continue;
    return WriteDenial{Why::read_only, point.access == config::Access::read
                                           ? "'" + point.name + "' can only be read"
                                           : "'" + point.name + "' is not in the device's 'write'"};
  }
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = device.points[part.point];
    const auto raw = ToRaw(point, part.value);
    std::optional<std::string> why = raw ? WhyOutside(point, part.value) : raw.error();
    if (!why) why = WhyInexact(point, part.value, *raw);
    if (why) return WriteDenial{Why::value, "'" + point.name + "': " + *why};
  }
  return std::nullopt;
}

std::optional<WriteDenial> WriteGate::CheckInterlocks(const WriteAsk& ask, Instant now) const {
  return WhyNotNow(store_, ask.device, ask.parts, now);
}

/// A selection of each point is used up, even where an earlier one was denied.
std::optional<std::string> WriteGate::WhyNotSelected(const Writer& writer, const WriteAsk& ask,
                                                     Instant now) {
  std::optional<std::string> why;
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = store_.device(ask.device).points[part.point];
    if (!point.writing.select) continue;
    const auto verdict = selections_.Take(writer.number, {ask.device, part.point}, now);
    if (verdict == Selections::Verdict::selected || ask.without_selection || why) continue;
    why = NotSelected(verdict, point);
  }
  return why;
}

std::optional<WriteDenial> WriteGate::Select(const Writer& writer, std::uint32_t device,
                                             std::uint32_t point, Instant now) {
  const config::Point& selected = store_.device(device).points[point];
  if (!selected.writing.allowed) {
    return WriteDenial{Why::read_only, "'" + selected.name + "' is not in the device's 'write'"};
  }
  selections_.Select(writer.number, {device, point}, now + selected.writing.select_time);
  return std::nullopt;
}

void WriteGate::Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
                     WriteEnd end) {
  bool first = true;
  for (const WriteAsk::Part& part : ask.parts) {
    sink_.OnNotTaken(
        {writer.name, ask.request, ask.device, part.point, part.value, reason, end, first});
    first = false;
  }
}

}  // namespace baudgate
