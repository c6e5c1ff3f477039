// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/change_recorder.h"

namespace baudgate::history {

ChangeRecorder::ChangeRecorder(const config::History& history, PointStore& store, Now now)
    : store_(store), feed_(store.Subscribe()), recorder_(history, store, now) {}

Batch ChangeRecorder::Take(Now now, std::size_t room, bool anew, bool last) {
  Batch batch;
  recorder_.Take(changes_, now, room, batch);
  if (anew) recorder_.BeginAnew(now, room, batch);
  if (now.instant >= tick_) {
    recorder_.Tick(now, room, batch);
    tick_ = now.instant + kTick;
  }
  if (last) recorder_.End(now, batch);
  return batch;
}

}  // namespace baudgate::history
