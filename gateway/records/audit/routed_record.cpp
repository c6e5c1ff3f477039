// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/routed_record.h"

#include <fmt/format.h>

#include <utility>

#include "gateway/bus/writes/write_state.h"
#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate::audit {
namespace {

constexpr std::size_t kMostValues = 16;
constexpr std::size_t kMaskSize = 7;          // function, address, AND, OR
constexpr std::size_t kReadWriteHeader = 10;  // function, what is read, what is written, byte count

unsigned WordAt(View pdu, std::size_t place) {
  return static_cast<unsigned>(pdu[place] << 8U | pdu[place + 1]);
}

std::string Range(std::string_view what, unsigned start, unsigned count) {
  if (count == 1) return fmt::format("{} {}", what, start);
  return fmt::format("{} {}-{}", what, start, start + count - 1);
}

/// One number, or all of them in a text.
template <typename ValueAt>
Value ValuesOf(unsigned count, ValueAt value_at) {
  if (count == 1) return std::int64_t{value_at(0)};
  std::string text;
  for (unsigned i = 0; i < count; ++i) {
    if (i == kMostValues) return text + fmt::format(" … ({})", count);
    text += fmt::format("{}{}", i == 0 ? "" : " ", value_at(i));
  }
  return text;
}

Value RegistersOf(View data, unsigned count) {
  return ValuesOf(count, [data](unsigned i) { return WordAt(data, std::size_t{2} * i); });
}

void FillPlain(const modbus::PlainRequest& plain, WriteRecord& record) {
  const bool bits = modbus::IsAboutBits(plain.function);
  record.point = fmt::format("{:02} {}", static_cast<unsigned>(plain.function),
                             Range(bits ? "coil" : "holding", plain.start, plain.count));
  if (plain.function == modbus::kWriteCoil) {
    record.value = std::int64_t{plain.data[0] != 0};
  } else if (bits) {
    record.value = ValuesOf(plain.count, [&](unsigned i) {
      return (static_cast<unsigned>(plain.data[i / 8]) >> (i % 8)) & 1U;
    });
  } else {
    record.value = RegistersOf(plain.data, plain.count);
  }
}

void FillReadWrite(View pdu, WriteRecord& record) {
  const unsigned start = WordAt(pdu, 5);
  const unsigned count = WordAt(pdu, 7);
  const View data = pdu.subspan(kReadWriteHeader);
  if (count == 0 || count > modbus::kMostWrittenRegisters ||
      data.size() != std::size_t{2} * count) {
    return;
  }
  record.point = "23 " + Range("holding", start, count);
  record.value = RegistersOf(data, count);
}

Ending EndingOf(const RoutedReply& reply, bool broadcast) {
  if (reply.outcome == Outcome::refused) {
    const std::string why =
        reply.pdu.size() < 2 ? std::string("refused") : modbus::ExceptionText(reply.pdu[1]);
    return {WriteEnd::refused, why};
  }
  if (reply.outcome == Outcome::ok && !broadcast) return {WriteEnd::ok, {}};
  if (broadcast && (reply.sent || reply.outcome == Outcome::ok)) {
    return {WriteEnd::unknown, "a broadcast is not answered"};
  }
  return {EndUnheard(reply.sent), reply.reason};
}

}  // namespace

WriteRecord RecordOf(const RoutedWrite& write) {
  WriteRecord record;
  record.kind = Kind::route;
  record.time = record.last = write.asked.wall;
  record.client = Clipped(write.client);
  record.line = Clipped(write.target);
  record.device = fmt::format("unit {}", write.unit);
  record.point = fmt::format("{:02}", write.pdu[0]);
  modbus::PlainRequest plain;
  if (modbus::IsPlainWrite(write.pdu[0])) {
    if (modbus::ParseRequest(write.pdu, plain) == modbus::kNoException) FillPlain(plain, record);
  } else if (write.pdu[0] == modbus::kMaskWrite && write.pdu.size() == kMaskSize) {
    record.point = fmt::format("22 holding {}", WordAt(write.pdu, 1));
    record.value = fmt::format("and {} or {}", WordAt(write.pdu, 3), WordAt(write.pdu, 5));
  } else if (write.pdu[0] == modbus::kReadWrite && write.pdu.size() > kReadWriteHeader) {
    FillReadWrite(write.pdu, record);
  }
  return record;
}

Witness::Witness(WriteLog& log, const RoutedWrite& write)
    : log_(log),
      record_(RecordOf(write)),
      asked_(write.asked.instant),
      broadcast_(write.broadcast) {}

Witness::~Witness() {
  if (!told_) Tell({WriteEnd::unknown, "its result never became known"});
}

Witness::Done Witness::Watch(std::shared_ptr<Witness> witness, Done done) {
  return [witness = std::move(witness), done = std::move(done)](RoutedReply reply) {
    witness->Tell(EndingOf(reply, witness->broadcast_));
    done(std::move(reply));
  };
}

void Witness::Deny(WriteEnd end, const std::string& reason) {
  record_.kind = Kind::denied;
  Tell({end, reason});
}

void Witness::Tell(const Ending& ending) {
  told_ = true;
  record_.end = ending.end;
  record_.reason = Clipped(ending.reason);
  log_.Note(record_, asked_);
}

}  // namespace baudgate::audit
