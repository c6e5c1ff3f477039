// `MqttBroker` runs a real mosquitto for a test, and `MqttListener` is a client of it that
// remembers the messages.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mosquitto.h>
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

class MqttBroker {
 public:
  /// Chooses a free port. `more`: further lines of mosquitto.conf, in which DIR is the folder of
  /// the broker. Does not start it.
  explicit MqttBroker(std::string more = "allow_anonymous true\n");
  ~MqttBroker();
  MqttBroker(const MqttBroker&) = delete;
  MqttBroker& operator=(const MqttBroker&) = delete;

  /// Returns true when the broker accepts connections.
  bool Start();
  /// Ends the broker with SIGKILL; with SIGTERM it saves its state first (persistence true).
  void Kill(int signal = 9);
  /// Stops (SIGSTOP) or continues the broker: connections are accepted by the system, and nothing
  /// answers.
  void Freeze(bool on) const;
  std::uint16_t port() const { return port_; }
  const std::filesystem::path& folder() const { return folder_; }
  void Write(const std::string& name, const std::string& text) const;

 private:
  const std::string more_;
  std::filesystem::path folder_;
  std::uint16_t port_ = 0;
  pid_t pid_ = -1;
};

class MqttListener {
 public:
  struct Message {
    std::string topic;
    std::string payload;
    bool retained = false;
  };
  /// Waits until the broker has confirmed the subscription. `id`: the broker keeps the session of
  /// this client, so it misses no message. Empty: it does not.
  MqttListener(std::uint16_t port, const std::string& filter, const std::string& id = {});
  ~MqttListener();
  MqttListener(const MqttListener&) = delete;
  MqttListener& operator=(const MqttListener&) = delete;

  void Publish(const std::string& topic, const std::string& payload, bool retained = false);
  std::vector<Message> messages() const;
  /// Returns the payloads of a topic, in the order of their arrival.
  std::vector<std::string> Payloads(const std::string& topic) const;
  /// Returns the last payload of the topic; empty: there was none.
  std::string Last(const std::string& topic) const;
  /// Waits until `holds` is true.
  static bool Wait(const std::function<bool()>& holds, Duration limit = 20s);
  bool WaitFor(const std::string& topic, const std::string& part) const {
    return Wait([&] { return Last(topic).find(part) != std::string::npos; });
  }

 private:
  mosquitto* its_ = nullptr;
  std::atomic<bool> subscribed_ = false;
  std::string filter_;
  mutable std::mutex mutex_;
  std::vector<Message> messages_;
};

}  // namespace baudgate
