// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/outlet/forwarding.h"

#include <fmt/format.h>
#include <time.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <variant>

namespace baudgate::outlet {
namespace {

namespace fs = std::filesystem;
using history::ToWall;

/// A read of a backlog is followed by a pause of this many times the processor time that it took.
constexpr int kPause = 7;
constexpr Duration kLogEvery = 1min;
constexpr Duration kRecently = 5s;
/// An outlet is in step with a place of this age, because a history without new values shows only
/// every 10 s up to which time it is complete.
constexpr Duration kInStep = 15s;

Duration ProcessorTime() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

nlohmann::ordered_json JsonOf(const Value& value) {
  return std::visit(
      [](const auto& its) -> nlohmann::ordered_json {
        if constexpr (std::is_same_v<std::decay_t<decltype(its)>, std::monostate>) {
          return nullptr;
        } else {
          return its;
        }
      },
      value);
}

}  // namespace

Forwarding::Forwarding(Forwarder::Options options, std::string vfs)
    : options_(std::move(options)),
      cursor_(options_.folder / ("outlet-" + options_.name + ".db"), std::move(vfs)),
      started_(options_.clocks().wall),
      random_(static_cast<std::uint32_t>(started_.time_since_epoch().count())),
      connected_(options_.connected) {}

void Forwarding::SetWake(std::function<void()> wake) {
  const MutexLock lock(waking_);
  wake_ = std::move(wake);
}

void Forwarding::SetHistory(std::shared_ptr<const history::HistorySource> history) {
  {
    const MutexLock lock(mutex_);
    history_ = std::move(history);
    state_.has_history = history_ != nullptr;
  }
  const MutexLock lock(waking_);
  if (wake_) wake_();
}

void Forwarding::SetConnected(bool connected) {
  {
    const MutexLock lock(mutex_);
    reconnected_ = reconnected_ || (connected && !connected_);
    connected_ = connected;
  }
  const MutexLock lock(waking_);
  if (wake_) wake_();
}

ForwarderState Forwarding::state() const {
  const Now now = options_.clocks();
  const MutexLock lock(mutex_);
  ForwarderState state = state_;
  const Duration age = place_ ? now.wall - *place_ : 0s;
  const bool all_sent = all_sent_at_ && now.instant - *all_sent_at_ <= kRecently;
  state.behind = all_sent || age <= kInStep ? Duration() : age;
  return state;
}

void Forwarding::Close() {
  const MutexLock lock(sending_);
  closed_ = true;
}

void Forwarding::WaitForEnd(Duration patience) {
  const Instant until = ReadClocks().instant + patience;
  MutexLock lock(mutex_);
  while (!ended_ && lock.WaitUntil(end_, until)) {
  }
}

void Forwarding::SetTrouble(std::string Forwarding::*which, const std::string& text) {
  const bool is_new = (this->*which).empty() && !text.empty();
  const bool ends = !(this->*which).empty() && text.empty();
  if (is_new) options_.warn(fmt::format("{}: {}", options_.name, text));
  if (ends) options_.inform(fmt::format("{}: solved: {}", options_.name, this->*which));
  this->*which = text;
  std::string shown = receiver_trouble_;
  for (const std::string* other : {&disk_trouble_, &cursor_trouble_}) {
    if (shown.empty()) shown = *other;
  }
  const MutexLock lock(mutex_);
  if (shown.empty()) {
    state_.trouble_since.reset();
  } else if (!state_.trouble_since) {
    state_.trouble_since = options_.clocks().wall;
  }
  state_.trouble = std::move(shown);
}

Instant Forwarding::Round(bool last) {
  const Now now = options_.clocks();
  if (last) {
    Save(now, true);
    const MutexLock lock(mutex_);
    ended_ = true;
    end_.notify_all();
    return kWhenWoken;
  }
  Watch(now);
  TakeHistory();
  if (under_way_) {
    std::optional<Answer> answer = TakeAnswer();
    if (!answer) return NextRound(kWhenWoken);
    OnAnswer(std::move(*answer), now);
  }
  Save(now, false);
  bool connected = false;
  {
    const MutexLock lock(mutex_);
    connected = connected_;
    if (std::exchange(reconnected_, false)) next_try_ = {};
  }
  if (!source_) return NextRound(kWhenWoken);
  if (!pass_ && !FindPlace(now)) return now.instant + kLookEvery;
  if (!connected) return NextRound(kWhenWoken);
  if (now.instant < next_try_) return NextRound(next_try_);
  if (queue_.empty()) {
    if (now.instant < next_read_) return NextRound(next_read_);
    if (!ReadNext(now)) return NextRound(now.instant + kLookEvery);
    if (queue_.empty()) return now.instant;
  }
  SendFront();
  return now.instant;
}

Instant Forwarding::NextRound(Instant wanted) const {
  if (options_.watch) wanted = std::min(wanted, watch_at_);
  return dirty_ ? std::min(wanted, save_at_) : wanted;
}

void Forwarding::Watch(Now now) {
  if (!options_.watch || now.instant < watch_at_) return;
  watch_at_ = now.instant + kWatchEvery;
  const ForwarderState shown = state();
  const MutexLock lock(sending_);
  if (!closed_) options_.watch(shown, now);
}

void Forwarding::TakeHistory() {
  std::shared_ptr<const history::HistorySource> history;
  {
    const MutexLock lock(mutex_);
    history = history_;
  }
  if (history == source_) return;
  source_ = std::move(history);
  if (!source_) return;
  std::string folder = source_->state().folder;
  if (folder == folder_) return;
  folder_ = std::move(folder);
  reader_ = std::make_unique<history::KeptReader>(folder_);
}

/// Loads the place, or begins with the present values if none is stored. Returns false if the disk
/// has to be asked again later.
bool Forwarding::FindPlace(Now now) {
  if (now.instant < next_read_) return false;
  next_read_ = now.instant + kTryAgain;
  const history::HistoryState history = source_->state();
  if (history.disk == records::Disk::opening) {
    next_read_ = {};
    return false;
  }
  const auto fail = [&](const std::string& why) {
    SetTrouble(&Forwarding::disk_trouble_, "no values are sent: " + why);
    return false;
  };
  if (folder_.empty()) return fail(history.trouble);
  if (options_.folder.empty()) return fail(options_.why_no_folder);
  std::string news;
  const Status opened = cursor_.Open(news);
  if (!news.empty()) options_.warn(options_.name + ": " + news);
  if (!opened) return fail(opened.error());
  auto stored = cursor_.Load();
  if (!stored) return fail(stored.error());
  const std::optional<history::Pass> newest = reader_->Newest();
  if (!newest) return fail("the newest file of the history cannot be read");
  first_run_ = newest->run;
  pass_ = *stored;
  if (!pass_) {
    pass_ = *newest;
    dirty_ = true;
    options_.inform(
        fmt::format("{}: begins with the values that are stored from now on", options_.name));
  }
  next_read_ = {};
  ShowPlace();
  SetTrouble(&Forwarding::disk_trouble_, {});
  return true;
}

/// Fills the queue. Returns false if there is nothing to send now. The queue can stay empty if the
/// outlet wants none of the values.
bool Forwarding::ReadNext(Now now) {
  const Duration before = ProcessorTime();
  history::StoredPart part = reader_->Read(*pass_, options_.most);
  if (part.more) next_read_ = now.instant + (ProcessorTime() - before) * kPause;
  const bool moved = part.next != *pass_;
  TakePart(std::move(part), now);
  return moved || !queue_.empty();
}

void Forwarding::TakePart(history::StoredPart&& part, Now now) {
  for (const history::LostValues& lost : part.lost) OnLost(lost, now);
  if (part.foreign) {
    const history::Millis from = std::min(part.next.from, pass_->from);
    OnLost({from, part.next.from,
            "the history was restored from a backup or replaced; the gateway cannot know which of "
            "its values the receiver has"},
           now);
  }
  if (part.unread) {
    OnUnread(*part.unread, now);
  } else if (part.more || !part.next.in_span()) {
    unread_since_.reset();
    SetTrouble(&Forwarding::disk_trouble_, {});
  }
  next_ = part.next;
  Portion portion;
  for (history::StoredValue& value : part.values) {
    if (options_.wanted && !options_.wanted(value.point)) continue;
    const std::int64_t seq = value.entry.time + next_.offset;
    portion.values.push_back({std::move(value.point), std::move(value.entry), seq});
  }
  if (!part.more && !part.unread) {
    const MutexLock lock(mutex_);
    all_sent_at_ = now.instant;
  }
  if (portion.values.empty()) return EndPortion();
  portion.again = next_.run < first_run_ || (next_.run == first_run_ &&
                                             ToWall(portion.values.front().entry.time) <= started_);
  const auto count = static_cast<std::int64_t>(portion.values.size());
  next_read_ = std::max(next_read_, now.instant + Duration(1s) * count / kMostPerSecond);
  queue_.push_back(std::move(portion));
}

void Forwarding::OnUnread(const history::UnreadFile& file, Now now) {
  if (!unread_since_ || unread_ != file.text) {
    unread_ = file.text;
    unread_since_ = now.instant;
    // The history checks the file, and puts it aside if it is damaged.
    (void)source_->Read({.since = file.day, .until = file.day + history::kDay});
  }
  SetTrouble(&Forwarding::disk_trouble_, "sending waits for a file of the history: " + file.text);
  next_read_ = now.instant + kTryAgain;
  if (now.instant - *unread_since_ < (file.damaged ? kGiveUpDamaged : kGiveUp)) return;
  reader_->GiveUp(file.day);
  next_read_ = {};
}

void Forwarding::OnLost(const history::LostValues& lost, Now now) {
  const std::string text =
      fmt::format("values from {} to {} cannot be sent: {}", FormatWallTime(ToWall(lost.from)),
                  FormatWallTime(ToWall(lost.until)), lost.why);
  if (!gap_logged_ || now.instant - *gap_logged_ >= kLogEvery) {
    gap_logged_ = now.instant;
    options_.warn(options_.name + ": " + text);
  }
  const MutexLock lock(mutex_);
  ++state_.gaps;
  state_.last_gap = Gap{lost.from, lost.until, lost.why};
}

void Forwarding::SendFront() {
  under_way_ = true;
  {
    const MutexLock lock(mutex_);
    answer_.reset();
    state_.sent += queue_.front().values.size();
  }
  const MutexLock lock(sending_);
  if (closed_) return;
  options_.receiver->Send(queue_.front(), [weak = weak_from_this()](Answer answer) {
    const auto self = weak.lock();
    if (!self) return;
    {
      const MutexLock its_lock(self->mutex_);
      self->answer_ = std::move(answer);
    }
    const MutexLock its_lock(self->waking_);
    if (self->wake_) self->wake_();
  });
}

std::optional<Answer> Forwarding::TakeAnswer() {
  const MutexLock lock(mutex_);
  return std::exchange(answer_, std::nullopt);
}

void Forwarding::OnAnswer(Answer answer, Now now) {
  under_way_ = false;
  if (answer.kind == Answer::Kind::retry) {
    SetTrouble(&Forwarding::receiver_trouble_, answer.why);
    queue_.front().again = true;
    const Duration whole = std::min(kLongestWait, kFirstWait * (1 << std::min(tries_, 6)));
    ++tries_;
    // Half of the wait is random, so that gateways of one plant do not come back together.
    const auto half = (whole / 2).count();
    const Duration wait(half + std::uniform_int_distribution<Duration::rep>(0, half)(random_));
    next_try_ = now.instant + std::max(wait, std::min<Duration>(answer.wait.value_or(0s), 1h));
    return;
  }
  tries_ = 0;
  SetTrouble(&Forwarding::receiver_trouble_, {});
  if (answer.kind == Answer::Kind::confirmed) {
    OnConfirmed(queue_.front().values.size());
    queue_.pop_front();
  } else {
    OnRefused(answer, now);
  }
  if (queue_.empty()) EndPortion();
}

void Forwarding::OnConfirmed(std::size_t values) {
  const MutexLock lock(mutex_);
  state_.confirmed += values;
}

void Forwarding::OnRefused(const Answer& answer, Now now) {
  Portion portion = std::move(queue_.front());
  queue_.pop_front();
  std::vector<KeptValue>& values = portion.values;
  std::vector<std::size_t> refused = answer.refused;
  if (values.size() == 1) refused = {0};
  if (!refused.empty()) {
    std::vector<KeptValue> others;
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (std::ranges::find(refused, i) != refused.end()) {
        PutAside(values[i], answer.why, now);
      } else {
        others.push_back(std::move(values[i]));
      }
    }
    if (!others.empty()) queue_.push_front({std::move(others), portion.again});
    return;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  queue_.push_front(
      {{std::make_move_iterator(middle), std::make_move_iterator(values.end())}, portion.again});
  values.erase(middle, values.end());
  queue_.push_front(std::move(portion));
}

void Forwarding::PutAside(const KeptValue& value, const std::string& why, Now now) {
  const nlohmann::ordered_json row = {{"point", value.point},
                                      {"time", FormatWallTime(ToWall(value.entry.time))},
                                      {"value", JsonOf(value.entry.value)},
                                      {"quality", Name(value.entry.quality)},
                                      {"seq", value.seq},
                                      {"why", why}};
  const fs::path path = options_.folder / fmt::format("refused-{}.jsonl", options_.name);
  std::error_code none;
  if (const auto size = fs::file_size(path, none); !none && size >= kMostRefusedBytes) {
    fs::rename(path, path.string() + ".1", none);
  }
  std::ofstream file(path, std::ios::app);
  file << row.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) << '\n';
  if (!refusal_logged_ || now.instant - *refusal_logged_ >= kLogEvery) {
    refusal_logged_ = now.instant;
    options_.warn(fmt::format("{}: a value of {} is refused and not sent again ({}): {}",
                              options_.name, value.point, path.string(), why));
  }
  const MutexLock lock(mutex_);
  ++state_.put_aside;
  state_.refused = why;
  state_.refused_at = now.wall;
}

/// Moves the place behind the values that were sent.
void Forwarding::EndPortion() {
  if (next_ == *pass_) return;
  // The number that is added to the times of a new run must not be lost.
  if (next_.run != pass_->run) save_at_ = {};
  pass_ = next_;
  dirty_ = true;
  ShowPlace();
}

void Forwarding::ShowPlace() {
  const MutexLock lock(mutex_);
  place_ = pass_->run == 0 ? started_ : ToWall(pass_->from);
}

void Forwarding::Save(Now now, bool force) {
  if (!dirty_ || (!force && now.instant < save_at_)) return;
  const Status status = cursor_.Save(*pass_);
  save_at_ = now.instant + (status ? kSaveEvery : kTryAgain);
  dirty_ = !status;
  SetTrouble(&Forwarding::cursor_trouble_,
             status ? std::string()
                    : "the place in the history cannot be stored, so values are sent again after "
                      "the next start: " +
                          status.error());
}

namespace {

/// How long the end of a forwarder waits for the disk.
constexpr Duration kPatience = 2s;

}  // namespace

Forwarder::Forwarder(Options options)
    : forwarding_(std::make_shared<Forwarding>(std::move(options))),
      worker_("outlet", [forwarding = forwarding_](bool last) { return forwarding->Round(last); }) {
  forwarding_->SetWake([this] { worker_.Wake(); });
  worker_.Start();
}

Forwarder::~Forwarder() {
  forwarding_->Close();
  forwarding_->SetWake({});
  worker_.Leave();
  forwarding_->WaitForEnd(kPatience);
}

void Forwarder::SetHistory(std::shared_ptr<const history::HistorySource> history) {
  forwarding_->SetHistory(std::move(history));
}

void Forwarder::SetConnected(bool connected) { forwarding_->SetConnected(connected); }

ForwarderState Forwarder::state() const { return forwarding_->state(); }

}  // namespace baudgate::outlet
