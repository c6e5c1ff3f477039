// The thread on which write requests that come by DDS are looked at, and from which they are
// answered: between a SampleWriter and gateway/outputs/dds/writes/write_service.h. Lines never wait
// for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>

#include "gateway/base/worker.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/writes/write_service.h"

namespace baudgate::dds {

class DdsWrites {
 public:
  /// Requests that `writer` has, from now on, until StopTaking. `config`, `store` and `sink`
  /// outlive it; so does what `past` looks at, see WriteService.
  DdsWrites(const config::Config& config, const PointStore& store, CommandSink& sink,
            RequestBook::Past past, std::shared_ptr<SampleWriter> writer);
  ~DdsWrites();  ///< as both

  /// Nothing goes to the sink after this. Idempotent.
  void StopTaking();
  /// Sends the answers that are there and ends the thread; later ones are gone. Idempotent.
  void Stop();

  std::uint64_t taken() const { return service_.taken(); }
  /// Requests that came too fast to be looked at.
  std::uint64_t dropped() const;

 private:
  struct Mail;

  Instant Answer();
  void SendReplies();

  const std::shared_ptr<SampleWriter> writer_;
  const std::shared_ptr<Mail> mail_;  // the lines have it, too
  std::deque<ReplySample> replies_;   // of the thread
  WriteService service_;
  Worker worker_;
};

}  // namespace baudgate::dds
