// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/control_server.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/time.h"
#include "gateway/outputs/control/socket_path.h"

namespace baudgate::control {
namespace {

using asio::local::stream_protocol;

/// Owner and group: who may talk to the gateway is decided by membership in its group.
constexpr mode_t kMode = 0660;
/// Without file descriptors, accepting at once again would only spin.
constexpr Duration kAcceptPause = 100ms;
constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;

std::uint64_t InodeOf(const std::string& path) {
  struct stat found {};
  return ::lstat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

/// Refused: no process listens there.
asio::error_code Probe(asio::io_context& io, const std::string& path) {
  stream_protocol::socket probe(io);
  asio::error_code failed;
  probe.open(stream_protocol(), failed);
  if (!failed) probe.non_blocking(true, failed);
  if (!failed) probe.connect(stream_protocol::endpoint(path), failed);
  return failed;
}

/// Makes room for a socket at `path`: removes what a dead process has left there, nothing else.
Status ClearStale(asio::io_context& io, const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode)) return Error{path + ": there is a file that is not a socket"};
  const asio::error_code failed = Probe(io, path);
  if (failed == asio::error::connection_refused) {
    ::unlink(path.c_str());
    return {};
  }
  if (!failed || failed == asio::error::would_block || failed == asio::error::try_again) {
    return Error{path + ": another process answers there; is this gateway running already?"};
  }
  return Error{path + ": " + failed.message()};
}

}  // namespace

ControlServer::ControlServer(const config::Config& config, const PointStore& store,
                             LineControl& control, CommandSink& sink, GatewayInfo info,
                             asio::io_context& io, const Limits& limits)
    : config_(config),
      limits_(limits),
      service_(config, store, control, sink, std::move(info)),
      acceptor_(io),
      retry_(io),
      look_(io) {
  service_.ReadApart();
}

ControlServer::~ControlServer() { Stop(); }

Status ControlServer::Listen() {
  Status status = BindAnywhere();
  if (status) Watch();
  return status;
}

Status ControlServer::BindAnywhere() {
  if (!config_.socket.empty()) return Bind(config_.socket);
  std::string tried;
  for (const std::string& path : SocketPaths(config_.name)) {
    Status status = PrepareDirectory(std::filesystem::path(path).parent_path().string());
    if (status) status = Bind(path);
    if (status) return {};
    if (!tried.empty()) tried += "; ";
    tried += status.error();
  }
  return Error{tried};
}

Status ControlServer::Bind(const std::string& path) {
  if (path.size() > kLongestPath) {
    return Error{path + ": longer than the " + std::to_string(kLongestPath) +
                 " bytes that a socket's path may have"};
  }
  auto& io = static_cast<asio::io_context&>(acceptor_.get_executor().context());
  if (Status status = ClearStale(io, path); !status) return status;
  asio::error_code failed;
  acceptor_.open(stream_protocol(), failed);
  // The file is born with the mode of the descriptor: nobody else can connect, not even at first.
  if (!failed) ::fchmod(acceptor_.native_handle(), kMode);
  if (!failed) acceptor_.bind(stream_protocol::endpoint(path), failed);
  if (!failed && ::chmod(path.c_str(), kMode) != 0) {
    failed.assign(errno, asio::error::get_system_category());
  }
  if (!failed) acceptor_.listen(asio::socket_base::max_listen_connections, failed);
  if (failed) {
    asio::error_code ignored;
    acceptor_.close(ignored);
    return Error{path + ": " + failed.message()};
  }
  HoldReserve();
  path_ = path;
  inode_ = InodeOf(path);
  // Another file may have taken the name in between: the next look finds that.
  if (Probe(io, path) == asio::error::connection_refused) inode_ = 0;
  Accept();
  return {};
}

void ControlServer::Watch() {
  look_.expires_after(limits_.look);
  look_.async_wait([this](const asio::error_code& stopped) {
    if (stopped || stopped_) return;
    const bool is_ours = acceptor_.is_open() && inode_ != 0 && InodeOf(path_) == inode_;
    if (!is_ours) Rebind();
    Watch();
  });
}

/// Clients that are connected stay so.
void ControlServer::Rebind() {
  retry_.cancel();
  asio::error_code ignored;
  acceptor_.close(ignored);
  const std::string path = path_;  // status and the log have named it
  Status status;
  if (config_.socket.empty()) {
    status = PrepareDirectory(std::filesystem::path(path).parent_path().string());
  }
  if (status) status = Bind(path);
  const std::string trouble = status ? std::string() : status.error();
  if (status) {
    log::Warn("control socket {} was removed, and is made again", path);
  } else if (trouble != trouble_) {
    log::Warn(
        "control socket {} was removed and cannot be made again, so 'baudgate status' and "
        "the like do not work: {}; it is tried every {}",
        path, trouble, FormatDuration(limits_.look));
  }
  trouble_ = trouble;
}

void ControlServer::Apply(const std::shared_ptr<const config::Config>& config,
                          std::shared_ptr<const history::HistorySource> history) {
  service_.Apply(config, std::move(history));
  const auto sessions = sessions_;  // one that is closed leaves
  for (const auto& [key, session] : sessions) session->OnReload(*config);
}

void ControlServer::Stop() {
  if (std::exchange(stopped_, true)) return;
  retry_.cancel();
  look_.cancel();
  asio::error_code ignored;
  acceptor_.close(ignored);
  for (const auto& [key, session] : std::exchange(sessions_, {})) {
    session->Close(R"({"end":"the gateway is stopping"})");
  }
  service_.StopReading();
  if (reserve_ >= 0) ::close(std::exchange(reserve_, -1));
  if (!path_.empty() && InodeOf(path_) == inode_) ::unlink(path_.c_str());
}

void ControlServer::Accept() {
  acceptor_.async_accept([this](const asio::error_code& failed, ControlSession::Socket socket) {
    if (failed == asio::error::operation_aborted || stopped_) return;
    if (!failed) Welcome(std::move(socket));
    if (!failed || failed == asio::error::connection_aborted) return Accept();
    if (failed == asio::error::no_descriptors && reserve_ >= 0) {
      ::close(std::exchange(reserve_, -1));
      return Accept();
    }
    retry_.expires_after(kAcceptPause);
    retry_.async_wait([this](const asio::error_code& stopped) {
      if (!stopped) Accept();
    });
  });
}

/// The oldest client without a request is disconnected.
void ControlServer::MakeRoom() {
  std::shared_ptr<ControlSession> oldest;
  for (const auto& [key, session] : sessions_) {
    if (session->is_idle() && (!oldest || session->number() < oldest->number())) oldest = session;
  }
  if (oldest) oldest->Close();
}

void ControlServer::HoldReserve() {
  if (reserve_ < 0 && !stopped_) reserve_ = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
}

void ControlServer::Welcome(ControlSession::Socket socket) {
  asio::error_code ignored;
  if (sessions_.size() >= limits_.clients) MakeRoom();
  if (sessions_.size() >= limits_.clients + limits_.short_clients) {
    socket.non_blocking(true, ignored);
    socket.write_some(asio::buffer(ControlSession::TooMany(limits_) + "\n"), ignored);
    return;
  }
  const auto closed = [this](ControlSession& session) {
    sessions_.erase(&session);
    HoldReserve();
  };
  const bool may_trace = sessions_.size() < limits_.clients;
  auto session =
      std::make_shared<ControlSession>(std::move(socket), service_, limits_, may_trace, closed);
  sessions_.emplace(session.get(), session);
  session->Start();
}

}  // namespace baudgate::control
