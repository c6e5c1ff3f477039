// Hosts wait in one queue for threads, which end when they find nothing to do.
// SPDX-License-Identifier: Apache-2.0
#include "transports/host_names.h"

#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <cerrno>
#include <cstring>
#include <deque>
#include <map>
#include <utility>

#include "gateway/base/worker.h"

namespace baudgate {
namespace {

Result<HostNames::Addresses> AskSystem(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), nullptr, &hints, &found);
  if (failed != 0) return Error{failed == EAI_SYSTEM ? std::strerror(errno) : gai_strerror(failed)};
  HostNames::Addresses addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    asio::ip::tcp::endpoint endpoint;
    if (one->ai_addrlen > endpoint.capacity()) continue;
    std::memcpy(endpoint.data(), one->ai_addr, one->ai_addrlen);
    addresses.push_back(endpoint.address());
  }
  freeaddrinfo(found);
  return addresses;
}

}  // namespace

struct HostNames::Waiter {
  Waiter(asio::io_context& its_io, Done its_done) : io(&its_io), done(std::move(its_done)) {}
  Mutex mutex;
  asio::io_context* io BAUDGATE_GUARDED_BY(mutex);  // null: waits no more
  Done done BAUDGATE_GUARDED_BY(mutex);
};

struct HostNames::State {
  struct Host {
    std::vector<std::shared_ptr<Waiter>> waiters;
    bool running = false;
    bool given_up = false;  // nobody had the patience for a look-up, and none was of use since
  };

  explicit State(LookUp its_look_up) : look_up(std::move(its_look_up)) {}

  bool MayBegin(const Host& host) const BAUDGATE_REQUIRES(mutex) {
    if (threads >= kMostAwaited + kMostHanging) return false;
    return host.given_up ? hanging < kMostRetried : threads - hanging < kMostAwaited;
  }

  const LookUp look_up;
  Mutex mutex;
  std::map<std::string, Host> hosts BAUDGATE_GUARDED_BY(mutex);
  std::deque<std::string> queue BAUDGATE_GUARDED_BY(mutex);
  std::size_t threads BAUDGATE_GUARDED_BY(mutex) = 0;
  // Threads of these in look-ups of hosts that are given up.
  std::size_t hanging BAUDGATE_GUARDED_BY(mutex) = 0;

  static void Begin(const std::shared_ptr<State>& state) BAUDGATE_REQUIRES(state->mutex);
  static void Run(const std::shared_ptr<State>& state, const std::string& name);
  static void Drop(const std::shared_ptr<State>& state, const std::string& name,
                   const std::shared_ptr<Waiter>& waiter);
  static void Answer(const std::shared_ptr<Waiter>& waiter, const Result<Addresses>& found);
};

/// Threads for what may be looked up now.
void HostNames::State::Begin(const std::shared_ptr<State>& state) {
  for (auto at = state->queue.begin(); at != state->queue.end();) {
    Host& host = state->hosts[*at];
    if (!state->MayBegin(host)) {
      ++at;
      continue;
    }
    // Without a thread the next question or answer tries again.
    if (!StartDetached("host names", [state, name = *at] { Run(state, name); })) return;
    ++state->threads;
    if (host.given_up) ++state->hanging;
    host.running = true;
    at = state->queue.erase(at);
  }
}

void HostNames::State::Run(const std::shared_ptr<State>& state, const std::string& name) {
  const Result<Addresses> found = state->look_up(name);
  std::vector<std::shared_ptr<Waiter>> waiters;
  {
    const MutexLock lock(state->mutex);
    Host& host = state->hosts[name];
    if (host.given_up) --state->hanging;
    --state->threads;
    host.running = false;
    waiters.swap(host.waiters);
    if (found && !waiters.empty()) host.given_up = false;
    Begin(state);
  }
  for (const auto& waiter : waiters) Answer(waiter, found);
}

void HostNames::State::Answer(const std::shared_ptr<Waiter>& waiter,
                              const Result<Addresses>& found) {
  const MutexLock lock(waiter->mutex);
  if (waiter->io == nullptr) return;
  asio::post(*waiter->io, [waiter, found] {
    Done done;
    {
      const MutexLock again(waiter->mutex);
      if (std::exchange(waiter->io, nullptr) == nullptr) return;
      done = std::move(waiter->done);
    }
    done(found);
  });
}

void HostNames::State::Drop(const std::shared_ptr<State>& state, const std::string& name,
                            const std::shared_ptr<Waiter>& waiter) {
  Done dropped;  // destroyed outside the locks: it may own the ticket's owner
  {
    const MutexLock lock(waiter->mutex);
    waiter->io = nullptr;
    dropped.swap(waiter->done);
  }
  const MutexLock lock(state->mutex);
  Host& host = state->hosts[name];
  if (std::erase(host.waiters, waiter) == 0 || !host.waiters.empty()) return;
  if (!host.running) {
    std::erase(state->queue, name);
  } else if (!std::exchange(host.given_up, true)) {
    ++state->hanging;
    Begin(state);
  }
}

HostNames::Ticket& HostNames::Ticket::operator=(Ticket&& other) noexcept {
  if (this != &other) {
    Drop();
    drop_ = std::exchange(other.drop_, nullptr);
  }
  return *this;
}

void HostNames::Ticket::Drop() {
  if (const auto drop = std::exchange(drop_, nullptr)) drop();
}

HostNames::HostNames(LookUp look_up) : state_(std::make_shared<State>(std::move(look_up))) {}

HostNames::Ticket HostNames::Ask(const std::string& host, asio::io_context& io, Done done) {
  auto waiter = std::make_shared<Waiter>(io, std::move(done));
  Ticket ticket;
  ticket.drop_ = [state = state_, host, waiter] { State::Drop(state, host, waiter); };
  const MutexLock lock(state_->mutex);
  State::Host& asked = state_->hosts[host];
  asked.waiters.push_back(std::move(waiter));
  if (!asked.running && asked.waiters.size() == 1) state_->queue.push_back(host);
  State::Begin(state_);
  return ticket;
}

HostNames& HostNames::OfProcess() {
  static HostNames names(AskSystem);
  return names;
}

}  // namespace baudgate
