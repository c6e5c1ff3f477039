// `ControlClient` is the client side of the control socket, for all commands that need a running
// gateway. It finds the gateway, sends requests and reads replies, both as JSON lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tools {

class ControlClient {
 public:
  using Json = nlohmann::ordered_json;

  /// Connects to the socket `path`. If `path` is empty, connects to the only gateway that answers
  /// in control::SocketDirectories. The error tells the user what to do.
  static Result<ControlClient> Connect(const std::string& path);
  ControlClient(ControlClient&& other) noexcept;
  ControlClient& operator=(ControlClient&&) = delete;
  ~ControlClient();

  const std::string& path() const { return path_; }
  /// Returns the process id of the gateway; 0: the kernel does not report it.
  int process() const;

  /// Sends a request. A failure is not reported here, because a gateway that closes the connection
  /// sends the reason first: ReadLine then returns the reason.
  void Send(const Json& request);

  enum class Got { line, end, timeout, stopped };
  /// Waits for a whole line until `until` (empty: without limit), or until `stop_descriptor` is
  /// readable. Got::timeout comes after 1000 s at the latest, unless `until` is empty.
  Got ReadLine(std::string& line, std::optional<Instant> until, int stop_descriptor = -1);

 private:
  ControlClient(int descriptor, std::string path);
  /// As control::WhyNotBelieved, for the program at the other end.
  std::string WhyNotBelieved(bool is_given) const;

  int descriptor_;
  std::string path_;
  std::string buffer_;
  std::size_t searched_ = 0;  // this many bytes of buffer_ were searched and contain no line end
};

std::string CureOfSilence(int process);

inline constexpr int kNoDaemon = 4;

std::optional<ControlClient> ConnectOrTell(const std::string& socket, std::ostream& err);

/// Sends the request and waits up to 10 s for the answer. Prints a failure on `err`. Returns the
/// exit code: 0 done; 2 refused; kNoDaemon: no answer, or the gateway is busy.
int ReadAnswer(ControlClient& client, const ControlClient::Json& request,
               ControlClient::Json& answer, std::ostream& err);

/// Connects to `socket`, then does the same as ReadAnswer.
int Ask(const std::string& socket, const ControlClient::Json& request, ControlClient::Json& answer,
        std::ostream& err);

/// Returns the number `key`. Throws a nlohmann exception if the answer does not contain it.
inline std::uint64_t Number(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::uint64_t>();
}
inline std::string NumberText(const nlohmann::ordered_json& json, const char* key) {
  return std::to_string(Number(json, key));
}
inline std::string Text(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::string>();
}

/// Returns the member `key`; null: the answer of an older gateway does not contain it.
inline const nlohmann::ordered_json& PartOf(const nlohmann::ordered_json& json, const char* key) {
  static const nlohmann::ordered_json none;
  const auto found = json.find(key);
  return found == json.end() ? none : *found;
}

inline std::string TextOf(const nlohmann::ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace baudgate::tools
