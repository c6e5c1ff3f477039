// The DDS process' side of the link: what each message makes it do, and what it answers. Knows
// neither sockets nor Fast DDS; gateway/outputs/dds/process/serve.h joins them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/sample_writer.h"

namespace baudgate::dds {

class LinkServer {
 public:
  using MakeWriter = std::function<Result<std::unique_ptr<SampleWriter>>(const LinkOpen& open)>;
  /// `wake`: on any thread, when NextRequest has something.
  explicit LinkServer(MakeWriter make, std::function<void()> wake = {});

  /// Good: go on. An error: the link must be closed; its sentence says why.
  Status Take(View packet);
  /// The packet that is due to the daemon now, if any: the answer to open, then counts.
  std::optional<Bytes> Answer(Instant now);
  Instant NextAnswer() const;
  /// The packet with the next write request.
  std::optional<Bytes> NextRequest();
  /// The daemon said that this is the end: Leave is to be called.
  bool ended() const { return ended_; }
  /// Ends publishing after the daemon has ended or is gone. Publishes the latest sample of each
  /// point once more with quality bad_not_connected, unless it has that quality already, for at
  /// most kEndTime. Then waits at most 550 ms for subscribers and destroys the writers. Returns
  /// when to call it again; empty: finished.
  std::optional<Instant> Leave(Instant now);

 private:
  Status Open(View body);
  Status Reopen(const Room& room);
  void Remember(View body);
  template <typename Sample>
  Status Publish(View body, Sample& sample);
  Status Reply(View body);
  template <typename Sample>
  Status PublishOnce(View body, std::deque<Sample>& held);
  template <typename Sample>
  void Retry(std::deque<Sample>& held);
  void RetryEvents(Instant now);
  LinkCounts Counts() const;

  const MakeWriter make_;
  RequestIntake requests_;  // outlives the writer, whose threads fill it
  std::unique_ptr<SampleWriter> writer_;
  /// The latest sample of each point, encoded, by device and point. A point whose latest sample has
  /// the quality bad_not_connected has no entry: Leave need not publish it.
  std::unordered_map<std::string, Bytes> latest_;
  std::optional<Pacer> end_pacer_;  // since Leave
  std::optional<Instant> leave_by_;
  bool acknowledged_ = false;  ///< subscribers have been waited for
  std::optional<Instant> closes_at_;
  PointSample point_;  ///< kept to save its memory
  DeviceSample device_;
  GatewaySample gateway_;
  std::deque<EventSample> events_;  ///< that the library has not taken yet, in their order
  std::deque<AlarmSample> alarms_;  ///< the same
  Instant events_retry_{};
  std::optional<Bytes> answer_;  ///< to open
  LinkCounts counts_;
  LinkCounts told_;
  Instant told_at_{};
  bool ended_ = false;
};

}  // namespace baudgate::dds
