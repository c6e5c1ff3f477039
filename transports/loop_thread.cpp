// SPDX-License-Identifier: Apache-2.0
#include "transports/loop_thread.h"

#include <pthread.h>
#include <sys/prctl.h>

#include <utility>

namespace baudgate::transports {

LoopThread::LoopThread(std::string name) : name_(std::move(name)) {}

void LoopThread::Start() {
  if (thread_.joinable()) return;
  thread_ = std::thread([this] { Run(); });
}

void LoopThread::Run() {
  pthread_setname_np(pthread_self(), name_.substr(0, 15).c_str());
  // The gaps between frames are a few milliseconds, so the default timer slack of 50 us would be
  // noticeable.
  prctl(PR_SET_TIMERSLACK, 1UL);
  io_.run();
}

void LoopThread::Stop(std::function<void()> last) {
  if (!thread_.joinable()) return;
  asio::post(io_, [this, last = std::move(last)] {
    if (last) last();
    io_.stop();
  });
  thread_.join();
}

}  // namespace baudgate::transports
