// `ControlClient` is the client side of the control socket, for all commands that need a running
// gateway. It finds the gateway, and sends and reads JSON lines.
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

  /// Connects to `path`, or, if `path` is empty, to the only gateway that answers in the default
  /// places. The error tells the user what to do.
  static Result<ControlClient> Connect(const std::string& path);
  ControlClient(ControlClient&& other) noexcept;
  ControlClient& operator=(ControlClient&&) = delete;
  ~ControlClient();

  const std::string& path() const { return path_; }
  /// Returns the id of the listening process as the kernel reports it; 0: unknown.
  int process() const;

  /// Does not report a failed send: a gateway that closes the connection sends its reason first, so
  /// the caller finds the reason in the reply.
  void Send(const Json& request);

  enum class Got { line, end, timeout, stopped };
  /// Waits for a whole line until `until` (empty: no limit) or until `stop_descriptor` is readable.
  Got ReadLine(std::string& line, std::optional<Instant> until, int stop_descriptor = -1);

 private:
  ControlClient(int descriptor, std::string path);

  int descriptor_;
  std::string path_;
  std::string buffer_;
  std::size_t searched_ = 0;  // this many bytes of buffer_ contain no line end
};

/// Returns the command that helps when the listening process does not answer.
std::string CureOfSilence(int process);

/// The exit code when no gateway answers.
inline constexpr int kNoDaemon = 4;

/// Connects, or prints the reason on `err` and returns nothing.
std::optional<ControlClient> ConnectOrTell(const std::string& socket, std::ostream& err);

/// Sends the request and waits a limited time for its answer. Returns the exit code; a failure is
/// printed on `err`.
int ReadAnswer(ControlClient& client, const ControlClient::Json& request,
               ControlClient::Json& answer, std::ostream& err);

/// Like ReadAnswer, over a new connection.
int Ask(const std::string& socket, const ControlClient::Json& request, ControlClient::Json& answer,
        std::ostream& err);

// Access to the members of a gateway's answer.

/// Returns a number that every answer contains; throws if it is missing.
inline std::uint64_t Number(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::uint64_t>();
}
inline std::string NumberText(const nlohmann::ordered_json& json, const char* key) {
  return std::to_string(Number(json, key));
}
inline std::string Text(const nlohmann::ordered_json& json, const char* key) {
  return json.at(key).get<std::string>();
}

/// Returns the member, or null if it is missing: the gateway may be older than this member.
inline const nlohmann::ordered_json& PartOf(const nlohmann::ordered_json& json, const char* key) {
  static const nlohmann::ordered_json none;
  const auto found = json.find(key);
  return found == json.end() ? none : *found;
}

/// Returns the text, or an empty string if the member is missing or is no text.
inline std::string TextOf(const nlohmann::ordered_json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

}  // namespace baudgate::tools
