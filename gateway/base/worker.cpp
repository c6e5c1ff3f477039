// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/worker.h"

#include <pthread.h>

#include <algorithm>
#include <condition_variable>
#include <csignal>
#include <system_error>
#include <thread>
#include <vector>

namespace baudgate {
namespace {

/// Starts a thread with all signals blocked, because another thread waits for signals.
std::thread Start(const std::string& name, std::function<void()> work) {
  sigset_t all;
  sigset_t before;
  sigfillset(&all);
  pthread_sigmask(SIG_BLOCK, &all, &before);
  try {
    constexpr std::size_t kLongestName = 15;
    std::thread thread([name = name.substr(0, kLongestName), work = std::move(work)] {
      pthread_setname_np(pthread_self(), name.c_str());
      work();
    });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return thread;
  } catch (const std::system_error&) {
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    throw;
  }
}

}  // namespace

struct Worker::Job {
  explicit Job(Round its_round) : round(std::move(its_round)) {}

  const Round round;
  // WorkThread::State::mutex guards the members below.
  bool started = false;
  bool woken = true;
  bool stops = false;
  bool ended = false;
  Instant next = kWhenWoken;
};

struct WorkThread::State {
  using Job = Worker::Job;
  struct Turn {
    std::shared_ptr<Job> job;
    bool last = false;
  };

  explicit State(std::string its_name) : name(std::move(its_name)) {}

  static void Run(const std::shared_ptr<State>& state);
  /// Waits for the next round of a job. Returns nothing if the thread must end.
  std::optional<Turn> Await();
  std::optional<Turn> Next() BAUDGATE_REQUIRES(mutex);
  void OnRound(const Turn& turn, Instant next);

  static void Add(const std::shared_ptr<State>& state, const std::shared_ptr<Job>& job);
  void Wake(Job& job);
  void RequestStop(Job& job);
  void AwaitEnd(const Job& job);
  void End();

  const std::string name;
  Mutex mutex;
  std::condition_variable changed;
  std::condition_variable ended;  // wakes callers that wait for the last round of a job
  // The job that was run last is at the end.
  std::vector<std::shared_ptr<Job>> jobs BAUDGATE_GUARDED_BY(mutex);
  bool ends BAUDGATE_GUARDED_BY(mutex) = false;
  std::thread thread;
};

void WorkThread::State::Run(const std::shared_ptr<State>& state) {
  while (const auto turn = state->Await()) state->OnRound(*turn, turn->job->round(turn->last));
}

std::optional<WorkThread::State::Turn> WorkThread::State::Await() {
  MutexLock lock(mutex);
  for (;;) {
    if (auto turn = Next()) return turn;
    if (ends && jobs.empty()) return std::nullopt;
    Instant next = kWhenWoken;
    for (const std::shared_ptr<Job>& job : jobs) next = std::min(next, job->next);
    if (next == kWhenWoken) {
      lock.Wait(changed);
    } else {
      lock.WaitUntil(changed, next);
    }
  }
}

std::optional<WorkThread::State::Turn> WorkThread::State::Next() {
  const Instant now = std::chrono::steady_clock::now();
  const auto due = std::ranges::find_if(jobs, [now](const std::shared_ptr<Job>& job) {
    return job->woken || job->stops || job->next <= now;
  });
  if (due == jobs.end()) return std::nullopt;
  (*due)->woken = false;
  return Turn{*due, (*due)->stops};
}

/// Call after a round. Moves the job behind all others, so that they take turns.
void WorkThread::State::OnRound(const Turn& turn, Instant next) {
  const MutexLock lock(mutex);
  std::erase(jobs, turn.job);
  turn.job->next = next;
  turn.job->ended = turn.last;
  if (turn.last) {
    ended.notify_all();
  } else {
    jobs.push_back(turn.job);
  }
}

void WorkThread::State::Add(const std::shared_ptr<State>& state, const std::shared_ptr<Job>& job) {
  {
    const MutexLock lock(state->mutex);
    if (!state->thread.joinable()) state->thread = Start(state->name, [state] { Run(state); });
    state->jobs.push_back(job);
    job->started = true;
  }
  state->changed.notify_one();
}

void WorkThread::State::Wake(Job& job) {
  {
    const MutexLock lock(mutex);
    if (std::exchange(job.woken, true)) return;
  }
  changed.notify_one();
}

void WorkThread::State::RequestStop(Job& job) {
  {
    const MutexLock lock(mutex);
    job.stops = true;
  }
  changed.notify_one();
}

void WorkThread::State::AwaitEnd(const Job& job) {
  MutexLock lock(mutex);
  while (job.started && !job.ended) lock.Wait(ended);
}

void WorkThread::State::End() {
  {
    const MutexLock lock(mutex);
    ends = true;
  }
  changed.notify_one();
}

WorkThread::WorkThread(std::string name) : state_(std::make_shared<State>(std::move(name))) {}

WorkThread::~WorkThread() {
  if (!state_->thread.joinable()) return;
  state_->End();
  state_->thread.join();
}

Worker::Worker(std::string name, Round round)
    : own_(std::make_unique<WorkThread>(std::move(name))),
      state_(own_->state_),
      job_(std::make_shared<Job>(std::move(round))) {}

Worker::Worker(WorkThread& thread, Round round)
    : state_(thread.state_), job_(std::make_shared<Job>(std::move(round))) {}

void Worker::Start() { WorkThread::State::Add(state_, job_); }

void Worker::Wake() { state_->Wake(*job_); }

void Worker::RequestStop() { state_->RequestStop(*job_); }

void Worker::Stop() {
  if (left_) return;
  RequestStop();
  state_->AwaitEnd(*job_);
  own_.reset();
}

void Worker::Leave() {
  left_ = true;
  RequestStop();
  state_->End();
  if (state_->thread.joinable()) state_->thread.detach();
}

bool Worker::stopping() const {
  const MutexLock lock(state_->mutex);
  return job_->stops;
}

Status StartDetached(const std::string& name, std::function<void()> work) try {
  Start(name, std::move(work)).detach();
  return {};
} catch (const std::system_error& failed) {
  return Error{"the system cannot start another thread: " + failed.code().message() +
               "; raise TasksMax of the service (ulimit -u)"};
}

}  // namespace baudgate
