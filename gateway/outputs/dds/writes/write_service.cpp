// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/writes/write_service.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate::dds {
namespace {

// 2^53: above this number, a double cannot represent every whole number.
constexpr double kExactWhole = 9007199254740992;

bool CountsInWholes(config::Type type) {
  return type != config::Type::float32 && type != config::Type::float64;
}

}  // namespace

Result<Value> ValueOf(const config::Point& point, const RequestSample& request) {
  if (!request.text.empty() || point.type == config::Type::string) {
    return bus::ParseValue(point, request.text);
  }
  if (!std::isfinite(request.value)) {
    return Error{"'value' is not a number, and 'text' is empty; set one of them"};
  }
  if (!CountsInWholes(point.type)) return Value(request.value);
  if (std::abs(request.value) > kExactWhole) {
    return Error{
        "'value' is beyond 2^53, where not every whole number is exact; send the number in 'text'"};
  }
  const bool whole = std::trunc(request.value) == request.value;
  return bus::ParseValue(point, whole ? std::to_string(static_cast<std::int64_t>(request.value))
                                      : FormatNumber(request.value));
}

bus::RequestId IdOf(const RequestSample& request) {
  return {request.client, request.seq,
          fmt::format("{}\t{}\t{:a}\t{}\t{}", request.device, request.point, request.value,
                      request.text, request.confirm ? "confirm" : "")};
}

namespace {

constexpr char kLasting[] =
    "the client's DDS writer is not volatile, so old requests could be delivered; set its "
    "durability to volatile";

/// A not_after_ns that is farther ahead has no effect, because it is later than any deadline_ms.
/// The limit prevents that the addition below overflows.
constexpr Duration kMostAhead = 24h;

Duration PatienceOf(const RequestSample& request) {
  const Duration wanted = std::chrono::milliseconds(request.deadline_ms);
  return request.deadline_ms == 0 ? bus::kWaitForDevice
                                  : std::min(wanted, WriteService::kMostPatience);
}

/// Returns the earlier of deadline_ms and not_after_ns as a time of the steady clock. The
/// calculation cannot overflow, whatever the wall clock shows.
Instant DeadlineOf(const WriteArrival& arrival, Now now) {
  const RequestSample& request = arrival.request;
  const Instant deadline = arrival.received + PatienceOf(request);
  const std::int64_t wall = now.wall.time_since_epoch().count();
  if (request.not_after_ns == 0) return deadline;
  if (request.not_after_ns <= wall) return std::min(deadline, now.instant);
  if (request.not_after_ns / 2 - wall / 2 > kMostAhead.count()) return deadline;
  return std::min(deadline, now.instant + Duration(request.not_after_ns - wall));
}

std::uint32_t Microseconds(Duration duration) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(duration / 1us, 0, UINT32_MAX));
}

/// Returns why the request is too old or of unknown age; nothing: it is new enough. The check is
/// needed because the DDS library can deliver requests from before the start of this gateway. It
/// assumes that the client's clock is right.
std::optional<std::string> WhyTooOld(const WriteArrival& arrival, WallTime now) {
  constexpr char kAdvice[] =
      "; check the client's clock, and repeat the write with a new seq if it is still needed";
  if (arrival.published <= WallTime())
    return "it carries no time stamp, so its age is not known" + std::string(kAdvice);
  if (arrival.published - now > PatienceOf(arrival.request)) {
    return "its time stamp is " + FormatAge(arrival.published - now) +
           " ahead of this machine's clock, so its age is not known" + kAdvice;
  }
  const std::string age = FormatAge(std::max<Duration>(now - arrival.published, {}));
  if (arrival.early) {
    return "too old: by its time stamp it was published " + age +
           " ago, before this gateway listened for requests" + kAdvice;
  }
  if (now - arrival.published <= PatienceOf(arrival.request)) return std::nullopt;
  return "too old: by its time stamp it was published " + age +
         " ago, and its deadline has passed" + kAdvice;
}

Value Asked(const RequestSample& request) {
  if (!request.text.empty()) return request.text;
  if (!std::isfinite(request.value)) return FormatNumber(request.value);
  return request.value;
}

/// The number of the connection is 0: it only identifies who has selected a point, and DDS clients
/// select none.
bus::Writer WriterOf(const WriteArrival& arrival) { return {"dds:" + Text(arrival.writer), 0}; }

}  // namespace

WriteService::WriteService(const config::Config& config, const bus::PointStore& store,
                           bus::CommandSink& sink, bus::RequestBook::Past past, Answer answer,
                           Ended ended)
    : config_(config),
      store_(store),
      gate_(store, sink),
      answer_(std::move(answer)),
      ended_(std::move(ended)),
      book_(std::move(past)) {}

void WriteService::LearnDevices() {
  for (const std::uint32_t end = store_.device_count(); known_ < end; ++known_) {
    if (const auto device = store_.device(known_)) devices_[device->name] = known_;
  }
}

void WriteService::Take(const WriteArrival& arrival, Now now) {
  const RequestSample& request = arrival.request;
  if (request.gateway != config_.name) return;
  ++taken_;
  const Ticket ticket{request.client, request.seq, arrival.received};
  if (request.client.empty()) {
    return Reply(ticket,
                 {WriteEnd::denied, "'client' is empty; set it to the name of your client"});
  }
  if (arrival.lasting) {
    Record(arrival, kLasting);
    return Reply(ticket, {WriteEnd::denied, kLasting});
  }
  const bus::RequestBook::Verdict verdict = book_.Begin(IdOf(request), now.instant);
  switch (verdict.what) {
    case bus::RequestBook::Verdict::What::refused:
      if (verdict.answer.end == WriteEnd::denied) Record(arrival, verdict.answer.reason);
      return Reply(ticket, verdict.answer);
    case bus::RequestBook::Verdict::What::answered:
      return Reply(ticket, verdict.answer);
    case bus::RequestBook::Verdict::What::under_way:
      return;
    case bus::RequestBook::Verdict::What::fresh:
      break;
  }
  if (const auto answer = Carry(arrival, now)) {
    book_.End(ticket.client, ticket.seq, *answer);
    Reply(ticket, *answer);
  }
}

std::optional<bus::RequestAnswer> WriteService::Carry(const WriteArrival& arrival, Now now) {
  const RequestSample& request = arrival.request;
  const auto place = Find(request);
  if (!place) return bus::RequestAnswer{WriteEnd::denied, place.error()};
  if (auto why = WhyTooOld(arrival, now.wall)) {
    Record(arrival, *why);
    return bus::RequestAnswer{WriteEnd::denied, std::move(*why)};
  }
  auto value = ValueOf(place->config->points[place->point], request);
  if (!value) {
    Record(arrival, value.error());
    return bus::RequestAnswer{WriteEnd::denied, value.error()};
  }
  bus::WriteAsk ask;
  ask.device = place->device;
  ask.parts.push_back({place->point, std::move(*value)});
  ask.without_selection = request.confirm;
  ask.request = IdOf(request);
  ask.deadline = DeadlineOf(arrival, now);
  ask.done = [ended = ended_, ticket = Ticket{request.client, request.seq, arrival.received}](
                 const WriteResult& result) { ended(ticket, result); };
  const auto denial = gate_.Submit(WriterOf(arrival), std::move(ask), now.instant);
  if (!denial) return std::nullopt;
  using Why = bus::WriteDenial::Why;
  bus::RequestAnswer answer{denial->why == Why::busy ? WriteEnd::busy : WriteEnd::denied,
                            denial->text};
  if (denial->why == Why::not_selected) answer.reason += "; over DDS set 'confirm' instead";
  return answer;
}

void WriteService::Record(const WriteArrival& arrival, const std::string& reason) {
  const auto place = Find(arrival.request);
  if (!place) return;
  const RequestSample& request = arrival.request;
  bus::WriteAsk ask;
  ask.device = place->device;
  ask.parts.push_back({place->point, Asked(request)});
  ask.request = IdOf(request);
  gate_.Deny(WriterOf(arrival), ask, reason);
}

Result<WriteService::Place> WriteService::Find(const RequestSample& request) {
  LearnDevices();
  const auto device = devices_.find(request.device);
  if (device == devices_.end()) {
    return Error{Quoted(request.device) + " is no device of this gateway"};
  }
  const auto its = store_.device(device->second);
  if (!its || store_.gone(device->second)) {
    return Error{"a reload has removed " + Quoted(request.device) + ", or restarts its line"};
  }
  const auto point = std::ranges::find(its->points, request.point, &config::Point::name);
  if (point == its->points.end()) {
    return Error{Quoted(request.point) + " is no point of " + request.device};
  }
  return Place{device->second, static_cast<std::uint32_t>(point - its->points.begin()), its};
}

void WriteService::End(const Ticket& ticket, const WriteResult& result, Instant now) {
  const bus::RequestAnswer answer{result.end, result.reason, now - ticket.received};
  book_.End(ticket.client, ticket.seq, answer);
  Reply(ticket, answer);
}

void WriteService::Reply(const Ticket& ticket, const bus::RequestAnswer& answer) {
  ReplySample reply;
  reply.gateway = config_.name;
  reply.client = ticket.client;
  reply.seq = ticket.seq;
  AssignBounded(reply.outcome, Name(answer.end), kMaxOutcome);
  AssignBounded(reply.reason, Harmless(answer.reason), kMaxReason);
  reply.took_us = Microseconds(answer.took);
  answer_(std::move(reply));
}

namespace {

// If the socket to baudgate-dds is full, a reply is sent again after this pause.
constexpr Duration kReplyPause = 10ms;
// The most replies that wait; beyond this number the oldest reply is dropped, and its client
// repeats the request.
constexpr std::size_t kMostReplies = 1024;

}  // namespace

struct DdsWrites::Mail {
  struct End {
    WriteService::Ticket ticket;
    WriteResult result;
  };

  void Wake() {
    const MutexLock lock(mutex);
    if (worker != nullptr) worker->Wake();
  }
  /// Stores a result for the service's thread. The vector `ended` needs no limit, because
  /// RequestBook limits the number of requests in progress.
  void Add(WriteService::Ticket ticket, const WriteResult& result) {
    const MutexLock lock(mutex);
    if (worker == nullptr) return;
    ended.push_back({std::move(ticket), result});
    worker->Wake();
  }
  void SetWorker(Worker* its) {
    const MutexLock lock(mutex);
    worker = its;
  }
  std::vector<End> TakeEnded() {
    const MutexLock lock(mutex);
    return std::exchange(ended, {});
  }

  RequestIntake requests{[this] { Wake(); }};
  Mutex mutex;
  Worker* worker BAUDGATE_GUARDED_BY(mutex) = nullptr;  // null: the thread has stopped
  std::vector<End> ended BAUDGATE_GUARDED_BY(mutex);
  Mutex looking;  // locked while a request is handled
  bool taking BAUDGATE_GUARDED_BY(looking) = true;
};

DdsWrites::DdsWrites(const config::Config& config, const bus::PointStore& store,
                     bus::CommandSink& sink, bus::RequestBook::Past past,
                     std::shared_ptr<SampleWriter> writer)
    : writer_(std::move(writer)),
      mail_(std::make_shared<Mail>()),
      service_(
          config, store, sink, std::move(past),
          [this](ReplySample reply) { replies_.push_back(std::move(reply)); },
          [mail = mail_](WriteService::Ticket ticket, const WriteResult& result) {
            mail->Add(std::move(ticket), result);
          }),
      worker_("dds writes", [this](bool) { return Answer(); }) {
  mail_->SetWorker(&worker_);
  worker_.Start();
  writer_->OnRequest([mail = mail_](WriteArrival arrival) {
    mail->requests.Offer(std::move(arrival), ReadClocks().instant);
  });
}

DdsWrites::~DdsWrites() {
  StopTaking();
  Stop();
}

void DdsWrites::StopTaking() {
  writer_->OnRequest({});
  const MutexLock lock(mail_->looking);
  mail_->taking = false;
}

void DdsWrites::Stop() {
  worker_.Stop();
  mail_->SetWorker(nullptr);
}

std::uint64_t DdsWrites::dropped() const { return mail_->requests.dropped(); }

Instant DdsWrites::Answer() {
  for (const Mail::End& one : mail_->TakeEnded()) {
    service_.End(one.ticket, one.result, ReadClocks().instant);
  }
  while (const auto arrival = mail_->requests.Take()) {
    const MutexLock lock(mail_->looking);
    if (mail_->taking) service_.Take(*arrival, ReadClocks());
  }
  SendReplies();
  return replies_.empty() ? kWhenWoken : ReadClocks().instant + kReplyPause;
}

void DdsWrites::SendReplies() {
  while (!replies_.empty() && writer_->Write(replies_.front()) != Sent::later) {
    replies_.pop_front();
  }
  while (replies_.size() > kMostReplies) replies_.pop_front();
}

}  // namespace baudgate::dds
