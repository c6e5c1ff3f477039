// `Forwarding` is the work of a Forwarder without its thread: it reads the values, sends them,
// repeats and splits portions, and stores the place. All waits are times that Round returns.
//
//   answer       what follows
//   confirmed    the next portion; the place is stored, at most once a second
//   retry        the same portion after 1 s, 2 s, 4 s … 60 s, with a random part, or later if the
//                receiver has said so
//   refused      the portion in halves, until a single value is refused: the value goes to
//                refused-NAME.jsonl and is not sent again
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/outputs/outlet/cursor_file.h"
#include "gateway/outputs/outlet/outlet.h"
#include "gateway/records/history/kept_reader.h"

namespace baudgate::outlet {

class Forwarding : public std::enable_shared_from_this<Forwarding> {
 public:
  /// Values a second at most. The limit and the pauses between reads leave the machine to the
  /// lines while a backlog is sent.
  static constexpr std::int64_t kMostPerSecond = 20'000;
  static constexpr Duration kFirstWait = 1s;
  static constexpr Duration kLongestWait = 60s;
  static constexpr Duration kSaveEvery = 1s;
  static constexpr Duration kLookEvery = 1s;  ///< for new values, when all are sent
  static constexpr Duration kTryAgain = 10s;  ///< after a failure of the disk
  static constexpr Duration kWatchEvery = 10s;
  /// A file that cannot be read is left out after this time: a damaged one, and any other.
  static constexpr Duration kGiveUpDamaged = 1min;
  static constexpr Duration kGiveUp = 10min;
  static constexpr std::uintmax_t kMostRefusedBytes = 1'000'000;

  explicit Forwarding(Forwarder::Options options, std::string vfs = {});

  /// `wake` requests a round; called on any thread.
  void SetWake(std::function<void()> wake);
  /// Does all that is due, and returns the time of the next round.
  Instant Round(bool last);
  void SetHistory(std::shared_ptr<const history::HistorySource> history);
  void SetConnected(bool connected);
  ForwarderState state() const;
  /// After this call the receiver is not called any more.
  void Close();
  /// Waits until the last round has ended, or `patience` has passed.
  void WaitForEnd(Duration patience);

 private:
  void TakeHistory();
  bool FindPlace(Now now);
  bool ReadNext(Now now);
  void TakePart(history::StoredPart&& part, Now now);
  void OnUnread(const history::UnreadFile& file, Now now);
  void OnLost(const history::LostValues& lost, Now now);
  void SendFront();
  std::optional<Answer> TakeAnswer();
  void OnAnswer(Answer answer, Now now);
  void OnConfirmed(std::size_t values);
  void OnRefused(const Answer& answer, Now now);
  void PutAside(const KeptValue& value, const std::string& why, Now now);
  void EndPortion();
  void ShowPlace();
  void Save(Now now, bool force);
  void Watch(Now now);
  Instant NextRound(Instant wanted) const;
  void SetTrouble(std::string Forwarding::*which, const std::string& text);

  const Forwarder::Options options_;

  // Only the round uses these.
  CursorFile cursor_;
  std::shared_ptr<const history::HistorySource> source_;
  std::string folder_;
  std::unique_ptr<history::KeptReader> reader_;
  std::optional<history::Pass> pass_;  // confirmed; empty: not known yet
  history::Pass next_{};               // the place after the portion that is being sent
  std::deque<Portion> queue_;          // parts of this portion that are not confirmed yet
  bool under_way_ = false;
  bool dirty_ = false;  // `pass_` is not stored yet
  const WallTime started_;
  std::int64_t first_run_ = 0;  // the newest run when the place was found
  Instant save_at_{};
  Instant next_try_{};
  Instant next_read_{};
  Instant watch_at_{};
  int tries_ = 0;
  // The file that cannot be read, and since when.
  std::string unread_;
  std::optional<Instant> unread_since_;
  std::optional<Instant> gap_logged_;
  std::optional<Instant> refusal_logged_;
  std::minstd_rand random_;
  // Sentences; empty: no trouble.
  std::string receiver_trouble_;
  std::string disk_trouble_;
  std::string cursor_trouble_;

  mutable Mutex mutex_;
  std::shared_ptr<const history::HistorySource> history_ BAUDGATE_GUARDED_BY(mutex_);
  bool connected_ BAUDGATE_GUARDED_BY(mutex_);
  bool reconnected_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::optional<Answer> answer_ BAUDGATE_GUARDED_BY(mutex_);
  ForwarderState state_ BAUDGATE_GUARDED_BY(mutex_);
  // The time up to which all values are confirmed; empty: not known yet.
  std::optional<WallTime> place_ BAUDGATE_GUARDED_BY(mutex_);
  // When nothing was left to send; empty: not yet.
  std::optional<Instant> all_sent_at_ BAUDGATE_GUARDED_BY(mutex_);
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::condition_variable end_;
  Mutex waking_;
  std::function<void()> wake_ BAUDGATE_GUARDED_BY(waking_);
  Mutex sending_;
  bool closed_ BAUDGATE_GUARDED_BY(sending_) = false;
};

}  // namespace baudgate::outlet
