// `WriteService` handles the write requests that come over DDS: it answers repeated requests, and
// passes new requests to gateway/bus/writes/write_gate.h with the client name "dds:GUID". It has no
// thread: DdsWrites calls it. ValueOf returns the value that a request contains.
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

// ValueOf uses `text` if `text` is not empty or the point is a string, and `value` otherwise:
//
//   uint16   value 1               1
//   uint64   text "12345678901234567890"
//   bool     value 1, text "on"    true
//   float32  value nan             an error

/// Returns the value of the request in the point's type. The error is a sentence that contains what
/// is allowed.
Result<Value> ValueOf(const config::Point& point, const RequestSample& request);
/// Returns the id by which a repeated request is detected. The value is part of it, as hexadecimal
/// text, so that two NaNs are equal. deadline_ms and not_after_ns are not part of it, because they
/// may differ when a client repeats its request.
bus::RequestId IdOf(const RequestSample& request);

class WriteService {
 public:
  /// The longest deadline_ms of a request. Without deadline_ms, a request waits for kWaitForDevice.
  static constexpr Duration kMostPatience = 60s;

  struct Ticket {
    std::string client;
    std::uint64_t seq = 0;
    Instant received{};
  };
  using Answer = std::function<void(ReplySample reply)>;
  using Ended = std::function<void(Ticket ticket, const WriteResult& result)>;

  /// The references must outlive this object. `answer` is called on the thread that calls Take or
  /// End. `ended` can be called on any thread, even after the end of this object; the owner passes
  /// its arguments to End.
  WriteService(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               bus::RequestBook::Past past, Answer answer, Ended ended);

  void Take(const WriteArrival& arrival, Now now);
  void End(const Ticket& ticket, const WriteResult& result, Instant now);
  /// Requests to this gateway that were handled. Any thread may call it.
  std::uint64_t taken() const { return taken_; }

 private:
  struct Place {
    std::uint32_t device = 0;  ///< index in the point store
    std::uint32_t point = 0;
    std::shared_ptr<const config::Device> config;
  };
  Result<Place> Find(const RequestSample& request);
  void LearnDevices();
  /// Records that the request was denied, if the request names an existing point.
  void Record(const WriteArrival& arrival, const std::string& reason);
  /// Passes the request to its line. If that fails, returns the answer to the client.
  std::optional<bus::RequestAnswer> Carry(const WriteArrival& arrival, Now now);
  void Reply(const Ticket& ticket, const bus::RequestAnswer& answer);

  const config::Config& config_;
  const bus::PointStore& store_;
  bus::WriteGate gate_;
  const Answer answer_;
  const Ended ended_;
  std::unordered_map<std::string, std::uint32_t> devices_;
  std::uint32_t known_ = 0;  ///< devices_ contains the devices 0…known_-1 of the store
  bus::RequestBook book_;
  std::atomic<std::uint64_t> taken_ = 0;
};

// DdsWrites is the thread that handles the write requests of a SampleWriter and sends the replies.
// Lines never wait for it.
class DdsWrites {
 public:
  /// Handles the requests of `writer` until StopTaking. `config`, `store`, `sink` and the objects
  /// that `past` refers to must outlive this object.
  DdsWrites(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
            bus::RequestBook::Past past, std::shared_ptr<SampleWriter> writer);
  ~DdsWrites();  ///< calls StopTaking and Stop

  /// After StopTaking, no request is passed to the sink. A second call does nothing.
  void StopTaking();
  /// Sends the replies that are ready, and ends the thread; later results are dropped. A second
  /// call does nothing.
  void Stop();

  std::uint64_t taken() const { return service_.taken(); }
  std::uint64_t dropped() const;

 private:
  struct Mail;

  Instant Answer();
  void SendReplies();

  const std::shared_ptr<SampleWriter> writer_;
  const std::shared_ptr<Mail> mail_;  // shared with the callbacks that lines call
  std::deque<ReplySample> replies_;   // only the service's thread uses it
  WriteService service_;
  Worker worker_;
};

}  // namespace baudgate::dds
