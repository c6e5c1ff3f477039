// The one door of everybody who writes to points: Modbus clients, the command line, DDS. Routed
// writes do not pass here: only the listener's `permit` holds for them
// (gateway/modbus/service/request_routing.cpp). Whatever writers of points ask passes the same
// rules here, in this order, before anything is sent:
//
//   may the point be written?            read_only     rw in the profile and `write: allow`
//   is the value one that it may have?   value         type, min, max, step
//   was it selected?                     not_selected  where `select: yes` stands
//   do the interlocks hold?              locked        allow_when; once more when it is sent
//   is there room in the line's queue?   busy
//
// What is refused is handed to the sink as denied, but for busy, which the sink has said. For one
// thread; each output has its own. docs/writes.md.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/requests/write_command.h"
#include "gateway/store/point_store.h"
#include "gateway/writes/selections.h"

namespace baudgate {

/// A client: who it is for the record, and which of its kind for selections.
struct Writer {
  std::string name;          ///< WriteCommand::client
  std::uint64_t number = 0;  ///< its connection
};

struct WriteAsk {
  struct Part {
    std::uint32_t point = 0;  ///< index in the device's points
    Value value{};            ///< as users see it
  };
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<Part> parts;
  bool confirmed = false;  ///< the client has said twice that it means it: no selection is needed
  Instant deadline{};
  std::shared_ptr<const std::atomic<bool>> dropped{};  ///< see WriteCommand
  std::function<void(const WriteResult&)> done{};
};

struct WriteRefusal {
  enum class Why : std::uint8_t { read_only, value, not_selected, locked, busy };
  Why why = Why::read_only;
  std::string text;  ///< one sentence
};

class WriteGate {
 public:
  /// Store and sink outlive it.
  WriteGate(const PointStore& store, CommandSink& sink) : store_(store), sink_(sink) {}

  /// Nothing: it is under way, and `done` will be called. Else nothing of it is sent.
  std::optional<WriteRefusal> Submit(const Writer& writer, WriteAsk ask, Instant now);
  /// Whether it would be refused, were it confirmed and asked for now. Nothing is sent or recorded.
  std::optional<WriteRefusal> WouldRefuse(const WriteAsk& ask, Instant now) const;
  /// The first of two steps.
  std::optional<WriteRefusal> Select(const Writer& writer, std::uint32_t device,
                                     std::uint32_t point, Instant now);
  /// It is refused by others, for that reason: recorded, and nothing else.
  void Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
            WriteEnd end = WriteEnd::denied);
  /// The client has left.
  void Forget(const Writer& writer) { selections_.Forget(writer.number); }

 private:
  std::optional<WriteRefusal> Check(const Writer& writer, const WriteAsk& ask, Instant now);
  std::optional<WriteRefusal> CheckValues(const WriteAsk& ask) const;
  std::optional<WriteRefusal> CheckInterlocks(const WriteAsk& ask, Instant now) const;
  void TakeAsMeant(WriteAsk& ask) const;
  std::optional<std::string> WhyNotSelected(const Writer& writer, const WriteAsk& ask, Instant now);

  const PointStore& store_;
  CommandSink& sink_;
  Selections selections_;
};

}  // namespace baudgate
