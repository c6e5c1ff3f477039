// SPDX-License-Identifier: Apache-2.0
#include "transports/tls_handshakes.h"

#include <openssl/err.h>
#include <openssl/x509v3.h>
#include <unistd.h>

#include <algorithm>
#include <asio/error.hpp>
#include <asio/ip/address.hpp>
#include <asio/posix/stream_descriptor.hpp>
#include <asio/post.hpp>
#include <asio/steady_timer.hpp>
#include <system_error>

#include "gateway/base/guarded.h"
#include "gateway/base/text.h"
#include "transports/loop_thread.h"

namespace baudgate::tls {

/// One handshake, which runs on the thread of the handshakes. The caller's ticket, and handlers on
/// that thread and on the caller's loop, keep the handshake alive.
struct Handshakes::Attempt : std::enable_shared_from_this<Attempt> {
  Attempt(asio::io_context& own, std::shared_ptr<ContextFiles> its_files, std::string its_peer,
          asio::io_context& io, Done its_done)
      : socket(own),
        deadline(own),
        files(std::move(its_files)),
        peer(std::move(its_peer)),
        caller(&io),
        done(std::move(its_done)) {}
  ~Attempt() {
    if (places) places->Give(HostNumberOf(peer));
  }

  void Start(const std::shared_ptr<FairPlaces>& shared);
  void Step();
  void Wait(asio::posix::stream_descriptor::wait_type which);
  void Finish();
  void Fail(std::string why) { Answer(Error{std::move(why)}); }
  void Answer(Result<std::unique_ptr<Channel>> result);
  std::string WhyNot(int error);

  asio::posix::stream_descriptor socket;
  asio::steady_timer deadline;
  const std::shared_ptr<ContextFiles> files;
  const std::string peer;
  std::unique_ptr<SSL, Freed<SSL_free>> ssl;
  std::shared_ptr<FairPlaces> places;  // null: the attempt has no place
  bool ended = false;

  Mutex mutex;
  // null: the caller does not wait any more
  asio::io_context* caller BAUDGATE_GUARDED_BY(mutex);
  Done done BAUDGATE_GUARDED_BY(mutex);
};

namespace {

/// The names of a server's certificate are checked during the handshake (RFC 6125; addresses by
/// iPAddress).
bool ExpectName(SSL* ssl, const std::string& name) {
  asio::error_code is_name;
  asio::ip::make_address(name, is_name);
  if (!is_name) return X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), name.c_str()) == 1;
  return SSL_set1_host(ssl, name.c_str()) == 1 && SSL_set_tlsext_host_name(ssl, name.c_str()) == 1;
}

Identity IdentityOf(SSL* ssl) {
  const Certificate certificate(SSL_get1_peer_certificate(ssl));
  if (!certificate) return {};
  constexpr std::size_t kLongestSubject = 120;  // of a text in logs and records
  Identity identity{.subject = WithoutControls(SubjectOf(certificate)),
                    .serial = SerialOf(certificate)};
  if (identity.subject.size() > kLongestSubject) {
    identity.subject.resize(kLongestSubject);
    identity.subject.resize(std::min(identity.subject.size(), FirstNotUtf8(identity.subject)));
  }
  auto role = RoleOf(*certificate);
  if (role) {
    identity.role = std::move(*role);
  } else {
    identity.trouble = role.error();
  }
  return identity;
}

}  // namespace

void Handshakes::Attempt::Start(const std::shared_ptr<FairPlaces>& shared) {
  const bool server = files->end() == End::server;
  if (server) {
    if (!shared->Take(HostNumberOf(peer), 1)) {
      return Fail("too many of its TLS handshakes are unfinished");
    }
    places = shared;
  }
  const auto context = files->Current();
  if (!context) return Fail(context.error());
  asio::error_code failed;
  socket.non_blocking(true, failed);
  ssl.reset(SSL_new((*context)->get()));
  if (failed || !ssl || SSL_set_fd(ssl.get(), socket.native_handle()) != 1 ||
      (!server && !ExpectName(ssl.get(), peer))) {
    ERR_clear_error();
    return Fail("there is not enough memory for TLS");
  }
  server ? SSL_set_accept_state(ssl.get()) : SSL_set_connect_state(ssl.get());
  deadline.expires_after(kDeadline);
  deadline.async_wait([self = shared_from_this()](const asio::error_code& error) {
    if (!error) self->Fail("it did not complete the TLS handshake within 10 s");
  });
  Step();
}

void Handshakes::Attempt::Step() {
  ERR_clear_error();
  errno = 0;
  const int result = SSL_do_handshake(ssl.get());
  if (result == 1) return Finish();
  switch (const int error = SSL_get_error(ssl.get(), result)) {
    case SSL_ERROR_WANT_READ:
      return Wait(asio::posix::stream_descriptor::wait_read);
    case SSL_ERROR_WANT_WRITE:
      return Wait(asio::posix::stream_descriptor::wait_write);
    default:
      Fail(WhyNot(error));
  }
}

void Handshakes::Attempt::Wait(asio::posix::stream_descriptor::wait_type which) {
  socket.async_wait(which, [self = shared_from_this()](const asio::error_code& failed) {
    if (self->ended) return;
    if (failed) return self->Fail("the connection is lost: " + failed.message());
    self->Step();
  });
}

std::string Handshakes::Attempt::WhyNot(int error) {
  const unsigned long code = ERR_peek_error();
  const int reason = ERR_GET_REASON(code);
  const long verified = SSL_get_verify_result(ssl.get());
  const char* const text = ERR_reason_error_string(code);
  const std::string said = text == nullptr ? "the connection was closed" : text;
  ERR_clear_error();
  if (verified == X509_V_ERR_HOSTNAME_MISMATCH || verified == X509_V_ERR_IP_ADDRESS_MISMATCH) {
    return "its certificate does not contain the name '" + peer +
           "'; call it by a name in its certificate, or renew the certificate with this name";
  }
  if (reason == SSL_R_CERTIFICATE_VERIFY_FAILED) {
    return std::string("its certificate is not valid: ") + X509_verify_cert_error_string(verified);
  }
  if (reason == SSL_R_PEER_DID_NOT_RETURN_A_CERTIFICATE) {
    return "it has sent no certificate";
  }
  if (reason == SSL_R_HTTP_REQUEST || reason == SSL_R_WRONG_VERSION_NUMBER) {
    return "it does not speak TLS";
  }
  if (error == SSL_ERROR_SYSCALL || code == 0 || reason == SSL_R_UNEXPECTED_EOF_WHILE_READING) {
    return "it closed the connection during the TLS handshake";
  }
  return "the TLS handshake failed: " + said;
}

void Handshakes::Attempt::Finish() {
  Identity peer_identity = IdentityOf(ssl.get());
  Answer(std::make_unique<Channel>(ssl.release(), socket.release(), std::move(peer_identity)));
}

void Handshakes::Attempt::Answer(Result<std::unique_ptr<Channel>> result) {
  if (std::exchange(ended, true)) return;
  deadline.cancel();
  asio::error_code ignored;
  socket.close(ignored);
  const MutexLock lock(mutex);
  if (caller == nullptr) return;
  // std::function needs a copy, which a Channel does not have.
  auto shared = std::make_shared<Result<std::unique_ptr<Channel>>>(std::move(result));
  asio::post(*caller, [self = shared_from_this(), shared] {
    Done call;
    {
      const MutexLock again(self->mutex);
      if (std::exchange(self->caller, nullptr) == nullptr) return;
      call = std::move(self->done);
    }
    call(std::move(*shared));
  });
}

void Handshakes::Ticket::Drop() {
  const std::shared_ptr<Attempt> attempt = std::exchange(attempt_, nullptr);
  if (!attempt) return;
  Done dropped;  // destroyed outside the lock, because it may own a ticket
  {
    const MutexLock lock(attempt->mutex);
    if (std::exchange(attempt->caller, nullptr) == nullptr) return;
    dropped.swap(attempt->done);
  }
  asio::post(attempt->socket.get_executor(), [attempt] { attempt->Fail("it was given up"); });
}

struct Handshakes::Loop {
  std::shared_ptr<FairPlaces> places = std::make_shared<FairPlaces>(kMost);
  transports::LoopThread thread{"tls"};
};

Handshakes::Handshakes() = default;
Handshakes::~Handshakes() = default;

Handshakes::Loop* Handshakes::Running() {
  const MutexLock lock(mutex_);
  if (loop_) return loop_.get();
  try {
    auto loop = std::make_unique<Loop>();
    loop->thread.Start();
    loop_ = std::move(loop);
  } catch (const std::system_error&) {
    return nullptr;
  }
  return loop_.get();
}

Handshakes::Ticket Handshakes::Begin(int owned, std::shared_ptr<ContextFiles> files,
                                     const std::string& peer, asio::io_context& io, Done done) {
  Loop* const loop = Running();
  auto attempt = std::make_shared<Attempt>(loop != nullptr ? loop->thread.io() : io,
                                           std::move(files), peer, io, std::move(done));
  Ticket ticket;
  ticket.attempt_ = attempt;
  if (loop == nullptr) {
    ::close(owned);
    attempt->Fail("the system has no threads or file descriptors left for TLS");
    return ticket;
  }
  asio::post(loop->thread.io(), [attempt, owned, places = loop->places] {
    asio::error_code failed;
    attempt->socket.assign(owned, failed);
    if (failed) {
      ::close(owned);
      return attempt->Fail("TLS cannot begin: " + failed.message());
    }
    attempt->Start(places);
  });
  return ticket;
}

Handshakes& Handshakes::OfProcess() {
  static Handshakes handshakes;
  return handshakes;
}

}  // namespace baudgate::tls
