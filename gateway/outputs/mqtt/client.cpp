// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/mqtt/client.h"

#include <mqtt_protocol.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/secret_file.h"
#include "gateway/base/shown.h"
#include "transports/tls_files.h"

// libmosquitto 2.0.11 calls assert() when a broker sends a property that MQTT 5 does not define: it
// logs the property without a client (property__read, log__printf), which would end the gateway and
// all its lines. `ReadPackets` returns in place of this assert. Only C functions of the library,
// which hold no lock, are on the stack between the two.
namespace {
constexpr char kAsserting[] = "logging_mosq.c";
thread_local std::jmp_buf* way_out = nullptr;
}  // namespace

// The program's function takes precedence over that of the C library.
// NOLINTNEXTLINE(bugprone-reserved-identifier)
extern "C" [[noreturn]] __attribute__((visibility("default"))) void __assert_fail(
    const char* what, const char* file, unsigned line, const char* function) noexcept {
  if (way_out != nullptr && std::strstr(file, kAsserting) != nullptr) std::longjmp(*way_out, 1);
  std::fprintf(stderr, "%s:%u: %s: Assertion `%s' failed.\n", file, line, function, what);
  std::abort();
}

namespace baudgate::mqtt {
namespace {

/// The most messages that wait for a confirmation at once, unless the broker wants fewer.
constexpr int kMostInFlight = 200;
constexpr int kPacketsAtOnce = 1000;
constexpr std::size_t kLongestError = 300;
constexpr unsigned kFirstError = 0x80;  // reason codes of MQTT 5 from here on are errors

/// Prepares libmosquitto once in the process.
void PrepareLibrary() {
  static const int prepared = mosquitto_lib_init();
  static_cast<void>(prepared);
}

Delivery::Kind KindOf(int code) {
  switch (code) {
    case MQTT_RC_NOT_AUTHORIZED:
      return Delivery::Kind::denied;
    case MQTT_RC_TOPIC_NAME_INVALID:
    case MQTT_RC_PAYLOAD_FORMAT_INVALID:
    case MQTT_RC_PACKET_TOO_LARGE:
      return Delivery::Kind::refused;
    default:
      return Delivery::Kind::retry;
  }
}

/// Reads what has arrived. Returns a code of libmosquitto.
int ReadPackets(mosquitto* its) {
  std::jmp_buf here;
  if (setjmp(here) != 0) {
    way_out = nullptr;
    return MOSQ_ERR_MALFORMED_PACKET;
  }
  way_out = &here;
  const int code = mosquitto_loop_read(its, kPacketsAtOnce);
  way_out = nullptr;
  return code;
}

std::string ReasonOf(int code) {
  switch (code) {
    case MQTT_RC_NOT_AUTHORIZED:
      return "its access rules do not permit it";
    case MQTT_RC_TOPIC_NAME_INVALID:
      return "it does not accept the topic";
    default:
      return Harmless(mosquitto_reason_string(code));
  }
}

}  // namespace

/// The functions that libmosquitto calls, on the thread that calls Run.
struct Client::Callbacks {
  static Client& Of(void* self) { return *static_cast<Client*>(self); }

  static void Connected(mosquitto*, void* self, int code, int, const mosquitto_property*) {
    Client& client = Of(self);
    if (code == 0) {
      client.accepted_ = true;
    } else if (code == MQTT_RC_UNSUPPORTED_PROTOCOL_VERSION || code == 1) {
      client.ended_ = "does not speak MQTT 5";
    } else if (code == MQTT_RC_NOT_AUTHORIZED || code == MQTT_RC_BAD_USERNAME_OR_PASSWORD ||
               code == 4 || code == 5) {
      client.ended_ =
          "refuses the connection: user or password is wrong, or the user may not "
          "connect";
    } else {
      client.ended_ = "refuses the connection: " + Harmless(mosquitto_reason_string(code));
    }
  }
  static void Ended(mosquitto*, void* self, int code, const mosquitto_property*) {
    Client& client = Of(self);
    if (client.ended_) return;
    if (code == MQTT_RC_SESSION_TAKEN_OVER) {
      client.ended_ = "has ended the connection, because another client connects with the id '" +
                      client.settings_.client + "'; give each gateway its own client";
    } else {
      client.ended_ = client.Explain(code);
    }
  }
  static void Published(mosquitto*, void* self, int number, int code, const mosquitto_property*) {
    Client& client = Of(self);
    const auto found = client.waiting_.find(number);
    if (found == client.waiting_.end()) return;
    const Delivered delivered = std::move(found->second);
    client.waiting_.erase(found);
    client.confirmed_at_ = ReadClocks().instant;
    if (!delivered) return;
    if (static_cast<unsigned>(code) < kFirstError) return delivered({});
    delivered({KindOf(code), ReasonOf(code), true});
  }
  static void Subscribed(mosquitto*, void* self, int number, int count, const int* codes,
                         const mosquitto_property*) {
    Client& client = Of(self);
    const auto found = client.subscriptions_.find(number);
    if (found == client.subscriptions_.end()) return;
    const std::string filter = std::move(found->second);
    client.subscriptions_.erase(found);
    if (count > 0 && static_cast<unsigned>(codes[0]) >= kFirstError) {
      client.handler_.refused("a subscription of " + filter, ReasonOf(codes[0]));
    }
  }
  static void Received(mosquitto*, void* self, const mosquitto_message* message,
                       const mosquitto_property*) {
    if (message->topic == nullptr) return;
    Message copy{message->topic, {}, message->retain};
    if (message->payload != nullptr) {
      copy.payload.assign(static_cast<const char*>(message->payload),
                          static_cast<std::size_t>(message->payloadlen));
    }
    Of(self).handler_.message(copy);
  }
  static void Logged(mosquitto*, void* self, int level, const char* text) {
    Client& client = Of(self);
    if (level == MOSQ_LOG_ERR && client.tls_error_.size() < kLongestError) {
      client.tls_error_ += (client.tls_error_.empty() ? "" : "; ") + Harmless(text);
    }
  }
};

Client::Client(const config::Mqtt& settings, Handler handler, Duration patience)
    : settings_(settings),
      handler_(std::move(handler)),
      patience_(patience),
      wake_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
      pause_(patience / 10) {
  PrepareLibrary();
}

Client::~Client() {
  its_.reset();
  if (wake_ >= 0) ::close(wake_);
}

void Client::Wake() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof(one));
}

std::string Client::Explain(int code) const {
  if (!tls_error_.empty()) {
    if (tls_error_.find("host name verification") != std::string::npos) {
      return "has a certificate for another name than " + broker().at.host;
    }
    if (tls_error_.find("certificate verify failed") != std::string::npos) {
      return "has a certificate that the authority of " + settings_.tls.authorities +
             " has not issued, or that has ended";
    }
    if (tls_error_.find("alert") != std::string::npos) {
      return "refuses the gateway's certificate, or wants one (" + tls_error_ + ")";
    }
    return "does not complete TLS (" + tls_error_ + ")";
  }
  if (code == MOSQ_ERR_MALFORMED_PACKET || code == MOSQ_ERR_PROTOCOL) {
    return "sends bytes that are not MQTT 5";
  }
  if (code == MOSQ_ERR_KEEPALIVE) return "has not answered for " + FormatAge(kKeepAlive * 1s);
  if (phase_ == Phase::connecting) return "has closed the connection without an answer";
  if (code > 0 && static_cast<unsigned>(code) >= kFirstError) {
    return "has ended the connection: " + ReasonOf(code);
  }
  return "has closed the connection";
}

std::string Client::Prepare() {
  its_.reset(mosquitto_new(settings_.client.c_str(), true, this));
  if (!its_) return "cannot be called: " + std::string(std::strerror(errno));
  mosquitto* const its = its_.get();
  mosquitto_int_option(its, MOSQ_OPT_PROTOCOL_VERSION, MQTT_PROTOCOL_V5);
  mosquitto_int_option(its, MOSQ_OPT_SEND_MAXIMUM, kMostInFlight);
  mosquitto_int_option(its, MOSQ_OPT_TCP_NODELAY, 1);
  mosquitto_connect_v5_callback_set(its, &Callbacks::Connected);
  mosquitto_disconnect_v5_callback_set(its, &Callbacks::Ended);
  mosquitto_publish_v5_callback_set(its, &Callbacks::Published);
  mosquitto_message_v5_callback_set(its, &Callbacks::Received);
  mosquitto_subscribe_v5_callback_set(its, &Callbacks::Subscribed);
  mosquitto_log_callback_set(its, &Callbacks::Logged);
  const Will will = handler_.will();
  mosquitto_will_set(its, will.topic.c_str(), static_cast<int>(will.payload.size()),
                     will.payload.data(), 1, will.retained);
  if (!settings_.user.empty()) {
    std::string password;
    if (!settings_.password_file.empty()) {
      auto read = ReadSecretFile("the password file", settings_.password_file);
      if (!read) return "cannot be called: " + read.error();
      password = std::move(*read);
    }
    mosquitto_username_pw_set(its, settings_.user.c_str(), password.c_str());
  }
  if (!broker().tls) return {};
  const config::TlsFiles& files = settings_.tls;
  if (const auto tls = tls::ReadTls(files); !tls) return "cannot be called: " + tls.error();
  const auto path = [](const std::string& file) { return file.empty() ? nullptr : file.c_str(); };
  const int code = mosquitto_tls_set(its, path(files.authorities), nullptr, path(files.certificate),
                                     path(files.key), nullptr);
  if (code != MOSQ_ERR_SUCCESS) {
    return std::string("cannot be called: ") + mosquitto_strerror(code);
  }
  return {};
}

void Client::Connect(Instant now) {
  tls_error_.clear();
  ended_.reset();
  accepted_ = false;
  if (const std::string why = Prepare(); !why.empty()) return Lose(why);
  phase_ = Phase::connecting;
  due_ = now + patience_;
  blocked_ = true;
  const int code =
      mosquitto_connect_async(its_.get(), broker().at.host.c_str(), broker().at.port, kKeepAlive);
  const int error = errno;
  blocked_ = false;
  if (code == MOSQ_ERR_SUCCESS) return;
  if (code == MOSQ_ERR_EAI) {
    Lose("cannot be found: the name service does not know " + broker().at.host);
  } else if (!tls_error_.empty()) {
    Lose(Explain(code));
  } else {
    Lose(std::string("cannot be reached: ") +
         (code == MOSQ_ERR_ERRNO ? std::strerror(error) : mosquitto_strerror(code)));
  }
}

void Client::Lose(const std::string& why) {
  const bool was_connected = phase_ == Phase::connected;
  if (was_connected) ++times_lost_;
  const std::string trouble = "the broker " + broker().Address() + " " + why;
  if (trouble != trouble_) log::Warn("mqtt: {}", trouble);
  trouble_ = trouble;
  Drop();
  broker_ = (broker_ + 1) % settings_.brokers.size();
  std::uniform_real_distribution<double> spread(0.75, 1.25);
  due_ = ReadClocks().instant + std::chrono::duration_cast<Duration>(pause_ * spread(random_));
  // All brokers of the list are tried before the pause gets longer.
  if (broker_ == 0) pause_ = std::min(pause_ * 2, patience_ * 6);
}

void Client::Drop() {
  const bool was_connected = phase_ == Phase::connected;
  phase_ = Phase::waiting;
  its_.reset();
  subscriptions_.clear();
  const auto waiting = std::exchange(waiting_, {});
  for (const auto& [number, delivered] : waiting) {
    if (delivered) delivered({Delivery::Kind::retry, "the connection to the broker has ended"});
  }
  if (was_connected) handler_.lost();
}

void Client::Close() {
  if (its_ && phase_ == Phase::connected) {
    mosquitto_disconnect_v5(its_.get(), MQTT_RC_DISCONNECT_WITH_WILL_MSG, nullptr);
    mosquitto_loop_write(its_.get(), kPacketsAtOnce);
  }
  Drop();
  due_ = Instant::max();
}

void Client::Run(Instant until) {
  for (;;) {
    const Instant now = ReadClocks().instant;
    if (phase_ == Phase::waiting && now >= due_) Connect(now);
    Step(until);
    std::uint64_t woken = 0;
    if (::read(wake_, &woken, sizeof(woken)) > 0 || ReadClocks().instant >= until) return;
  }
}

void Client::Step(Instant until) {
  const Instant now = ReadClocks().instant;
  Instant end = std::min(until, now + 1s);
  if (phase_ != Phase::connected) end = std::min(end, due_);
  std::array<pollfd, 2> files{};
  files[0] = {wake_, POLLIN, 0};
  files[1] = {its_ ? mosquitto_socket(its_.get()) : -1, POLLIN, 0};
  if (its_ && mosquitto_want_write(its_.get())) files[1].events |= POLLOUT;
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(std::max(end - now, Duration(0)));
  ::poll(files.data(), files.size(), static_cast<int>(wait.count()));
  if (its_ && files[1].revents != 0) {
    int code = ReadPackets(its_.get());
    if (code == MOSQ_ERR_SUCCESS && (files[1].revents & POLLOUT) != 0) {
      code = mosquitto_loop_write(its_.get(), kPacketsAtOnce);
    }
    if (code != MOSQ_ERR_SUCCESS && !ended_) ended_ = Explain(code);
  }
  if (its_ && !ended_) mosquitto_loop_misc(its_.get());
  Look(ReadClocks().instant);
}

/// Carries out what the callbacks have noted: a callback must not destroy its own client.
void Client::Look(Instant now) {
  if (!its_) return;
  if (!ended_ && mosquitto_socket(its_.get()) < 0) ended_ = Explain(0);
  if (ended_) return Lose(*std::exchange(ended_, std::nullopt));
  if (phase_ == Phase::connecting && accepted_) {
    phase_ = Phase::connected;
    if (!trouble_.empty()) log::Info("mqtt: connected to {}", broker().Address());
    trouble_.clear();
    pause_ = patience_ / 10;
    handler_.connected();
    return;
  }
  if (phase_ == Phase::connecting && now >= due_) {
    return Lose("has not answered for " + FormatAge(patience_));
  }
  if (phase_ == Phase::connected && !waiting_.empty() && now - confirmed_at_ > patience_) {
    Lose("has not confirmed messages for " + FormatAge(patience_));
  }
}

bool Client::busy() const { return its_ && mosquitto_want_write(its_.get()); }

void Client::Gather(bool on) {
  const int socket = its_ ? mosquitto_socket(its_.get()) : -1;
  const int value = on ? 1 : 0;
  if (socket >= 0) ::setsockopt(socket, IPPROTO_TCP, TCP_CORK, &value, sizeof(value));
}

std::string Client::Publish(const std::string& topic, std::string_view payload, int qos,
                            bool retained, Delivered delivered, std::uint32_t lifetime) {
  if (phase_ != Phase::connected || ended_) return "the broker is not connected";
  int number = 0;
  mosquitto_property* properties = nullptr;
  if (lifetime > 0) {
    mosquitto_property_add_int32(&properties, MQTT_PROP_MESSAGE_EXPIRY_INTERVAL, lifetime);
  }
  const int code =
      mosquitto_publish_v5(its_.get(), &number, topic.c_str(), static_cast<int>(payload.size()),
                           payload.data(), qos, retained, properties);
  mosquitto_property_free_all(&properties);
  if (code == MOSQ_ERR_OVERSIZE_PACKET) {
    const char* const why = "the broker takes only smaller messages (Maximum Packet Size)";
    handler_.refused("messages to " + topic, why);
    if (delivered) delivered({Delivery::Kind::refused, why});
    return {};
  }
  // The loss of the connection is noticed by Run, with its reason.
  if (code != MOSQ_ERR_SUCCESS) return mosquitto_strerror(code);
  if (qos == 0) return {};
  if (waiting_.empty()) confirmed_at_ = ReadClocks().instant;
  waiting_.emplace(number, std::move(delivered));
  return {};
}

void Client::Subscribe(const std::string& filter) {
  if (phase_ != Phase::connected) return;
  int number = 0;
  mosquitto_subscribe_v5(its_.get(), &number, filter.c_str(), 1,
                         MQTT_SUB_OPT_NO_LOCAL | MQTT_SUB_OPT_RETAIN_AS_PUBLISHED, nullptr);
  subscriptions_[number] = filter;
}

void Client::Unsubscribe(const std::string& filter) {
  if (phase_ == Phase::connected) mosquitto_unsubscribe(its_.get(), nullptr, filter.c_str());
}

}  // namespace baudgate::mqtt
