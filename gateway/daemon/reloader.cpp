// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reloader.h"

#include <fmt/format.h>

#include <asio/post.hpp>
#include <filesystem>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate {
namespace {

constexpr int kBadFile = 2;   // nothing of it is applied
constexpr int kCanNotBe = 4;  // a disk fails, or a port is somebody else's

control::ReloadAnswer Failed(int exit_code, std::string text) {
  control::ReloadAnswer answer;
  answer.exit_code = exit_code;
  answer.text = std::move(text);
  return answer;
}

std::string Joined(const std::vector<std::string>& sentences) {
  std::string all;
  for (const std::string& one : sentences) all += (all.empty() ? "" : "; ") + one;
  return all;
}

}  // namespace

Reloader::Reloader(ReloadOptions options, Links links)
    : options_(std::move(options)), links_(std::move(links)) {
  const MutexLock lock(mutex_);
  std::error_code ignored;
  state_.file = std::filesystem::absolute(options_.file, ignored).string();
  state_.applied = ReadClocks().wall;
  state_.not_the_file = options_.not_the_file;
  if (options_.kept) state_.folder = options_.kept->folder().string();
}

void Reloader::Start() {
  started_ = true;
  if (options_.kept && (links_.keeps() || !options_.kept->entries().empty())) {
    const Status status = OpenFolder();
    if (!status) log::Warn("the configuration is not kept: {}", status.error());
  }
  loop_.Start();
}

/// And says there what runs since the start.
Status Reloader::OpenFolder() {
  if (open_) return {};
  if (!options_.kept) return Error{"there is no state folder; give one with gateway.state"};
  if (Status status = links_.open_folder(); !status) return status;
  open_ = true;
  reload::KeptConfigs& kept = *options_.kept;
  const WallTime now = ReadClocks().wall;
  if (!options_.not_the_file.empty()) {
    links_.tell(true, options_.not_the_file);
    return kept.Refuse("the gateway ended before it was confirmed", now);
  }
  const auto last = kept.TextOf(kept.confirmed());
  const bool settled = kept.refused() == 0 && kept.trial() == 0;
  if (last && *last == options_.running && settled) return {};
  return kept.Add(options_.running, "start", now, false);
}

void Reloader::Stop() {
  if (!std::exchange(started_, false)) return;
  loop_.Stop([this] { timer_.cancel(); });
}

control::ReloadState Reloader::state() const {
  const MutexLock lock(mutex_);
  return state_;
}

void Reloader::Show(const std::function<void(control::ReloadState&)>& change) {
  const MutexLock lock(mutex_);
  change(state_);
}

void Reloader::Reload(const control::ReloadAsk& ask, Answered answered) {
  asio::post(loop_.io(), [this, ask, answered = std::move(answered)] { answered(Do(ask)); });
}

void Reloader::Confirm(const std::string& by, Answered answered) {
  asio::post(loop_.io(), [this, by, answered = std::move(answered)] { answered(DoConfirm(by)); });
}

control::ReloadAnswer Reloader::Do(const control::ReloadAsk& ask) {
  const auto text = options_.read();
  if (!text) return Failed(kBadFile, options_.file + ": " + text.error());
  LoadedText loaded = options_.load(*text);
  if (!loaded.config) {
    if (!ask.dry_run) log::Fail("reload: nothing is changed: {}", loaded.problems);
    return Failed(kBadFile, loaded.problems);
  }
  reload::Difference difference = reload::Compare(links_.running(), *loaded.config);
  links_.examine(*loaded.config, difference);
  const std::string why_not = reload::WhyNot(difference);
  if (ask.dry_run || !why_not.empty()) {
    control::ReloadAnswer answer;
    answer.ok = why_not.empty();
    answer.exit_code = answer.ok ? 0 : kBadFile;
    answer.changes = reload::Sentences(difference);
    answer.text = answer.ok ? reload::Summary(difference) : why_not + "; nothing is applied";
    if (!ask.dry_run) log::Fail("reload: {}: {}", options_.file, answer.text);
    return answer;
  }
  return Apply(ask, *text, *std::move(loaded.config), difference);
}

control::ReloadAnswer Reloader::Apply(const control::ReloadAsk& ask, const std::string& text,
                                      config::Config next, const reload::Difference& difference) {
  if (difference.empty() && text == options_.running && !probation_.running()) {
    log::Info("reload by {}: {}", ask.by, reload::Summary(difference));
    control::ReloadAnswer answer;
    answer.ok = true;
    answer.text = reload::Summary(difference);
    return answer;
  }
  Prepared prepared;
  if (!difference.empty()) prepared = links_.prepare(std::move(next), difference);
  if (!prepared.troubles.empty()) {
    const std::string text = Joined(prepared.troubles) + "; nothing is changed";
    log::Fail("reload: {}", text);
    return Failed(kCanNotBe, text);
  }
  const bool trial = ask.confirm > Duration::zero() && !difference.empty();
  // Before it is applied: whatever ends the gateway then, the next start knows.
  if (const Status status = Keep(ask.by, text, trial); !status && trial) {
    return Failed(kCanNotBe, "nothing is applied, because it could not be taken back after a " +
                                 ("restart: " + status.error()));
  }
  const auto before = links_.healths();
  options_.notify(fmt::format("RELOADING=1\nMONOTONIC_USEC={}\nSTATUS=reads {}",
                              ReadClocks().instant.time_since_epoch() / 1us, options_.file));
  if (prepared.apply) prepared.apply();
  const Now now = ReadClocks();
  options_.running = text;
  probation_.End();
  if (trial) probation_.Begin(now.instant, ask.confirm, before);
  Show([&](control::ReloadState& state) {
    state.applied = now.wall;
    state.not_the_file.clear();
    state.confirm_until.reset();
    if (trial) state.confirm_until = now.wall + ask.confirm;
  });
  control::ReloadAnswer answer;
  answer.ok = true;
  answer.applied = !difference.empty();
  answer.changes = reload::Sentences(difference);
  answer.text = reload::Summary(difference);
  const std::string until =
      trial ? fmt::format("; to be confirmed within {}", FormatDuration(ask.confirm)) : "";
  for (const std::string& change : answer.changes) log::Info("reload: {}", change);
  log::Info("reload by {}: {}{}", ask.by, answer.text, until);
  if (answer.applied) links_.tell(false, fmt::format("{}, by {}{}", answer.text, ask.by, until));
  options_.notify(fmt::format("READY=1\nSTATUS={}{}", options_.summary(), until));
  if (trial) Watch();
  return answer;
}

Status Reloader::Keep(const std::string& by, const std::string& text, bool trial) {
  Status status = OpenFolder();
  if (status) status = options_.kept->Add(text, by, ReadClocks().wall, trial);
  if (!status && !trial) log::Warn("the configuration is not kept: {}", status.error());
  return status;
}

control::ReloadAnswer Reloader::DoConfirm(const std::string& by) {
  if (!probation_.running()) {
    return Failed(kBadFile, "nothing waits to be confirmed" +
                                (state().not_the_file.empty() ? "" : ": " + state().not_the_file));
  }
  if (const Status status = options_.kept->Confirm(); !status) {
    return Failed(kCanNotBe, "it can not be confirmed: " + status.error());
  }
  probation_.End();
  timer_.cancel();
  Show([](control::ReloadState& state) { state.confirm_until.reset(); });
  log::Info("the configuration is confirmed by {}", by);
  options_.notify("STATUS=" + options_.summary());
  control::ReloadAnswer answer;
  answer.ok = true;
  answer.text = "confirmed";
  return answer;
}

void Reloader::Watch() {
  timer_.expires_after(kLook);
  timer_.async_wait([this](const asio::error_code& stopped) {
    if (stopped || !probation_.running()) return;
    const auto why = probation_.Look(ReadClocks().instant, links_.healths());
    if (why) return TakeBack(*why);
    Watch();
  });
}

/// The file stays as it is: it is the user's, and may not be ours to write.
void Reloader::TakeBack(const std::string& why) {
  probation_.End();
  reload::KeptConfigs& kept = *options_.kept;
  const Now now = ReadClocks();
  const Status refused = kept.Refuse(why, now.wall);
  if (!refused) log::Warn("the configuration is not kept: {}", refused.error());
  const auto text = kept.TextOf(kept.confirmed());
  LoadedText loaded = text ? options_.load(*text) : LoadedText{{}, text.error()};
  if (!loaded.config) {
    log::Fail("reload: {}; the one before can not be taken again: {}", why, loaded.problems);
    return;
  }
  options_.notify(fmt::format("RELOADING=1\nMONOTONIC_USEC={}\nSTATUS=takes back {}",
                              now.instant.time_since_epoch() / 1us, options_.file));
  const reload::Difference difference = reload::Compare(links_.running(), *loaded.config);
  Prepared prepared;
  if (!difference.empty()) prepared = links_.prepare(*std::move(loaded.config), difference);
  if (prepared.apply) prepared.apply();
  options_.running = *text;
  std::string said = fmt::format(
      "{} was taken back: {}; what was confirmed before runs, and will at every start until the "
      "file is changed",
      options_.file, why);
  if (!prepared.troubles.empty())
    said += "; this could not be taken back: " + Joined(prepared.troubles);
  Show([&](control::ReloadState& state) {
    state.applied = ReadClocks().wall;
    state.confirm_until.reset();
    state.not_the_file = said;
  });
  log::Warn("{}", said);
  links_.tell(true, said);
  options_.notify(fmt::format("READY=1\nSTATUS={}; {}", options_.summary(), said));
}

}  // namespace baudgate
