// Tests of `Worker` and `WorkThread`. A `Gate` lets the test decide when a call of the worker's
// function ends.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/worker.h"

#include <gmock/gmock.h>
#include <pthread.h>

#include <array>
#include <atomic>
#include <csignal>
#include <future>
#include <memory>
#include <mutex>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

namespace baudgate {
namespace {

using ::testing::ElementsAre;

class Gate {
 public:
  void Enter() {
    begun_.release();
    open_.acquire();
  }
  void AwaitBegun() { begun_.acquire(); }
  void Open() { open_.release(); }

 private:
  std::counting_semaphore<> begun_{0};
  std::counting_semaphore<> open_{0};
};

class Notes {
 public:
  void Add(std::string text) {
    const std::lock_guard lock(mutex_);
    all_.push_back(std::move(text));
  }
  std::vector<std::string> all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<std::string> all_;
};

TEST(Worker, RunsWhenStartedOrWokenAndOnceMoreAtItsEnd) {
  std::counting_semaphore<> rounds{0};
  Notes notes;
  Worker worker("test", [&](bool last) {
    notes.Add(last ? "last" : "round");
    rounds.release();
    return kWhenWoken;
  });
  worker.Start();
  rounds.acquire();
  worker.Wake();
  rounds.acquire();
  EXPECT_FALSE(worker.stopping());
  worker.Stop();
  worker.Stop();
  EXPECT_TRUE(worker.stopping());
  worker.Wake();  // has no effect: the thread has ended
  EXPECT_THAT(notes.all(), ElementsAre("round", "round", "last"));
}

TEST(Worker, RunsAgainAtTheReturnedTime) {
  std::counting_semaphore<> rounds{0};
  Worker worker("test", [&](bool) {
    rounds.release();
    return std::chrono::steady_clock::now() + 1ms;
  });
  worker.Start();
  for (int i = 0; i < 3; ++i) rounds.acquire();
}

TEST(Worker, WakeDuringARoundCausesOneMoreRound) {
  Gate gate;
  std::atomic<int> rounds = 0;
  Worker worker("test", [&](bool last) {
    if (last) return kWhenWoken;
    ++rounds;
    gate.Enter();
    return kWhenWoken;
  });
  worker.Start();
  gate.AwaitBegun();
  for (int i = 0; i < 100; ++i) worker.Wake();
  gate.Open();
  gate.AwaitBegun();
  gate.Open();
  worker.Stop();
  EXPECT_EQ(rounds, 2);
}

TEST(Worker, StopWaitsForWorkThatHangsAndRequestStopDoesNot) {
  Gate gate;
  Notes notes;
  Worker worker("test", [&](bool last) {
    if (!last) gate.Enter();
    notes.Add(last ? "last" : "round");
    return kWhenWoken;
  });
  worker.Start();
  gate.AwaitBegun();
  worker.RequestStop();
  EXPECT_TRUE(worker.stopping());
  auto stopped = std::async(std::launch::async, [&] { worker.Stop(); });
  EXPECT_EQ(stopped.wait_for(0s), std::future_status::timeout);
  EXPECT_THAT(notes.all(), ElementsAre());
  gate.Open();
  stopped.get();
  EXPECT_THAT(notes.all(), ElementsAre("round", "last"));
}

TEST(Worker, LeaveDoesNotWaitForAWorkerThatHangs) {
  struct Shared {
    Gate gate;
    std::promise<void> over;
  };
  const auto shared = std::make_shared<Shared>();
  {
    Worker worker("test", [shared](bool last) {
      if (!last) shared->gate.Enter();
      if (last) shared->over.set_value();
      return kWhenWoken;
    });
    worker.Start();
    shared->gate.AwaitBegun();
    worker.Leave();
  }
  shared->gate.Open();
  shared->over.get_future().get();
}

TEST(Worker, ItsThreadHasTheGivenNameAndBlocksSignals) {
  std::promise<std::pair<std::string, bool>> found;
  std::array<char, 16> name{};
  Worker worker("a name of 18 bytes", [&](bool last) {
    if (last) return kWhenWoken;
    pthread_getname_np(pthread_self(), name.data(), name.size());
    sigset_t blocked;
    pthread_sigmask(SIG_BLOCK, nullptr, &blocked);
    found.set_value({name.data(), sigismember(&blocked, SIGTERM) == 1});
    return kWhenWoken;
  });
  worker.Start();
  EXPECT_EQ(found.get_future().get(), (std::pair<std::string, bool>("a name of 18 by", true)));
  sigset_t own;
  pthread_sigmask(SIG_BLOCK, nullptr, &own);
  EXPECT_EQ(sigismember(&own, SIGTERM), 0) << "the thread that starts it takes them as before";
}

TEST(WorkThread, WorkersTakeTurns) {
  Notes notes;
  Gate busy_gate;
  std::counting_semaphore<> urgent_ran{0};
  WorkThread thread("test");
  Worker busy(thread, [&](bool last) {
    if (last) return kWhenWoken;
    busy_gate.Enter();
    notes.Add("busy");
    return Instant();  // a time in the past: the thread must call it again at once
  });
  busy.Start();
  busy_gate.AwaitBegun();
  Worker urgent(thread, [&](bool) {
    notes.Add("urgent");
    urgent_ran.release();
    return kWhenWoken;
  });
  urgent.Start();
  for (int i = 0; i < 2; ++i) {
    urgent.Wake();
    busy_gate.Open();
    urgent_ran.acquire();
    busy_gate.AwaitBegun();
  }
  EXPECT_THAT(notes.all(), ElementsAre("busy", "urgent", "busy", "urgent"));
  busy.RequestStop();
  busy_gate.Open();
}

TEST(WorkThread, AWorkerEndsAndTheOtherWorkersContinue) {
  std::counting_semaphore<> rounds{0};
  WorkThread thread("test");
  Worker stays(thread, [&](bool) {
    rounds.release();
    return kWhenWoken;
  });
  stays.Start();
  rounds.acquire();
  bool ended = false;
  {
    Worker ends(thread, [&](bool last) {
      ended = last;
      return kWhenWoken;
    });
    ends.Start();
  }
  EXPECT_TRUE(ended);
  stays.Wake();
  rounds.acquire();
}

TEST(WorkQueue, KeepsTheOrderAndCountsDroppedItems) {
  WorkQueue<int> queue(3);
  for (const int item : {1, 2, 3}) EXPECT_TRUE(queue.Put(int(item)));
  EXPECT_TRUE(queue.full());
  EXPECT_FALSE(queue.Put(4));
  EXPECT_FALSE(queue.Put(5));
  EXPECT_EQ(queue.Take(), 1);
  EXPECT_FALSE(queue.full());
  EXPECT_TRUE(queue.Put(6));
  EXPECT_EQ(queue.Take(), 2);
  EXPECT_EQ(queue.Take(), 3);
  EXPECT_EQ(queue.Take(), 6);
  EXPECT_EQ(queue.Take(), std::nullopt);
  EXPECT_EQ(queue.dropped(), 2U);
}

TEST(StartDetached, RunsTheWorkOnAnotherThread) {
  std::promise<std::thread::id> where;
  ASSERT_TRUE(StartDetached("test", [&] { where.set_value(std::this_thread::get_id()); }));
  EXPECT_NE(where.get_future().get(), std::this_thread::get_id());
}

}  // namespace
}  // namespace baudgate
