// Fuzzes a Modbus session over a socket pair, with TCP or RTU frames, delayed answers and delayed
// reads.
// Input: flags, then pieces: an action byte (see Step), a length byte and that many bytes.
// SPDX-License-Identifier: Apache-2.0
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <vector>

#include "gateway/base/log.h"
#include "gateway/outputs/modbus/server/client_session.h"
#include "protocols/modbus/protocol.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/modbus_world.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

class Gateway : private modbus::ClientSession::Owner {
 public:
  Gateway() {
    log::SetLeast(log::Level::error);
    Require(clients_->Open().ok(), "there is an epoll set");
    clients_->Start();
    shared_.inbox()->Open(io_, ReadClocks);
  }

  void Play(Input& input) {
    std::array<int, 2> pair{};
    const int kind = SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC;
    Require(::socketpair(AF_UNIX, kind, 0, pair.data()) == 0, "there is a socket pair");
    Configure(input.U8());
    sink_.turn = target_.turn = input.U8();
    closed_ = 0;
    auto session = std::make_shared<modbus::ClientSession>(
        modbus::Accepted{.socket = pair[0], .peer = "fuzz"}, *clients_, listener_, shared_,
        ReadClocks(), static_cast<modbus::ClientSession::Owner&>(*this));
    session->Start();
    Bytes sent;
    Bytes answers;
    for (int pieces = 0; pieces < 64 && !input.empty() && closed_ == 0; ++pieces) {
      Step(input, *session, pair[1], sent, answers);
    }
    io_.restart();
    io_.poll();
    Read(pair[1], answers);
    session->Close();
    Require(closed_ == 1, "closed once");
    sink_.kept.clear();
    for (const bus::RoutedRequest& request : target_.kept) {
      Require(request.client == 0, "who has left is forgotten");
    }
    target_.kept.clear();
    ::close(pair[1]);
    session.reset();
    io_.restart();
    io_.poll();
    if (speaks_rtu()) {
      CheckRtuAnswers(answers);
    } else {
      CheckAnswers(sent, answers);
    }
  }

 private:
  void OnClosed(modbus::ClientSession&) override { ++closed_; }
  void SweepAt(Instant) override {}

  /// Bits 0 and 1 of `flags`: permission; bit 2: RTU frames; bit 3: no exception replies; bit 4:
  /// broadcasts are routed.
  void Configure(std::uint8_t flags) {
    constexpr std::array kPermits = {config::Permit::all, config::Permit::read,
                                     config::Permit::data, config::Permit::all};
    listener_.permit = kPermits[flags % kPermits.size()];
    listener_.framing = (flags & 4U) != 0 ? modbus::Framing::rtu : modbus::Framing::tcp;
    listener_.errors =
        (flags & 8U) != 0 ? config::Listener::Errors::silent : config::Listener::Errors::exception;
    listener_.broadcast = (flags & 16U) != 0 ? config::Listener::Broadcast::pass
                                             : config::Listener::Broadcast::ignore;
  }
  bool speaks_rtu() const { return listener_.framing == modbus::Framing::rtu; }

  /// Takes one byte. Bit 0: the server runs its handlers; bit 1: the client reads; bit 2: a waiting
  /// write and a waiting routed request end; bit 3: time passes until deadlines are over; bit 4: a
  /// CRC is added to the piece of an RTU client.
  void Step(Input& input, modbus::ClientSession& session, int client, Bytes& sent, Bytes& answers) {
    const std::uint8_t what = input.U8();
    Bytes framed;
    View piece = input.TakeCounted();
    if (speaks_rtu() && (what & 16U) != 0 && piece.size() >= 2 && piece.size() <= 254) {
      framed = protocols::ModbusRtuProtocol().carrier->wrap(piece[0], piece.subspan(1));
      piece = framed;
    }
    const ssize_t count =
        piece.empty() ? 0 : ::send(client, piece.data(), piece.size(), MSG_NOSIGNAL);
    if (count > 0) Append(sent, piece.first(static_cast<std::size_t>(count)));
    if ((what & 4U) != 0 && !sink_.kept.empty()) {
      sink_.kept.front().done({static_cast<WriteEnd>((what >> 4U) % kWriteEnds)});
      sink_.kept.pop_front();
    }
    if ((what & 4U) != 0) target_.AnswerKept(static_cast<Outcome>((what >> 4U) % kOutcomeCount));
    if ((what & 8U) != 0) session.Sweep({ReadClocks().instant + 6s, {}});
    if ((what & 1U) != 0) {
      io_.restart();
      io_.poll();
    }
    if ((what & 2U) != 0) Read(client, answers);
  }

  static void Read(int client, Bytes& answers) {
    std::array<std::uint8_t, 4096> chunk;
    for (;;) {
      const ssize_t count = ::recv(client, chunk.data(), chunk.size(), 0);
      if (count <= 0) return;
      Append(answers, View(chunk).first(static_cast<std::size_t>(count)));
    }
  }

  static void CheckRtuAnswers(View answers) {
    while (!answers.empty()) {
      Require(answers.size() >= 5, "answers are whole");
      const std::uint8_t function = answers[1];
      std::size_t size = 7;
      if (function >= 0x80) {
        size = 5;
      } else if (function <= 4) {
        size = std::size_t{answers[2]} + 5;
      } else if (function == 5 || function == 6 || function == 15 || function == 16) {
        size = 8;
      }
      Require(answers.size() >= size, "answers are as long as they say");
      const Bytes again =
          protocols::ModbusRtuProtocol().carrier->wrap(answers[0], answers.subspan(1, size - 3));
      Require(std::ranges::equal(again, answers.first(size)), "answers have a good CRC");
      answers = answers.subspan(size);
    }
  }

  static void CheckAnswers(View sent, View answers) {
    std::vector<View> requests;
    const auto next = [](View& bytes) -> View {
      const auto length = ByteReader(bytes).U16Be(4);
      if (!length || bytes.size() < modbus::kMbapPrefix + *length) return {};
      const View frame = bytes.first(modbus::kMbapPrefix + *length);
      bytes = bytes.subspan(frame.size());
      return frame;
    };
    for (View frame = next(sent); frame.size() >= 8; frame = next(sent)) requests.push_back(frame);
    std::size_t count = 0;
    while (!answers.empty()) {
      const View answer = next(answers);
      Require(answer.size() >= 9, "answers are whole");
      const auto found = std::find_if(requests.begin(), requests.end(), [&](View request) {
        return std::equal(request.begin(), request.begin() + 2, answer.begin()) &&
               request[6] == answer[6] && (request[7] | 0x80U) == (answer[7] | 0x80U);
      });
      Require(found != requests.end(), "an answer belongs to a request");
      Require(++count <= requests.size(), "no more answers than requests");
    }
  }

  int closed_ = 0;
  asio::io_context io_;
  std::shared_ptr<modbus::ClientPoll> clients_ = std::make_shared<modbus::ClientPoll>(io_);
  config::Listener listener_;
  FuzzSink sink_;
  FuzzTarget target_;
  modbus::ServerShared shared_{ModbusConfig(),
                               FilledStore(),
                               sink_,
                               {},
                               {},
                               {{nullptr, &target_}, {&protocols::ModbusRtuProtocol()}}};
};

void FuzzModbusSession(View bytes) {
  static Gateway gateway;
  Input input(bytes);
  gateway.Play(input);
}

const Registered kModbusSession("modbus_session", FuzzModbusSession);

}  // namespace
}  // namespace baudgate::fuzz
