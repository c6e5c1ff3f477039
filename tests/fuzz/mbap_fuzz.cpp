// Fuzzes the Modbus server without sockets.
// Input: an unused byte, then pieces: a length byte and that many bytes.
// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include "gateway/outputs/modbus/service/own_units.h"
#include "gateway/outputs/modbus/wire/request.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/modbus_world.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

using modbus::ExceptionCode;
using modbus::MbapAssembler;

modbus::OwnUnits& TheUnits(FuzzSink*& sink) {
  static FuzzSink the_sink;
  static modbus::ServerShared shared(ModbusConfig(), FilledStore(), the_sink, {}, {});
  modbus::OwnUnits& units = shared.units();
  Require(units.responder().ready().ok(), "libmodbus is there");
  sink = &the_sink;
  return units;
}

std::size_t DataOf(const modbus::ModbusRequest& request) {
  switch (request.function) {
    case modbus::kWriteCoil:
    case modbus::kWriteRegister:
      return 2;
    case modbus::kWriteCoils:
      return (std::size_t{request.count} + 7) / 8;
    case modbus::kWriteRegisters:
      return std::size_t{request.count} * 2;
    default:
      return 0;
  }
}

void AnswerFrame(modbus::OwnUnits& units, View frame) {
  modbus::ModbusRequest request;
  ExceptionCode exception = units.Check(frame, request);
  if (exception == modbus::kNoException) {
    Require(request.count > 0 && request.start + request.count <= 0x10000, "a checked range");
    Require(request.frame.data() == frame.data(), "a request views its frame");
    Require(request.data.size() == DataOf(request), "a write carries the values that it counts");
    if (modbus::IsPlainWrite(modbus::FunctionOf(frame))) {
      WriteResult ended;
      exception = units.Write(request, {{"192.0.2.5:40312", 1}, ModbusNow() + 5s, nullptr},
                              ModbusNow(), [&ended](const WriteResult& result) { ended = result; });
      if (exception == modbus::kNoException) exception = modbus::ExceptionOf(ended);
    } else {
      const auto holes = frame.size() % 2 == 0 ? modbus::Holes::off : modbus::Holes::zero;
      exception = units.Read(request, holes, ModbusNow());
    }
  }
  if (exception != modbus::kNoException) {
    CheckModbusAnswer(frame, modbus::ExceptionReply(frame, exception));
    return;
  }
  Bytes answer;
  if (modbus::IsPlainWrite(modbus::FunctionOf(frame))) {
    answer = modbus::AduOf(modbus::TransactionOf(frame), modbus::UnitOf(frame),
                           modbus::PduOf(frame).first(modbus::kWriteReply));
  } else {
    units.responder().Append(request, answer);
  }
  CheckModbusAnswer(frame, answer);
}

void Receive(Input& input) {
  FuzzSink* sink = nullptr;
  modbus::OwnUnits& units = TheUnits(sink);
  sink->turn = input.U8();
  MbapAssembler assembler;
  std::size_t in = 0;
  std::size_t out = 0;
  while (!input.empty()) {
    const auto space = assembler.Space();
    const View piece = input.Take(std::min<std::size_t>(input.U8(), space.size()));
    std::copy(piece.begin(), piece.end(), space.begin());
    assembler.Commit(piece.size());
    in += piece.size();
    View frame;
    for (;;) {
      const auto said = assembler.Peek();
      const auto state = assembler.Take(frame);
      Require(said == state, "Peek says what Take does");
      Require((state == MbapAssembler::State::malformed) == !assembler.Defect().empty() ||
                  state == MbapAssembler::State::frame,
              "a defect has a reason");
      if (state == MbapAssembler::State::malformed) return;
      if (state == MbapAssembler::State::need_more) break;
      out += frame.size();
      Require(out <= in, "no frame is longer than what came");
      Require(frame.size() >= 8 && frame.size() <= modbus::kMaxAdu, "a frame has its length");
      const Bytes copy(frame.begin(), frame.end());
      AnswerFrame(units, copy);
    }
    Require(!assembler.Space().empty(), "there is room for what is missing");
  }
  sink->kept.clear();
}

void FuzzMbap(View bytes) {
  Input input(bytes);
  input.U8();  // skipped, because inputs of the corpus begin with an unused byte
  Receive(input);
}

const Registered kMbap("mbap", FuzzMbap);

}  // namespace
}  // namespace baudgate::fuzz
