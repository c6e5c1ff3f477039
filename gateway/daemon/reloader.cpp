// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reloader.h"

#include <fmt/format.h>

#include <algorithm>
#include <asio/post.hpp>
#include <filesystem>
#include <utility>

#include "gateway/base/log.h"

namespace baudgate::daemon {

namespace {

constexpr const char* kNoAnswer =
    "cannot be read, because its disk does not answer; check the disk (dmesg)";

}  // namespace

ConfigFile::Text ConfigFile::Read() { return calls_.Wait(read_).value_or(Error{kNoAnswer}); }

void ConfigFile::Look(std::function<void(const Text& text)> seen) {
  const bool begun =
      calls_.Offer([this, seen] { asio::post(loop_, [seen, text = read_()] { seen(text); }); });
  if (!begun) seen(Error{kNoAnswer});
}

namespace {

Error NoAnswer(const std::string& folder) {
  return Error{folder +
               " cannot be used, because its disk does not answer; check the disk (dmesg)"};
}

}  // namespace

ConfigCopies::ConfigCopies(asio::io_context& loop, std::optional<reload::KeptConfigs> kept,
                           Duration patience, std::function<Status()> open_folder)
    : loop_(loop),
      kept_(std::move(kept)),
      open_folder_(std::move(open_folder)),
      calls_("config copies", patience) {}

Status ConfigCopies::Open() {
  if (open_) return {};
  if (!kept_) return Error{"there is no state folder; set gateway.state"};
  Status status = open_folder_();
  open_ = status.ok();
  return status;
}

Status ConfigCopies::Keep(const reload::KeptTexts& texts) {
  if (Status status = Open(); !status) return status;
  const auto written = calls_.Wait([kept = *kept_, texts] { return kept.Write(texts); });
  if (!written) return NoAnswer(folder());
  return *written ? Status() : Status(Error{written->error()});
}

void ConfigCopies::Look(const reload::KeptTexts& texts,
                        std::function<void(std::optional<std::string> trouble)> seen) {
  if (!open_) return;
  const bool begun = calls_.Offer([this, kept = *kept_, texts, seen] {
    asio::post(loop_, [this, seen, written = kept.Write(texts)] { seen(Trouble(written)); });
  });
  if (!begun) seen(Trouble(NoAnswer(folder())));
}

std::optional<std::string> ConfigCopies::Trouble(const Result<bool>& written) {
  const auto before = std::move(trouble_);
  trouble_ = written ? std::optional<std::string>() : written.error();
  if (trouble_ && trouble_ != before) {
    log::Warn(
        "the configurations for the next start cannot be saved: {}; the gateway tries again every "
        "few seconds",
        *trouble_);
  } else if (written && *written) {
    log::Warn(
        "the saved configurations in {} were missing or changed; the gateway has written them "
        "again",
        folder());
  }
  return trouble_;
}

namespace {

using log::Level;

constexpr int kBadFile = 2;   // exit code: the request cannot be fulfilled, and nothing is applied
constexpr int kCanNotBe = 4;  // exit code: a disk fails, or another program uses a port

control::ReloadAnswer Failed(int exit_code, std::string text) {
  control::ReloadAnswer answer;
  answer.exit_code = exit_code;
  answer.text = std::move(text);
  return answer;
}

control::ReloadAnswer CanNotBeTakenBack(const Status& kept) {
  return Failed(
      kCanNotBe,
      "nothing was applied, because the new configuration and the confirmed one cannot be "
      "saved, so a return would not be possible: " +
          kept.error());
}

std::string NotKept(const Status& kept) {
  return kept ? std::string()
              : "; the configuration cannot be saved for the next start: " + kept.error();
}

void LogChanges(const reload::Difference& difference) {
  for (const std::string& change : reload::Sentences(difference)) {
    log::Act(Level::info, "reload: {}", change);
  }
}

std::string Joined(const std::vector<std::string>& sentences, const char* between = "; ") {
  std::string all;
  for (const std::string& one : sentences) all += (all.empty() ? "" : between) + one;
  return all;
}

std::string NotYet(const std::vector<std::string>& missing) {
  return missing.empty() ? std::string() : "; not working yet: " + Joined(missing);
}

}  // namespace

Reloader::Reloader(ReloadOptions options, Links links)
    : options_(std::move(options)),
      links_(std::move(links)),
      file_(loop_.io(), options_.read, options_.disk_patience),
      copies_(loop_.io(), std::move(options_.kept), options_.disk_patience, links_.open_folder),
      trial_(options_.refused) {
  display_.Change([this](status::ReloadState& state) {
    std::error_code ignored;
    state.file = std::filesystem::absolute(options_.file, ignored).string();
    state.applied = ReadClocks().wall;
    const auto& refused = trial_.refused();
    if (refused) state.not_the_file = reload::TakenBack(options_.file, refused->why);
    state.folder = copies_.folder();
  });
}

void Reloader::Start() {
  started_ = true;
  trial_.Start({std::move(options_.text_at_start), links_.running()});
  ShowApplied();
  if (trial_.refused()) links_.tell(true, state().not_the_file);
  if (links_.keeps() || copies_.found()) {
    const Status status = copies_.Keep(trial_.ToKeep());
    if (!status)
      log::Warn("the configuration cannot be saved for the next start: {}", status.error());
  }
  WatchFiles();
  loop_.Start();
}

void Reloader::Stop() {
  if (!std::exchange(started_, false)) return;
  loop_.Stop([this] {
    timer_.cancel();
    file_timer_.cancel();
  });
  file_.Stop();
  copies_.Stop();
}

void Reloader::ShowApplied() {
  const auto& applied = trial_.applied();
  display_.SetText({applied, &applied->text});
}

Result<std::string> Reloader::ConfigurationText() const {
  const auto text = display_.text();
  if (!text || !options_.masked)
    return Error{"this gateway was started without a configuration file, so there is none to show"};
  return options_.masked(*text);
}

void Reloader::Reload(const control::ReloadAsk& ask, Answered answered) {
  asio::post(loop_.io(), [this, ask, answered = std::move(answered)] { answered(Do(ask)); });
}

void Reloader::Confirm(const control::ReloadAsk& ask, Answered answered) {
  asio::post(loop_.io(), [this, ask, answered = std::move(answered)] { answered(DoConfirm(ask)); });
}

void Reloader::Revert(const control::ReloadAsk& ask, Answered answered) {
  asio::post(loop_.io(), [this, ask, answered = std::move(answered)] { answered(DoRevert(ask)); });
}

control::ReloadAnswer Reloader::Do(const control::ReloadAsk& ask) {
  const auto text = file_.Read();
  if (!text) return Failed(kBadFile, options_.file + ": " + text.error());
  LoadedText loaded = options_.load(*text);
  if (!loaded.config) {
    const std::string problems = Joined(loaded.problems, "\n");
    if (!ask.dry_run) log::Act(Level::error, "reload: nothing is changed: {}", problems);
    return Failed(kBadFile, problems);
  }
  if (!ask.dry_run) {
    for (const std::string& one : loaded.problems) log::Act(Level::warning, "reload: {}", one);
  }
  control::ReloadAnswer answer = Take(ask, *text, *std::move(loaded.config));
  answer.warnings = std::move(loaded.problems);
  return answer;
}

control::ReloadAnswer Reloader::Take(const control::ReloadAsk& ask, const std::string& text,
                                     config::Config next) {
  if (ask.confirm == Duration::zero() && trial_.IsRefused(text)) {
    const std::string taken_back =
        state().not_the_file + "; to try the file again, run 'baudgate reload --confirm 60s'";
    if (!ask.dry_run) log::Act(Level::error, "reload: nothing is changed: {}", taken_back);
    return Failed(kBadFile, taken_back);
  }
  reload::Difference difference = reload::Compare(*links_.running(), next);
  links_.examine(next, difference);
  const std::optional<std::string> why_not = reload::WhyNot(difference);
  if (ask.dry_run || why_not) {
    control::ReloadAnswer answer;
    answer.ok = !why_not;
    answer.exit_code = answer.ok ? 0 : kBadFile;
    answer.changes = reload::Sentences(difference);
    answer.text = answer.ok ? reload::Summary(difference) : *why_not + "; nothing is applied";
    if (!ask.dry_run) log::Act(Level::error, "reload: {}: {}", options_.file, answer.text);
    return answer;
  }
  return difference.empty() ? Unchanged(ask, text) : Apply(ask, text, std::move(next), difference);
}

/// Handles a file that changes no setting, although its text may differ. A running trial continues.
control::ReloadAnswer Reloader::Unchanged(const control::ReloadAsk& ask, const std::string& text) {
  const reload::Applied applied = *trial_.applied();
  const Duration trial = trial_.running() ? TimeFor(ask, *applied.config) : Duration::zero();
  Status kept;
  if (text != applied.text || trial_.refused()) {
    kept = copies_.Keep(trial_.ToKeepWith(text, trial));
    if (!kept && trial > Duration::zero()) return CanNotBeTakenBack(kept);
    trial_.Apply({text, applied.config});
    ShowApplied();
  }
  BeginTrial(trial, links_.healths());
  return Done(ask, {}, NotKept(kept));
}

control::ReloadAnswer Reloader::Apply(const control::ReloadAsk& ask, const std::string& text,
                                      config::Config next, const reload::Difference& difference) {
  const Duration trial = TimeFor(ask, next);
  const Prepared prepared = links_.prepare(next, difference);
  if (!prepared.troubles.empty()) {
    const std::string troubles = Joined(prepared.troubles) + "; nothing is changed";
    log::Act(Level::error, "reload: {}", troubles);
    return Failed(kCanNotBe, troubles);
  }
  // The texts are stored first, so that the next start finds them even if applying ends the
  // gateway.
  const Status kept = copies_.Keep(trial_.ToKeepWith(text, trial));
  if (!kept && trial > Duration::zero()) return CanNotBeTakenBack(kept);
  const auto before = links_.healths();
  options_.notify(fmt::format("RELOADING=1\nMONOTONIC_USEC={}\nSTATUS=reading {}",
                              ReadClocks().instant.time_since_epoch() / 1us, options_.file));
  const std::string not_yet = NotYet(prepared.apply());
  trial_.Apply({text, std::make_shared<const config::Config>(std::move(next))});
  ShowApplied();
  display_.Change([](status::ReloadState& state) { state.applied = ReadClocks().wall; });
  BeginTrial(trial, before);
  links_.tell(
      false, fmt::format("{}, by {}{}{}", reload::Summary(difference), ask.by, not_yet, OnTrial()));
  options_.notify(fmt::format("READY=1\nSTATUS={}{}", options_.summary(), OnTrial()));
  return Done(ask, difference, not_yet + NotKept(kept));
}

control::ReloadAnswer Reloader::Done(const control::ReloadAsk& ask,
                                     const reload::Difference& difference, const std::string& but) {
  control::ReloadAnswer answer;
  answer.ok = true;
  answer.applied = !difference.empty();
  answer.changes = reload::Sentences(difference);
  answer.text = reload::Summary(difference) + but;
  answer.confirm = trial_.Left(ReadClocks().instant);
  LogChanges(difference);
  log::Act(Level::info, "reload by {}: {}{}", ask.by, answer.text, OnTrial());
  return answer;
}

Duration Reloader::TimeFor(const control::ReloadAsk& ask, const config::Config& next) const {
  return trial_.TimeFor(next, ask.confirm, ReadClocks().instant);
}

void Reloader::BeginTrial(Duration time, const reload::Healths& before) {
  trial_.Begin(time, before, ReadClocks().instant);
  FollowTrial();
}

void Reloader::FollowTrial() {
  if (trial_.running()) {
    WatchTrial();
  } else {
    timer_.cancel();
  }
  display_.SetTrial(trial_.until());
}

std::string Reloader::OnTrial() const {
  if (!trial_.running()) return {};
  return "; confirm it within " + FormatDuration(trial_.Left(ReadClocks().instant)) +
         " with 'baudgate confirm'";
}

std::optional<control::ReloadAnswer> Reloader::NoTrial(const control::ReloadAsk& ask) const {
  if (!trial_.running()) {
    return Failed(kBadFile, "no configuration waits to be confirmed" +
                                (trial_.refused() ? ": " + state().not_the_file : std::string()));
  }
  if (ask.applied.empty() || ask.applied == FormatWallTime(state().applied)) return std::nullopt;
  return Failed(
      kBadFile,
      "another configuration is on trial meanwhile; nothing is changed. Look at it again");
}

control::ReloadAnswer Reloader::DoRevert(const control::ReloadAsk& ask) {
  if (auto none = NoTrial(ask)) return *none;
  control::ReloadAnswer answer;
  answer.text = TakeBack(ask.by + " has taken it back");
  answer.ok = true;
  answer.applied = true;
  return answer;
}

control::ReloadAnswer Reloader::DoConfirm(const control::ReloadAsk& ask) {
  if (auto none = NoTrial(ask)) return *none;
  if (const Status status = copies_.Keep({trial_.applied()->text}); !status) {
    return Failed(kCanNotBe, "the configuration cannot be confirmed: " + status.error());
  }
  BeginTrial(Duration::zero(), {});
  log::Act(Level::info, "the configuration is confirmed by {}", ask.by);
  options_.notify("STATUS=" + options_.summary());
  control::ReloadAnswer answer;
  answer.ok = true;
  answer.text = "confirmed";
  return answer;
}

void Reloader::WatchTrial() {
  timer_.expires_after(kLook);
  timer_.async_wait([this](const asio::error_code& stopped) {
    if (stopped || !trial_.running()) return;
    const auto why = trial_.Look(links_.healths(), ReadClocks().instant);
    if (why) {
      TakeBack(*why);
      return;
    }
    WatchTrial();
  });
}

void Reloader::WatchFiles() {
  file_timer_.expires_after(kLookAtFile);
  file_timer_.async_wait([this](const asio::error_code& stopped) {
    if (stopped) return;
    file_.Look([this, applied = trial_.applied()](const Result<std::string>& text) {
      if (applied == trial_.applied()) OnFile(text);
    });
    copies_.Look(trial_.ToKeep(), [this](const std::optional<std::string>& trouble) {
      display_.Change(
          [&](status::ReloadState& state) { state.not_kept = trouble.value_or(std::string()); });
    });
    WatchFiles();
  });
}

/// Shows in the status that the file differs from the running configuration. For a text that was
/// taken back, the status shows ReloadState::not_the_file instead.
void Reloader::OnFile(const Result<std::string>& text) {
  std::string note;
  if (!text) {
    note = options_.file + " " + text.error();
  } else if (*text != trial_.applied()->text && !trial_.refused()) {
    note = options_.file +
           " differs from the running configuration: 'baudgate reload --dry-run' shows the "
           "changes, 'baudgate reload --confirm 60s' applies them";
  }
  display_.Change([&](status::ReloadState& state) { state.file_changed = note; });
}

/// The file is not written, because it belongs to the user.
std::string Reloader::TakeBack(const std::string& why) {
  options_.notify(fmt::format(
      "RELOADING=1\nMONOTONIC_USEC={}\nSTATUS=going back from {} to the confirmed configuration",
      ReadClocks().instant.time_since_epoch() / 1us, options_.file));
  const config::Config& confirmed = *trial_.confirmed().config;
  reload::Difference difference = reload::Compare(*links_.running(), confirmed);
  links_.examine(confirmed, difference);
  difference.restart.clear();  // the confirmed settings have run before, so they need no restart
  std::vector<std::string> missing;
  if (!difference.empty()) missing = links_.prepare(confirmed, difference).apply();
  trial_.TakeBack(why);
  ShowApplied();
  FollowTrial();
  // If the gateway ends before this write, the next start finds the trial and takes it back, too.
  const Status kept = copies_.Keep(trial_.ToKeep());
  if (!kept) log::Warn("the configuration cannot be saved for the next start: {}", kept.error());
  LogChanges(difference);
  const std::string said = reload::TakenBack(options_.file, why);
  display_.Change([&](status::ReloadState& state) {
    state.applied = ReadClocks().wall;
    state.not_the_file = said;
  });
  const std::string all = said + NotYet(missing);
  log::Act(Level::warning, "{}", all);
  links_.tell(true, all);
  options_.notify(fmt::format("READY=1\nSTATUS={}; {}", options_.summary(), said));
  return all;
}

}  // namespace baudgate::daemon
