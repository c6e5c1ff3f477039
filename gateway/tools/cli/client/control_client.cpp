// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/control_client.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>
#include <vector>

#include "gateway/base/exit_code.h"
#include "gateway/outputs/control/socket_path.h"

namespace baudgate::tools {
namespace {

constexpr Duration kAnswerTime = 10s;

constexpr std::string_view kIsItRunning = "; start baudgate, or name its socket with --socket PATH";

int ConnectTo(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path) {
    errno = ENAMETOOLONG;
    return -1;
  }
  std::memcpy(address.sun_path, path.data(), path.size());
  const int descriptor = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return -1;
  if (::connect(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    return descriptor;
  }
  const int why = errno;
  ::close(descriptor);
  errno = why;
  return -1;
}

Error Denied(const std::string& path) {
  return {"permission denied at " + path +
          "; join the group of this socket (usually 'baudgate'), or use sudo"};
}

std::string Listed(const std::vector<std::string>& words, std::string_view separator) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : std::string(separator)) + word;
  return text;
}

int MillisecondsUntil(std::optional<Instant> until) {
  if (!until) return -1;
  const Duration left = *until - ReadClocks().instant;
  const auto whole = std::chrono::ceil<std::chrono::milliseconds>(left).count();
  return static_cast<int>(std::clamp<std::int64_t>(whole, 0, 1'000'000));
}

}  // namespace

Result<ControlClient> ControlClient::Connect(const std::string& path) {
  if (!path.empty()) {
    const int descriptor = ConnectTo(path);
    if (descriptor >= 0) {
      ControlClient client(descriptor, path);
      if (std::string why = client.WhyNotBelieved(true); !why.empty()) return Error{std::move(why)};
      return client;
    }
    if (errno == EACCES) return Denied(path);
    return Error{"no gateway answers at " + path + " (" + std::strerror(errno) + ")" +
                 std::string(kIsItRunning)};
  }
  const auto directories = control::SocketDirectories();
  std::vector<ControlClient> living;
  std::string denied;
  std::string not_believed;
  for (const std::string& candidate : control::ListSockets(directories)) {
    const int descriptor = ConnectTo(candidate);
    if (descriptor < 0) {
      if (errno == EACCES) denied = candidate;
      continue;
    }
    ControlClient client(descriptor, candidate);
    if (std::string why = client.WhyNotBelieved(false); !why.empty()) {
      not_believed = std::move(why);
    } else {
      living.push_back(std::move(client));
    }
  }
  if (living.size() == 1) return std::move(living.front());
  if (!living.empty()) {
    std::vector<std::string> paths;
    for (const ControlClient& client : living) paths.push_back(client.path_);
    return Error{"several gateways run here; give one of them with --socket: " +
                 Listed(paths, ", ")};
  }
  if (!not_believed.empty()) return Error{not_believed};
  if (!denied.empty()) return Denied(denied);
  return Error{"no gateway answers in " + Listed(directories, ", ") + std::string(kIsItRunning)};
}

ControlClient::ControlClient(int descriptor, std::string path)
    : descriptor_(descriptor), path_(std::move(path)) {}

ControlClient::ControlClient(ControlClient&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)),
      path_(std::move(other.path_)),
      buffer_(std::move(other.buffer_)) {}

ControlClient::~ControlClient() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void ControlClient::Send(const Json& request) {
  const std::string text = request.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  std::size_t sent = 0;
  while (sent < text.size()) {
    const auto count = ::send(descriptor_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return;
    sent += static_cast<std::size_t>(count);
  }
}

ControlClient::Got ControlClient::ReadLine(std::string& line, std::optional<Instant> until,
                                           int stop_descriptor) {
  for (;;) {
    const auto end = buffer_.find('\n', searched_);
    if (end != std::string::npos) {
      line = buffer_.substr(0, end);
      buffer_.erase(0, end + 1);
      searched_ = 0;
      return Got::line;
    }
    searched_ = buffer_.size();
    pollfd waited[] = {{descriptor_, POLLIN, 0}, {stop_descriptor, POLLIN, 0}};
    const int ready = ::poll(waited, 2, MillisecondsUntil(until));
    if (ready == 0) return Got::timeout;
    if (ready < 0 && errno != EINTR) return Got::end;
    if (ready < 0) continue;
    if (waited[1].revents != 0) return Got::stopped;
    char chunk[16384];
    const auto count = ::recv(descriptor_, chunk, sizeof chunk, 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return Got::end;
    buffer_.append(chunk, static_cast<std::size_t>(count));
  }
}

namespace {

std::optional<ucred> ListenerOf(int descriptor) {
  ucred listener{};
  socklen_t size = sizeof listener;
  const int failed = ::getsockopt(descriptor, SOL_SOCKET, SO_PEERCRED, &listener, &size);
  return failed == 0 ? std::optional(listener) : std::nullopt;
}

}  // namespace

int ControlClient::process() const {
  const auto listener = ListenerOf(descriptor_);
  return listener ? listener->pid : 0;
}

std::string ControlClient::WhyNotBelieved(bool is_given) const {
  const auto listener = ListenerOf(descriptor_);
  if (!listener) return path_ + " is not used: the system does not show which user listens there";
  return control::WhyNotBelieved(path_, listener->uid, is_given);
}

std::string CureOfSilence(int process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  const std::string stat{std::istreambuf_iterator<char>(file), {}};
  const auto name_end = stat.rfind(')');  // the format is "123 (name) T …", see proc(5)
  const char state =
      name_end == std::string::npos || name_end + 2 >= stat.size() ? '?' : stat[name_end + 2];
  const std::string which = process > 0 ? "process " + std::to_string(process) : "the gateway";
  if (state == 'T') {
    return which + " is stopped; continue it with: kill -CONT " + std::to_string(process);
  }
  return which + " may hang or get no processor time; check with: systemctl status baudgate, top";
}

std::optional<ControlClient> ConnectOrTell(const std::string& socket, std::ostream& err) {
  auto client = ControlClient::Connect(socket);
  if (client) return std::move(*client);
  err << "baudgate: " << client.error() << '\n';
  return std::nullopt;
}

int ReadAnswer(ControlClient& client, const ControlClient::Json& request,
               ControlClient::Json& answer, std::ostream& err) {
  client.Send(request);
  std::string line;
  const auto got = client.ReadLine(line, ReadClocks().instant + kAnswerTime);
  if (got != ControlClient::Got::line) {
    const bool is_silent = got == ControlClient::Got::timeout;
    err << "baudgate: the gateway at " << client.path() << " did not answer"
        << (is_silent ? " in time; " + CureOfSilence(client.process())
                      : ", but closed the connection; check with: systemctl status baudgate")
        << '\n';
    return kNoDaemon;
  }
  answer = ControlClient::Json::parse(line, nullptr, false);
  if (!answer.is_object()) {
    err << "baudgate: the program that answers at " << client.path()
        << " is no gateway; name the socket of the gateway with --socket PATH\n";
    return kNoDaemon;
  }
  if (!answer.contains("error")) return 0;
  err << "baudgate: " << answer.value("message", std::string("the gateway refuses")) << '\n';
  const bool not_now = answer["error"] == "busy" || answer["error"] == "unavailable";
  return not_now ? kNoDaemon : kExitUsage;
}

int Ask(const std::string& socket, const ControlClient::Json& request, ControlClient::Json& answer,
        std::ostream& err) {
  auto client = ConnectOrTell(socket, err);
  return client ? ReadAnswer(*client, request, answer, err) : kNoDaemon;
}

}  // namespace baudgate::tools
