// Fuzzes a conversation with tasks and replies. The replies range from the valid replies of the
// simulated device to noise. Input: device, options, then steps. A step is a task and a reply (see
// RunTask and TakeReply).
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <memory>
#include <optional>

#include "gateway/bus/exchange/line.h"
#include "protocols/assembler.h"
#include "tests/fuzz/devices.h"
#include "tests/fuzz/stream.h"
#include "tests/fuzz/under_test.h"

namespace baudgate::fuzz {
namespace {

constexpr int kMostTasks = 8;

double NumberOf(std::uint8_t choice) {
  constexpr double kNumbers[] = {0,     1,     -1,  0.5,  7.25, 99.999, -12.5,  255,   1000,
                                 32767, 65536, 1e9, -1e9, 1e18, -1e18,  1e-300, 1e300, 3.4e38};
  return kNumbers[choice % std::size(kNumbers)];
}

Value ValueOf(config::Type type, std::uint8_t choice) {
  const double number = NumberOf(choice);
  if (type == config::Type::boolean) return (choice & 1U) != 0;
  if (type == config::Type::string) return std::string(choice % 8, static_cast<char>(choice));
  if (type == config::Type::float32 || type == config::Type::float64) return number;
  if (type == config::Type::uint64) return std::uint64_t{choice} << (choice % 57U);
  return static_cast<std::int64_t>(std::clamp(number, -9e18, 9e18));
}

class World final : public protocols::TwinValues {
 public:
  World(const config::Device& device, std::uint8_t seed) : device_(device), seed_(seed) {}

  Value Get(std::size_t point, Instant) const override {
    Require(point < device_.points.size(), "a twin asks for its own points");
    return ValueOf(device_.points[point].type, static_cast<std::uint8_t>(seed_ + point));
  }
  void Set(std::size_t point, const Value&) override {
    Require(point < device_.points.size(), "a twin sets its own points");
    ++seed_;
  }

 private:
  const config::Device& device_;
  std::uint8_t seed_;
};

class Session {
 public:
  Session(const config::Device& device, Input& input)
      : device_(device),
        input_(input),
        world_(device, input.U8()),
        twin_(UnderTest().make_twin(device, world_)),
        bus_(MakeBus(UnderTest())),
        conversation_(MakeConversation(UnderTest(), device, bus_.get())) {}

  void Run() {
    CheckQueries();
    for (int task = 0; task < kMostTasks && !input_.empty(); ++task) {
      RunTask();
      CheckQueries();
    }
  }

 private:
  void CheckQueries() const {
    for (const protocols::Query& query : conversation_->Queries()) {
      // `trouble` says that another device answers. Then only the identification is read, so a
      // query can have no points.
      Require(!query.points.empty() || conversation_->trouble(), "a query reads something");
      for (const std::size_t point : query.points) {
        Require(point < device_.points.size(), "a query reads points of its device");
      }
    }
  }

  /// Takes one byte. Its low 3 bits choose the task: 0…3 poll, 4 probe, 5 and 6 write, 7 reopen the
  /// port. The other bits are the time that passes before the task, in 500 ms. In a conversation
  /// that listens to unasked bytes, 0…2 receive such bytes.
  void RunTask() {
    const std::uint8_t head = input_.U8();
    now_ += (head >> 3U) * 500ms;
    if (const protocols::Standing* standing = conversation_->Listens();
        standing != nullptr && (head & 7U) < 3) {
      return Listen(*standing);
    }
    protocols::Task task;
    switch (head & 7U) {
      case 4:
        task.kind = protocols::Task::Kind::probe;
        break;
      case 5:
      case 6:
        task.kind = protocols::Task::Kind::write;
        task.point = input_.Below(device_.points.size());
        task.value = ValueOf(device_.points[task.point].type, input_.U8());
        break;
      case 7:
        conversation_->OnReconnect();
        return;
      default:
        task.query = input_.Below(conversation_->Queries().size());
        if (task.query >= conversation_->Queries().size()) return;
        break;
    }
    for (int step = 0; step < protocols::kMostSteps; ++step) {
      auto request = conversation_->Ask(task, now_);
      if (!request) {
        Require(!request.error().empty(), "a refused task has a reason");
        return;
      }
      if (Exchange(task, *request) != protocols::Then::ask_again) return;
    }
  }

  void Listen(const protocols::Standing& standing) {
    if (!ear_) {
      ear_.emplace(standing);
      ear_->Begin(now_);
    }
    const std::uint8_t head = input_.U8();
    Bytes bytes;
    if ((head & 1U) == 0) {
      twin_->Raise({.code = head, .text = std::to_string(head)}, NowBoth());
      bytes = twin_->Say(now_);
    } else {
      Append(bytes, input_.Take(head >> 1U));
    }
    Take(ear_->OnTimer(now_));
    Take(ear_->Feed(bytes, now_));
    if (const auto due = conversation_->DueAt(); due && *due <= now_) {
      CheckAnswer(conversation_->OnDue(NowBoth()), device_);
      const auto next = conversation_->DueAt();
      Require(!next || *next > now_, "what was due is done");
    }
  }

  void Take(const bus::UnaskedInput& heard) {
    for (const bus::UnaskedMessage& message : heard.messages) Hear(message.bytes);
  }
  void Hear(View message) {
    const protocols::Answer answer = conversation_->OnUnasked(message, NowBoth());
    CheckAnswer(answer, device_);
    Require(!answer.batch || !answer.batch->events.empty(), "a batch has events");
  }

  Now NowBoth() const { return {now_, WallTime(now_.time_since_epoch())}; }

  static bool IsWhole(View request, const config::Options& options) {
    const protocols::Cut cut = UnderTest().request_rule(
        request, UnderTest().expect({}, ParseOptions(UnderTest(), options)), true);
    return cut.kind == protocols::Cut::Kind::frame && cut.size == request.size();
  }

  config::Options OtherMode() const {
    config::Options options = device_.options;
    if (UnderTest().name == "dcon") options.Set("checksum", !options.Flag("checksum"));
    return options;
  }

  void CheckRequest(const protocols::Request& request) const {
    Require(!request.bytes.empty(), "a request has bytes");
    Require(IsWhole(request.bytes, device_.options) || IsWhole(request.bytes, OtherMode()),
            "a request is one whole frame of its protocol");
    for (const auto& [at, count] : request.expect.secrets) {
      Require(at <= request.bytes.size() && count <= request.bytes.size() - at,
              "secrets lie in the request");
    }
  }

  protocols::Then Exchange(const protocols::Task& task, protocols::Request request) {
    CheckRequest(request);
    now_ += 10ms;
    if (request.stamped) {
      const std::size_t size = request.bytes.size();
      conversation_->Stamp(request, NowBoth(), 1ms);
      Require(request.bytes.size() == size, "a stamp changes no length");
      CheckRequest(request);
    }
    if (request.expect.reply == protocols::Expectation::Reply::none) {
      return conversation_->OnSent(task, request, now_);
    }
    const Bytes reply = TakeReply(request);
    protocols::Assembler assembler;
    assembler.Begin(UnderTest().reply_rule, request.expect);
    assembler.Feed(reply);
    auto frame = assembler.Next(false);
    if (!frame) frame = assembler.Next(true);
    if (frame) {
      const protocols::Answer answer = conversation_->OnFrame(task, request, *frame, now_);
      CheckAnswer(answer, device_);
      if (request.expect.reply == protocols::Expectation::Reply::standing) Hear(*frame);
      if (ProvesLife(answer.outcome)) return answer.then;
      return Fail(task, request, answer.outcome);
    }
    return Fail(task, request,
                assembler.blame() == Outcome::none ? Outcome::no_reply : assembler.blame());
  }

  protocols::Then Fail(const protocols::Task& task, const protocols::Request& request,
                       Outcome outcome) {
    now_ += 1s;
    if (const auto instead = conversation_->Instead(request, outcome, now_)) CheckRequest(*instead);
    return conversation_->OnFailure(task, request, outcome, now_);
  }

  /// Takes one byte: 0 and 1 the simulated device's reply; 2 the simulated device's reply with
  /// edits and a new checksum; 3 with edits but the old checksum; 4 arbitrary bytes with a
  /// checksum; 5 without a checksum; 6 no reply; 7 the request itself.
  Bytes TakeReply(const protocols::Request& request) {
    const std::uint8_t head = input_.U8();
    const std::uint8_t kind = head & 7U;
    if (kind == 6) return {};
    if (kind == 7) return request.bytes;
    Bytes reply;
    if (kind >= 4) {
      Append(reply, input_.Take(head >> 3U));
      if (kind == 4) Seal(UnderTest(), reply, 0, request.expect.checksum);
      return reply;
    }
    reply = twin_->Answer(request.bytes, now_);
    if (kind < 2) return reply;
    if (kind == 2) Unseal(UnderTest(), reply, request.expect.checksum);
    for (int edits = head >> 5U; edits > 0 && !reply.empty(); --edits) {
      const std::size_t at = input_.Below(reply.size());
      reply[at] = input_.U8();
    }
    const std::size_t lost = (head & 8U) != 0 ? input_.Below(reply.size()) : 0;
    reply.resize(reply.size() - lost);
    if ((head & 16U) != 0) Append(reply, input_.Take(input_.Below(32)));
    if (kind == 2) Seal(UnderTest(), reply, 0, request.expect.checksum);
    return reply;
  }

  const config::Device& device_;
  Input& input_;
  World world_;
  std::unique_ptr<protocols::Twin> twin_;
  std::unique_ptr<protocols::Bus> bus_;
  std::unique_ptr<protocols::Conversation> conversation_;
  Instant now_{1h};
  std::optional<bus::UnaskedReceiver> ear_;
};

void FuzzConversation(View bytes) {
  Input input(bytes);
  const std::uint8_t slice = input.U8();
  const auto& device = DeviceOf(slice, input.U8());
  Session(device, input).Run();
}

const RegisteredFor kConversation(Protocols::with_conversations, "conversation_", "",
                                  FuzzConversation);

}  // namespace
}  // namespace baudgate::fuzz
