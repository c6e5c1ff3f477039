// `Commands` carries out the commands that clients of the broker publish to TOPIC/set, with the
// same checks and the same record as every other write (gateway/bus/writes/write_gate.h). The
// answer goes to TOPIC/result.
//
//   12.5                                    the value only
//   {"value":12.5}                          the same
//   {"value":1,"confirm":true,"id":"7",     for a point that must be selected; with the answer's
//    "not_after":"2026-11-21T01:15:00Z"}    id, and not to be carried out after this time
//
// A retained command is refused, because the broker would send it again after each connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/mqtt/client.h"

namespace baudgate::mqtt {

/// A command as its client has written it.
struct Command {
  std::string value;  ///< as text
  bool confirm = false;
  std::string id{};
  std::optional<WallTime> not_after{};
};
Result<Command> ParseCommand(const std::string& payload);

class Commands {
 public:
  static constexpr std::size_t kLongestPayload = 4096;

  struct Answer {
    std::string topic;
    std::string payload;
  };

  /// `store` and `sink` must outlive this object. `client`: the name in the audit. `wake` is called
  /// on any thread when there is an answer.
  Commands(const bus::PointStore& store, bus::CommandSink& sink, std::string client,
           std::function<void()> wake);
  ~Commands() {
    const MutexLock lock(mail_->mutex);
    mail_->wake = nullptr;
  }
  Commands(const Commands&) = delete;
  Commands& operator=(const Commands&) = delete;

  /// Carries out a command. `at`: the point; empty: the topic is that of no point. `topic`: the
  /// topic of the point.
  void Take(const std::string& topic, std::optional<bus::PointRef> at, const Message& message,
            Now now);
  std::vector<Answer> TakeAnswers();
  /// After Stop, no command reaches a line. Any thread may call it.
  void Stop();

 private:
  struct Mail {
    Mutex mutex;
    std::vector<Answer> answers BAUDGATE_GUARDED_BY(mutex);
    std::function<void()> wake BAUDGATE_GUARDED_BY(mutex);
    void Add(Answer answer) {
      const MutexLock lock(mutex);
      answers.push_back(std::move(answer));
      if (wake) wake();
    }
  };

  const bus::PointStore& store_;
  const bus::Writer writer_;
  bus::WriteGate gate_;
  Mutex mutex_;
  bool taking_ BAUDGATE_GUARDED_BY(mutex_) = true;
  const std::shared_ptr<Mail> mail_ = std::make_shared<Mail>();  // shared with writes under way
};

}  // namespace baudgate::mqtt
