// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/jobs/effect_applier.h"

#include <span>
#include <utility>

#include "gateway/bus/jobs/write_end.h"

namespace baudgate {

void EffectApplier::OnReply(const Job& job, Device& device, Answer answer, Instant now) {
  const ReplyEffects effects = intake_.Take(job, device, std::move(answer), now);
  if (effects.rechecked) ledger_.devices.OnRecheck(device);
  if (effects.unconfirmed) ledger_.devices.OnUnconfirmed(device);
  for (const QueryRef& query : effects.read_soon) agenda_.write_queue.AddReadBack(query);
  for (const config::Group group : effects.repeat) upkeep_.Repeat(device, group, false, now);
  if (effects.stored) owed_.readings.OnStored(*effects.stored);
  if (effects.hold_events) {
    agenda_.schedule.HoldEvents(device.place);
    agenda_.background.AwaitDisk(device.place);
  }
  if (effects.peace > Duration::zero()) agenda_.schedule.Hold(device.place, now + effects.peace);
}

void EffectApplier::OnEventsKept(const Device& device, const std::string& said, Instant now) {
  agenda_.schedule.ReleaseEvents(device.place, device.conversation->HasEvents(),
                                 intake_.OnKept(device, said), now);
  agenda_.background.Release(device.place);
  upkeep_.PlanBackground(device);
}

std::optional<Job::Write> EffectApplier::OnEnd(Job& done, EndEffects effects, const JobEnd& end,
                                               Instant now) {
  Member& member = *done.member;
  Device* const device = member.device;
  if (const auto& background = effects.background; background && background->sent) {
    agenda_.background.OnEnd(member.place, background->took, background->proved);
  } else if (background) {
    agenda_.background.OnUnsent(member.place);
  }
  if (device != nullptr) upkeep_.PlanBackground(*device);
  if (done.probe_budget) agenda_.probes.OnEnd(member, *done.probe_budget, done.began);
  if (effects.fast_poll) ledger_.rounds.OnPoll(member, *effects.fast_poll, now);
  if (effects.poll) {
    const auto& [query, answered] = *effects.poll;
    ledger_.devices.OnPoll(*device, query, answered, done.had_failure);
  }
  if (effects.repeat) {
    upkeep_.Repeat(*device, effects.repeat->group, effects.repeat->soon, now);
  }
  if (!effects.read_again.empty()) upkeep_.ReadBack(*device, effects.read_again);
  if (!effects.doubt.empty() && member.in_use) upkeep_.Doubt(*device, effects.doubt, now);
  if (effects.polls_first && device != nullptr) agenda_.schedule.GoFirst(member.place);
  // Silence to a query that was never answered says something about the query, not about the
  // device.
  if (effects.judges_member && !done.blames_query)
    upkeep_.OnTask(member, end.outcome, end.reason, now);
  if (effects.wrote) {
    std::span<const PointWrite> writes;
    if (const auto* const write = done.As<Job::Write>()) {
      writes = std::span(write->command.writes()).subspan(write->first, write->next - write->first);
    }
    upkeep_.OnWritten(*member.protocol, done.step.request.bytes, device, writes,
                      ProvesLife(end.outcome), now);
  }
  for (auto& [request, reply] : effects.replies) request.done(std::move(reply));
  if (!effects.write) return std::nullopt;
  return OnWriteEnd(*done.As<Job::Write>(), *device, *effects.write, now);
}

std::optional<Job::Write> EffectApplier::OnWriteEnd(Job::Write& write, Device& device,
                                                    const EndEffects::Write& effects, Instant now) {
  using Next = EndEffects::Write::Next;
  upkeep_.Doubt(device, effects.unknown, now);
  for (const PointWrite& one : effects.confirmed) {
    device.jumps.OnWritten(one.point, WrittenValue(device.config->points[one.point], one));
  }
  if (!effects.confirmed.empty()) write.command.MoveTo(WriteState::reading_back);
  switch (effects.next) {
    case Next::answer:
      ledger_.devices.OnWrite(device, effects.result.end, false);
      write.command.End(effects.result);
      break;
    case Next::confirm:
      agenda_.write_queue.Confirm(std::move(write.command), device.place, now);
      break;
    case Next::go_on:
      write.command.MoveTo(WriteState::queued);
      return std::move(write);
  }
  return std::nullopt;
}

}  // namespace baudgate
