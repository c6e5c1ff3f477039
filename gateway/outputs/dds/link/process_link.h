// The daemon's end of the link: a thread that has a process for DDS started (or waits for the one
// that systemd starts), listens to it, and lets the publisher's samples go to it while it is there.
// Lines and Modbus never wait for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/base/log.h"
#include "gateway/base/worker.h"
#include "gateway/outputs/dds/link/bounded_lines.h"
#include "gateway/outputs/dds/link/child_process.h"
#include "gateway/outputs/dds/link/link_keeper.h"
#include "gateway/outputs/dds/link/link_message.h"
#include "gateway/outputs/dds/link/link_writer.h"
#include "gateway/outputs/dds/link/packet_socket.h"

namespace baudgate::dds {

struct ProcessLinkOptions {
  LinkOpen open;
  std::string program;  ///< empty: baudgate-dds, where FindProgram finds it
  /// Not empty: no process is started, but awaited at this socket.
  std::string socket;
  /// The group that may connect, and the user that may beside root and our own.
  std::string socket_group = "baudgate-dds";
  std::string socket_user = "baudgate-dds";
  std::uint64_t memory = 1ULL << 30;  ///< address space of a process that we start, in bytes
};

class ProcessLink {
 public:
  /// Called on the link's thread, at a change.
  using Log = std::function<void(log::Level level, const std::string& line)>;

  /// The error says why the socket cannot be had. A program that is missing is a state: the
  /// gateway runs without.
  static Result<std::unique_ptr<ProcessLink>> Create(ProcessLinkOptions options, Log log);
  ~ProcessLink();  ///< as Stop

  /// The writer for a publisher. It may outlive the link; then it has no receiver.
  std::shared_ptr<LinkWriter> writer() const { return writer_; }
  LinkState state() const;
  /// Ends process and thread within half a second. After the publisher's. Idempotent.
  void Stop();

 private:
  ProcessLink(ProcessLinkOptions options, Log log);

  Instant Round(bool last);
  void Act(Instant now);
  void Start(Instant now);
  void Welcome(Instant now);
  void Talk(Descriptor socket, Instant now);
  void Listen(Instant now);
  Status Understand(View packet, Instant now);
  void PassOutput(Instant now);
  void End(std::string reason, Instant now);
  /// For packets, output, a peer, the time of the keeper, or Stop.
  void Wait();
  void Publish(const LinkState& before);
  void Tell(log::Level level, const std::string& line) const {
    if (log_) log_(level, line);
  }

  const ProcessLinkOptions options_;
  const Log log_;
  const std::shared_ptr<LinkWriter> writer_;
  LinkKeeper keeper_;
  Descriptor wake_;
  Descriptor listener_;
  Descriptor socket_;
  std::optional<ChildProcess> child_;
  BoundedLines output_;
  std::set<std::string> told_;  // remarks; no more than kMostTold, as strangers cause them
  std::unique_ptr<PacketBuffer> buffer_ = std::make_unique<PacketBuffer>();

  mutable Mutex mutex_;
  LinkState shown_ BAUDGATE_GUARDED_BY(mutex_);
  Worker worker_;
};

}  // namespace baudgate::dds
