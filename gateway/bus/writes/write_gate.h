// Every write to points passes here: from Modbus clients, the command line and DDS. Routed writes
// do not: only the listener's `permit` holds for them
// (gateway/outputs/modbus/service/client_requests.cpp). The rules, in this order, before anything
// is sent:
//
//   may the point be written?            read_only     rw in the profile and `write: allow`
//   may it have this value?              value         type, min, max, step
//   was it selected?                     not_selected  where `select: yes` stands
//   does another point forbid it?        locked        allow_when, min and max that name a point
//   and
//                                                      are not known (beyond them: value); checked
//                                                      again when it is sent
//   is there room in the line's queue?   busy
//
// That is the order of what is reported. A selection is taken before anything else, so it is used
// up by the first try, whatever becomes of it. A denial is handed to the sink, as is what another
// part denies or finds no room for (Deny). If the sink itself says busy, it has recorded that
// already (AuditedWrites). For one thread; each output has its own gate. docs/writes.md.
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
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/selections.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate {

/// A client: its name for the record, its number for selections.
struct Writer {
  std::string name;          ///< WriteCommand::client
  std::uint64_t number = 0;  ///< its connection
  /// True: it has left. Null: that is not known.
  std::shared_ptr<const std::atomic<bool>> left{};
};

struct WriteAsk {
  struct Part {
    std::uint32_t point = 0;  ///< index in the device's points
    Value value{};            ///< as users see it
  };
  std::uint32_t device = 0;  ///< index in the point store
  std::vector<Part> parts;
  bool without_selection = false;      ///< the client has said twice that it means it
  std::optional<RequestId> request{};  ///< see WriteCommand
  Instant deadline{};
  std::shared_ptr<const std::atomic<bool>> abandoned{};  ///< see WriteCommand
  std::function<void(const WriteResult&)> done{};
};

struct WriteDenial {
  enum class Why : std::uint8_t { read_only, value, not_selected, locked, busy };
  Why why = Why::read_only;
  std::string text;  ///< one sentence
};

class WriteGate {
 public:
  /// Store and sink outlive it.
  WriteGate(const PointStore& store, CommandSink& sink) : store_(store), sink_(sink) {}

  /// Empty: it is under way, and `done` will be called. Else nothing of it is sent.
  std::optional<WriteDenial> Submit(const Writer& writer, WriteAsk ask, Instant now);
  /// The denial that it would get now, even without a selection. Nothing is sent or recorded.
  std::optional<WriteDenial> WouldDeny(const WriteAsk& ask, Instant now) const;
  /// The first of the two steps of a point with `select: yes`.
  std::optional<WriteDenial> Select(const Writer& writer, std::uint32_t device, std::uint32_t point,
                                    Instant now);
  /// Another part has denied it, for this reason: it is only recorded.
  void Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
            WriteEnd end = WriteEnd::denied);
  /// The client has left.
  void Forget(const Writer& writer) { selections_.Forget(writer.number); }

 private:
  std::optional<WriteDenial> Check(const Writer& writer, const WriteAsk& ask, Instant now);
  std::optional<WriteDenial> CheckValues(const WriteAsk& ask) const;
  std::optional<WriteDenial> CheckInterlocks(const WriteAsk& ask, Instant now) const;
  void TakeAsMeant(WriteAsk& ask) const;
  std::optional<std::string> WhyNotSelected(const Writer& writer, const WriteAsk& ask, Instant now);

  const PointStore& store_;
  CommandSink& sink_;
  Selections selections_;
};

}  // namespace baudgate
