// `LinkServer` is the side of baudgate-dds on the link: it carries out the gateway's messages and
// creates the answers. It uses neither sockets nor Fast DDS; gateway/outputs/dds/process/serve.h
// connects it to them.
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
  /// `wake` is called, on any thread, when NextRequest has a packet.
  explicit LinkServer(MakeWriter make, std::function<void()> wake = {});

  /// Carries out one message of the gateway. After an error, the caller must close the link.
  Status Take(View packet);
  /// Returns the next packet for the gateway, if one is due: the answer to `open` or `end`, or
  /// counts.
  std::optional<Bytes> Answer(Instant now);
  Instant NextAnswer() const;
  std::optional<Bytes> NextRequest();
  bool ended() const { return ended_; }
  /// Ends publishing, after the gateway has sent `end` or has closed the link. Leave publishes the
  /// latest sample of each point again with quality bad_not_connected (unless it has that quality
  /// already), for at most kEndTime, waits at most 550 ms for subscribers, and destroys the
  /// writers. Returns the time of the next call; nothing: Leave has finished.
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
  RequestIntake requests_;  // declared before writer_, whose threads put requests into it
  std::unique_ptr<SampleWriter> writer_;
  /// The latest encoded sample of each point, by device + NUL + point. A point with quality
  /// bad_not_connected has no entry, because Leave need not publish it.
  std::unordered_map<std::string, Bytes> latest_;
  std::optional<Pacer> end_pacer_;
  std::optional<Instant> leave_by_;
  bool acknowledged_ = false;
  std::optional<Instant> closes_at_;
  PointSample point_;  ///< a member to reuse its memory
  DeviceSample device_;
  GatewaySample gateway_;
  /// Events and alarms that the library has not accepted yet, in their order.
  std::deque<EventSample> events_;
  std::deque<AlarmSample> alarms_;
  Instant events_retry_{};
  std::optional<Bytes> answer_;
  LinkCounts counts_;
  LinkCounts told_;
  Instant told_at_{};
  bool ended_ = false;
};

}  // namespace baudgate::dds
