// Handles write requests that come by DDS: finds their client and point, duplicates
// are answered, and the rest goes through the door of all writers (gateway/bus/writes/write_gate.h)
// as client "dds:GUID". No thread of its own: DdsWrites has it. ValueOf gives the value that a
// request means.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>

#include "config/model/config.h"
#include "config/model/point.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/base/worker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/request_book.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_gate.h"
#include "gateway/outputs/dds/sample_writer.h"
#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

// The value that a write request means for a point. `text` counts unless it is empty, and always
// for a text; then `value`:
//
//   uint16   value 1               1
//   uint64   text "12345678901234567890"
//   bool     value 1, text "on"    true
//   float32  value nan             an error

/// The error says in one sentence what would be right.
Result<Value> ValueOf(const config::Point& point, const RequestSample& request);
/// Its content has every bit of the value, so two NaNs are equal. It has neither of the two times,
/// which may differ when a client repeats its request.
bus::RequestId IdOf(const RequestSample& request);

class WriteService {
 public:
  /// How long a request may wait at most; one that does not say waits kWaitForDevice.
  static constexpr Duration kMostPatience = 60s;

  /// A request that has gone to its line.
  struct Ticket {
    std::string client;
    std::uint64_t seq = 0;
    Instant received{};
  };
  using Answer = std::function<void(ReplySample reply)>;
  using Ended = std::function<void(Ticket ticket, const WriteResult& result)>;

  /// All outlive it. `answer` is called on the service's thread; `ended` on any, even when the
  /// service is gone: what it is told goes to End.
  WriteService(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               bus::RequestBook::Past past, Answer answer, Ended ended);

  void Take(const WriteArrival& arrival, Now now);
  void End(const Ticket& ticket, const WriteResult& result, Instant now);
  /// Requests to this gateway that were looked at; from any thread.
  std::uint64_t taken() const { return taken_; }

 private:
  struct Place {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;   ///< index in the device's points
    std::shared_ptr<const config::Device> config;
  };
  Result<Place> Find(const RequestSample& request);
  /// A reload may have brought more.
  void LearnDevices();
  /// That it was denied, where it names a point.
  void Record(const WriteArrival& arrival, const std::string& reason);
  /// Empty: it has gone to its line.
  std::optional<bus::RequestAnswer> Carry(const WriteArrival& arrival, Now now);
  void Reply(const Ticket& ticket, const bus::RequestAnswer& answer);

  const config::Config& config_;
  const bus::PointStore& store_;
  bus::WriteGate gate_;
  const Answer answer_;
  const Ended ended_;
  std::unordered_map<std::string, std::uint32_t> devices_;  ///< by name
  std::uint32_t known_ = 0;                                 ///< so many of the store's are there
  bus::RequestBook book_;
  std::atomic<std::uint64_t> taken_ = 0;
};

// The thread on which write requests that come by DDS are looked at, and from which they are
// answered: between a SampleWriter and WriteService. Lines never wait for it.
class DdsWrites {
 public:
  /// Requests that `writer` has, from now on, until StopTaking. `config`, `store` and `sink`
  /// outlive it; so does what `past` looks at, see WriteService.
  DdsWrites(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
            bus::RequestBook::Past past, std::shared_ptr<SampleWriter> writer);
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
