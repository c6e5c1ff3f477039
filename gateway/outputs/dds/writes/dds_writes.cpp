// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/writes/dds_writes.h"

#include <utility>
#include <vector>

#include "gateway/base/guarded.h"

namespace baudgate::dds {
namespace {

constexpr Duration kReplyPause = 10ms;  // until one that found no room is tried again
// Replies that wait for room. Beyond it the oldest is gone: its client asks again.
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
  /// Those of one client, and so all, are bounded by the service's book.
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
  Worker* worker BAUDGATE_GUARDED_BY(mutex) = nullptr;  // null: it has stopped
  std::vector<End> ended BAUDGATE_GUARDED_BY(mutex);
  Mutex looking;  // held while a request is looked at
  bool taking BAUDGATE_GUARDED_BY(looking) = true;
};

DdsWrites::DdsWrites(const config::Config& config, const PointStore& store, CommandSink& sink,
                     RequestBook::Past past, std::shared_ptr<SampleWriter> writer)
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
