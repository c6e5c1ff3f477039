// `Client` is the connection to the MQTT broker (libmosquitto). One thread uses it: it calls Run
// again and again. Every wait has an end: the client leaves a broker that does not take the
// connection, does not answer or does not confirm. After a back-off of 1 s to 1 min the client
// tries the next broker of the list. Only the name service can hold Run for longer (is_blocked).
//
//   waiting ─back-off over→ connecting ─CONNACK→ connected
//   connecting, connected ─refused, silent, closed→ waiting
//
// The session at the broker ends with the connection, so that the broker does not store commands
// that are carried out later.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mosquitto.h>

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/outputs.h"
#include "gateway/base/time.h"

namespace baudgate::mqtt {

struct Message {
  std::string topic{};
  std::string payload{};
  bool retained = false;
};

/// The answer of the broker to a message with QoS 1.
struct Delivery {
  enum class Kind : std::uint8_t {
    confirmed,
    retry,    ///< the connection ended before the answer, or the broker is full
    denied,   ///< the broker's access rules do not permit the topic until somebody changes them
    refused,  ///< the broker does not accept this message, now or later
  } kind = Kind::confirmed;
  std::string why{};       ///< for people; empty if confirmed
  bool by_broker = false;  ///< true: the broker has answered with an error
};
using Delivered = std::function<void(const Delivery&)>;

class Client {
 public:
  static constexpr Duration kPatience = 10s;
  static constexpr int kKeepAlive =
      10;  ///< seconds; the broker sends the will after 15 s of silence

  struct Will {
    std::string topic{};
    std::string payload{};
    bool retained = true;
  };
  struct Handler {
    /// Returns the will of the next connection.
    std::function<Will()> will;
    std::function<void()> connected;
    std::function<void()> lost;
    std::function<void(const Message&)> message;
    /// `what` is not accepted: "messages to TOPIC", "a subscription of FILTER".
    std::function<void(const std::string& what, const std::string& why)> refused;
  };
  enum class Phase : std::uint8_t { waiting, connecting, connected };

  /// `settings` must outlive the client. `patience`: the longest wait for an answer of the broker.
  /// The back-off is a tenth of it at first, and at most six times as long.
  Client(const config::Mqtt& settings, Handler handler, Duration patience = kPatience);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Sends and receives until `until`, or until Wake. Calls the handler.
  void Run(Instant until);
  /// Makes Run return. Any thread may call it.
  void Wake();

  /// Publishes a message, if the client is connected. `delivered`: called in Run, or in Close; only
  /// for QoS 1. `lifetime`: seconds after which the broker forgets the message; 0: never. Returns
  /// why it cannot be sent; empty: it was sent, or is refused.
  std::string Publish(const std::string& topic, std::string_view payload, int qos, bool retained,
                      Delivered delivered = {}, std::uint32_t lifetime = 0);
  /// Subscribes a filter with QoS 1. A retained message keeps its mark also if it is new.
  void Subscribe(const std::string& filter);
  void Unsubscribe(const std::string& filter);
  /// True if the network has not taken all bytes yet.
  bool busy() const;
  /// Holds small packets back, so that messages share packets on the network, until `on` is false.
  void Gather(bool on);
  /// Disconnects; the broker then publishes the will.
  void Close();
  /// Ends the connection; the client connects again after a back-off.
  void Reconnect(const std::string& why) { Lose(why); }

  Phase phase() const { return phase_; }
  const config::MqttBroker& broker() const { return settings_.brokers[broker_]; }
  /// Returns why there is no connection; empty: there is one.
  const std::string& trouble() const { return trouble_; }
  std::uint64_t times_lost() const { return times_lost_; }
  /// True while Run waits for the name service. Any thread may call it.
  bool is_blocked() const { return blocked_; }

 private:
  struct Free {
    void operator()(mosquitto* its) const { mosquitto_destroy(its); }
  };
  struct Callbacks;

  void Connect(Instant now);
  std::string Prepare();
  void Step(Instant until);
  void Look(Instant now);
  void Lose(const std::string& why);
  void Drop();
  std::string Explain(int code) const;

  const config::Mqtt& settings_;
  const Handler handler_;
  const Duration patience_;
  const int wake_;
  std::unique_ptr<mosquitto, Free> its_;
  Phase phase_ = Phase::waiting;
  std::size_t broker_ = 0;
  Instant due_{};  ///< waiting: the next attempt; connecting: the end of the patience
  Duration pause_;
  std::minstd_rand random_{std::random_device{}()};
  std::string trouble_;
  std::string tls_error_;                     ///< last message of the library about TLS
  std::optional<std::string> ended_;          ///< set by a callback: why the connection has ended
  bool accepted_ = false;                     ///< set by a callback: the broker has answered
  std::map<int, Delivered> waiting_;          ///< by the number of the message
  std::map<int, std::string> subscriptions_;  ///< filters that wait for an answer, by number
  Instant confirmed_at_{};  ///< last confirmation, or first message that waits for it
  std::uint64_t times_lost_ = 0;
  std::atomic<bool> blocked_ = false;
};

}  // namespace baudgate::mqtt
