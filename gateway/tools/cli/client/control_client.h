// The other end of the control socket, for all commands that ask a running gateway, such as
// `status` and `release`: finds the running gateway, sends one JSON line, reads JSON lines.
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

  /// At `path`; when it is empty, the one gateway that answers in the default places. The error
  /// says what to do: start it, choose one of several, get the right.
  static Result<ControlClient> Connect(const std::string& path);
  ControlClient(ControlClient&& other) noexcept;
  ControlClient& operator=(ControlClient&&) = delete;
  ~ControlClient();

  const std::string& path() const { return path_; }
  /// The process that listens, as the system says; 0: it does not say.
  int process() const;

  /// A gateway that has closed the connection already has said why: its answer is still to be read.
  void Send(const Json& request);

  enum class Got { line, end, timeout, stopped };
  /// Waits for a whole line, until the instant (nothing: for ever), or until `stop_descriptor` has
  /// something to read.
  Got ReadLine(std::string& line, std::optional<Instant> until, int stop_descriptor = -1);

 private:
  ControlClient(int descriptor, std::string path);

  int descriptor_;
  std::string path_;
  std::string buffer_;
  std::size_t searched_ = 0;  // of buffer_, without a line end
};

/// The command that helps if the process that listens does not answer.
std::string CureOfSilence(int process);

/// Exit code: no gateway answers.
inline constexpr int kNoDaemon = 4;

/// Connect, or nothing and why on `err`.
std::optional<ControlClient> ConnectOrTell(const std::string& socket, std::ostream& err);

/// Sends the request and reads its answer, in time. The exit code: 0, or what was told on `err`.
int ReadAnswer(ControlClient& client, const ControlClient::Json& request,
               ControlClient::Json& answer, std::ostream& err);

/// The same with a connection of its own.
int Ask(const std::string& socket, const ControlClient::Json& request, ControlClient::Json& answer,
        std::ostream& err);

// Members of an answer of the gateway.

/// A number that is always there.
inline std::uint64_t Number(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::uint64_t>();
}
inline std::string NumberText(const nlohmann::ordered_json& json, const char* key) {
  return std::to_string(Number(json, key));
}
inline std::string Text(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::string>();
}

/// Null: there is none, or the gateway is older than this field.
inline const nlohmann::ordered_json& PartOf(const nlohmann::ordered_json& json, const char* key) {
  static const nlohmann::ordered_json none;
  const auto found = json.find(key);
  return found == json.end() ? none : *found;
}

/// Empty where there is none, or no text.
inline std::string TextOf(const nlohmann::ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace baudgate::tools
