// SPDX-License-Identifier: Apache-2.0
#include "tests/support/mqtt_broker.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <thread>

namespace baudgate {
namespace {

sockaddr_in Loopback(std::uint16_t port) {
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  at.sin_port = htons(port);
  return at;
}

std::uint16_t UnusedPort() {
  const int file = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in at = Loopback(0);
  socklen_t size = sizeof(at);
  ::bind(file, reinterpret_cast<sockaddr*>(&at), sizeof(at));
  ::getsockname(file, reinterpret_cast<sockaddr*>(&at), &size);
  ::close(file);
  return ntohs(at.sin_port);
}

bool Answers(std::uint16_t port) {
  const int file = ::socket(AF_INET, SOCK_STREAM, 0);
  const sockaddr_in at = Loopback(port);
  const bool answers = ::connect(file, reinterpret_cast<const sockaddr*>(&at), sizeof(at)) == 0;
  ::close(file);
  return answers;
}

}  // namespace

MqttBroker::MqttBroker(std::string more) : more_(std::move(more)), port_(UnusedPort()) {
  std::string form = (std::filesystem::temp_directory_path() / "mqtt_broker_XXXXXX").string();
  if (::mkdtemp(form.data()) != nullptr) folder_ = form;
}

MqttBroker::~MqttBroker() {
  Kill();
  std::filesystem::remove_all(folder_);
}

void MqttBroker::Write(const std::string& name, const std::string& text) const {
  std::ofstream(folder_ / name) << text;
}

bool MqttBroker::Start() {
  std::string text = "listener " + std::to_string(port_) + " 127.0.0.1\n" + more_;
  for (auto at = text.find("DIR"); at != std::string::npos; at = text.find("DIR", at)) {
    text.replace(at, 3, folder_.string());
  }
  // Started as root, mosquitto becomes another user, which must be able to read its files.
  if (::geteuid() == 0) text += "user root\n";
  Write("mosquitto.conf", text);
  const std::string file = (folder_ / "mosquitto.conf").string();
  pid_ = ::fork();
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int log = ::open((folder_ / "log").c_str(), O_CREAT | O_APPEND | O_WRONLY, 0600);
    ::dup2(log, 1);
    ::dup2(log, 2);
    for (const char* binary : {"/usr/sbin/mosquitto", "mosquitto"}) {
      ::execlp(binary, binary, "-c", file.c_str(), static_cast<char*>(nullptr));
    }
    ::_exit(127);
  }
  return MqttListener::Wait([this] { return Answers(port_); });
}

void MqttBroker::Kill(int signal) {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGCONT);
  ::kill(pid_, signal);
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

void MqttBroker::Freeze(bool on) const { ::kill(pid_, on ? SIGSTOP : SIGCONT); }

MqttListener::MqttListener(std::uint16_t port, const std::string& filter, const std::string& id)
    : filter_(filter) {
  mosquitto_lib_init();
  its_ = mosquitto_new(id.empty() ? nullptr : id.c_str(), id.empty(), this);
  mosquitto_reconnect_delay_set(its_, 1, 1, false);
  mosquitto_connect_callback_set(its_, [](mosquitto* its, void* self, int) {
    mosquitto_subscribe(its, nullptr, static_cast<MqttListener*>(self)->filter_.c_str(), 1);
  });
  mosquitto_subscribe_callback_set(its_, [](mosquitto*, void* self, int, int, const int*) {
    static_cast<MqttListener*>(self)->subscribed_ = true;
  });
  mosquitto_message_callback_set(
      its_, [](mosquitto*, void* self, const mosquitto_message* message) {
        auto& listener = *static_cast<MqttListener*>(self);
        const std::lock_guard lock(listener.mutex_);
        listener.messages_.push_back({message->topic,
                                      std::string(static_cast<const char*>(message->payload),
                                                  static_cast<std::size_t>(message->payloadlen)),
                                      message->retain});
      });
  mosquitto_connect_async(its_, "127.0.0.1", port, 5);
  mosquitto_loop_start(its_);
  Wait([this] { return subscribed_.load(); });
}

MqttListener::~MqttListener() {
  mosquitto_disconnect(its_);
  mosquitto_loop_stop(its_, true);
  mosquitto_destroy(its_);
}

void MqttListener::Publish(const std::string& topic, const std::string& payload, bool retained) {
  mosquitto_publish(its_, nullptr, topic.c_str(), static_cast<int>(payload.size()), payload.data(),
                    1, retained);
}

std::vector<MqttListener::Message> MqttListener::messages() const {
  const std::lock_guard lock(mutex_);
  return messages_;
}

std::vector<std::string> MqttListener::Payloads(const std::string& topic) const {
  std::vector<std::string> payloads;
  for (const Message& message : messages()) {
    if (message.topic == topic) payloads.push_back(message.payload);
  }
  return payloads;
}

std::string MqttListener::Last(const std::string& topic) const {
  const auto payloads = Payloads(topic);
  return payloads.empty() ? std::string() : payloads.back();
}

bool MqttListener::Wait(const std::function<bool()>& holds, Duration limit) {
  const Instant end = ReadClocks().instant + limit;
  while (!holds()) {
    if (ReadClocks().instant > end) return false;
    std::this_thread::sleep_for(10ms);
  }
  return true;
}

}  // namespace baudgate
