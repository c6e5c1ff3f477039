// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/control/control_server.h"

#include <fcntl.h>
#include <limits.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <asio/post.hpp>
#include <asio/write.hpp>
#include <cerrno>
#include <filesystem>

#include "gateway/base/log.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/time.h"
#include "gateway/outputs/control/socket_path.h"

namespace baudgate::control {

std::string TraceStream::Take() {
  std::string text;
  for (const records::TraceRecord& record : queue_->Take()) {
    if (!Wanted(wish_, record)) continue;
    if (!text.empty()) text += '\n';
    text += RecordLine(record);
  }
  return text;
}

namespace {

std::uint64_t NextNumber() {
  static std::atomic<std::uint64_t> last = 0;
  return ++last;
}

/// Returns the groups of the program at the other end of the socket.
std::vector<gid_t> GroupsOf(int socket, gid_t first) {
  std::vector<gid_t> groups(NGROUPS_MAX);
  auto size = static_cast<socklen_t>(groups.size() * sizeof(gid_t));
  const bool known = ::getsockopt(socket, SOL_SOCKET, SO_PEERGROUPS, groups.data(), &size) == 0;
  groups.resize(known ? size / sizeof(gid_t) : 0);
  groups.push_back(first);
  return groups;
}

std::optional<ucred> PeerOf(int socket) {
  ucred peer{};
  socklen_t size = sizeof(peer);
  const int failed = ::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size);
  return failed == 0 ? std::optional(peer) : std::nullopt;
}

std::string NameOfPeer(int socket) {
  const auto peer = PeerOf(socket);
  return "user:" + (peer ? NameOfUser(peer->uid) : std::string("?"));
}

/// Returns the role of the program at the other end of the socket, as Writer::role.
std::optional<Role> RoleOfPeer(int socket, users::UserDirectory& users) {
  if (!users.is_used()) return std::nullopt;
  const auto peer = PeerOf(socket);
  if (!peer) return Role::viewer;
  if (peer->uid == 0 || peer->uid == ::geteuid()) return std::nullopt;
  return users.OfSystemUser(NameOfUser(peer->uid), GroupsOf(socket, peer->gid),
                            ReadClocks().instant);
}

}  // namespace

std::string ControlSession::TooMany(const Limits& limits) {
  return ErrorLine("busy",
                   std::to_string(limits.clients) +
                       " clients are already connected; end one of them, for example a trace");
}

ControlSession::ControlSession(Socket socket, RequestHandler& service, users::UserDirectory& users,
                               const Limits& limits, bool may_trace,
                               std::function<void(ControlSession&)> closed)
    : socket_(std::move(socket)),
      patience_(socket_.get_executor()),
      service_(service),
      limits_(limits),
      on_closed_(std::move(closed)),
      left_(std::make_shared<std::atomic<bool>>(false)),
      users_(users),
      client_{NameOfPeer(socket_.native_handle()), NextNumber(), left_},
      in_(limits.request),
      may_trace_(may_trace) {}

void ControlSession::Start() {
  BePatient(limits_.patience);
  Receive();
}

void ControlSession::Close(const std::string& farewell) {
  if (std::exchange(closed_, true)) return;
  if (!farewell.empty() && trace_ && out_.empty()) {
    // If the client's socket buffer is full, the client does not get the farewell.
    asio::error_code ignored;
    socket_.non_blocking(true, ignored);
    socket_.write_some(asio::buffer(farewell + "\n"), ignored);
  }
  trace_.reset();
  patience_.cancel();
  left_->store(true);
  service_.Forget(client_);
  asio::error_code ignored;
  socket_.close(ignored);
  on_closed_(*this);
}

void ControlSession::OnReload(const config::Config& config) {
  if (!trace_ || !config.lines[trace_->line()].name.empty()) return;
  Close(R"({"end":"a reload has removed or restarted this line; start the trace again"})");
}

void ControlSession::BePatient(Duration patience) {
  patience_.expires_after(patience);
  patience_.async_wait([self = shared_from_this()](const asio::error_code& stopped) {
    if (!stopped) self->OnImpatience();
  });
}

void ControlSession::OnImpatience() {
  if (!asked_ || late_.empty()) return Close();
  Send(std::exchange(late_, {}), true);
}

void ControlSession::Receive() {
  socket_.async_read_some(
      asio::buffer(in_.space()),
      [self = shared_from_this()](const asio::error_code& failed, std::size_t count) {
        if (self->closed_) return;
        if (failed) return self->Close();
        self->OnReceived(count);
      });
}

void ControlSession::OnReceived(std::size_t count) {
  if (trace_) return Receive();  // data is ignored; only the end of the stream matters
  in_.Commit(count);
  if (in_.IsTooLong()) {
    return Send(ErrorLine("usage", "the request is longer than " + std::to_string(limits_.request) +
                                       " bytes"),
                true);
  }
  const auto request = in_.Take();
  if (!request) return Receive();
  Handle(*request);
}

/// Waits for the end of the connection while a request has no answer yet, because the socket is not
/// read meanwhile. A client that has only shut down its sending side still gets its answer.
void ControlSession::WatchEnd() {
  if (std::exchange(watched_, true)) return;
  socket_.async_wait(Socket::wait_error, [self = shared_from_this()](const asio::error_code& end) {
    self->watched_ = false;
    if (!end && !self->closed_ && self->asked_) self->Close();
  });
}

void ControlSession::Handle(std::string_view request) {
  // A line's thread can call `later`, even after this session has ended.
  auto later = [weak = weak_from_this(), executor = socket_.get_executor()](std::string text) {
    asio::post(executor, [weak, text = std::move(text)]() mutable {
      const auto self = weak.lock();
      if (self && !self->closed_ && self->asked_) self->Send(std::move(text));
    });
  };
  BePatient(limits_.patience);
  asked_ = true;
  WatchEnd();
  // The role can have changed since the last request of this client.
  client_.role = RoleOfPeer(socket_.native_handle(), users_);
  Reply reply = service_.Answer(request, client_, ReadClocks(), later);
  if (reply.text.empty()) {
    late_ = std::move(reply.late);
    if (!late_.empty()) BePatient(limits_.disk);
    return;
  }
  if (reply.trace && !may_trace_) return Send(TooMany(limits_));
  Send(std::move(reply.text));
  if (reply.trace) StartTrace(*reply.trace);
}

void ControlSession::Send(std::string text, bool last) {
  out_ = std::move(text);
  out_ += '\n';
  asked_ = false;
  if (!trace_) BePatient(limits_.patience);
  asio::async_write(socket_, asio::buffer(out_),
                    [self = shared_from_this(), last](const asio::error_code& failed, std::size_t) {
                      if (self->closed_) return;
                      if (failed) return self->Close();
                      self->OnSent(last);
                    });
}

void ControlSession::OnSent(bool last) {
  out_ = {};
  if (last) return Close();
  if (trace_) return SendRecords();
  BePatient(limits_.patience);
  OnReceived(0);  // the next request may have arrived already
}

void ControlSession::StartTrace(const TraceWish& wish) {
  // The line's thread calls `wake`, even after this session has ended.
  const std::weak_ptr<ControlSession> weak = weak_from_this();
  auto wake = [weak, executor = socket_.get_executor()] {
    asio::post(executor, [weak] {
      if (const auto self = weak.lock(); self && !self->closed_) self->SendRecords();
    });
  };
  auto queue = service_.control().Trace(wish.line, std::move(wake));
  if (!queue) return Close();  // the line has ended meanwhile
  trace_.emplace(wish, std::move(queue));
  patience_.cancel();
  Receive();
}

void ControlSession::SendRecords() {
  if (!out_.empty()) return;
  std::string text = trace_->Take();
  if (!text.empty()) Send(std::move(text));
}

namespace {

using asio::local::stream_protocol;

/// The mode of the socket file: owner and group may connect, so membership in the gateway's group
/// decides about access.
constexpr mode_t kMode = 0660;
/// Pause before accept() is called again after an error. Without it, a process that has no free
/// descriptors would call accept() in an endless loop.
constexpr Duration kAcceptPause = 100ms;
constexpr std::size_t kLongestPath = sizeof(sockaddr_un::sun_path) - 1;

std::uint64_t InodeOf(const std::string& path) {
  struct stat found {};
  return ::lstat(path.c_str(), &found) == 0 ? found.st_ino : 0;
}

asio::error_code Probe(asio::io_context& io, const std::string& path) {
  stream_protocol::socket probe(io);
  asio::error_code failed;
  probe.open(stream_protocol(), failed);
  if (!failed) probe.non_blocking(true, failed);
  if (!failed) probe.connect(stream_protocol::endpoint(path), failed);
  return failed;
}

/// Removes the socket file if no process listens on it. Returns an error if a process listens, or
/// if the file is not a socket.
Status ClearStale(asio::io_context& io, const std::string& path) {
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return {};
  if (!S_ISSOCK(found.st_mode))
    return Error{
        path +
        ": this path is a file, not a socket; remove the file or set another gateway.socket"};
  const asio::error_code failed = Probe(io, path);
  if (failed == asio::error::connection_refused) {
    ::unlink(path.c_str());
    return {};
  }
  if (!failed || failed == asio::error::would_block || failed == asio::error::try_again) {
    return Error{path +
                 ": another process answers at this socket; is this gateway running already?"};
  }
  return Error{path + ": " + failed.message()};
}

}  // namespace

ControlServer::ControlServer(const config::Config& config, const bus::PointStore& store,
                             lines::LineControl& control, bus::CommandSink& sink,
                             status::GatewayInfo info, asio::io_context& io, const Limits& limits)
    : config_(config),
      limits_(limits),
      service_(config, store, control, sink, WithUsers(std::move(info))),
      acceptor_(io),
      retry_(io),
      look_(io) {
  users_.SetFile(config.users.file);
  service_.ReadApart();
}

ControlServer::~ControlServer() { Stop(); }

/// Adds the trouble of the users file to the troubles of files that the status contains.
status::GatewayInfo ControlServer::WithUsers(status::GatewayInfo info) {
  info.files = [this, files = std::move(info.files)] {
    status::FilesState state = files ? files() : status::FilesState();
    std::string trouble = users_.Trouble(ReadClocks().instant);
    if (!trouble.empty()) state.troubles.push_back(std::move(trouble));
    return state;
  };
  return info;
}

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
    return Error{path + ": the path is longer than the " + std::to_string(kLongestPath) +
                 " bytes that the path of a socket may have"};
  }
  auto& io = static_cast<asio::io_context&>(acceptor_.get_executor().context());
  if (Status status = ClearStale(io, path); !status) return status;
  asio::error_code failed;
  acceptor_.open(stream_protocol(), failed);
  // bind() gives the file the mode of the descriptor, so there is no moment at which other users
  // could connect.
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
  // Another process can have replaced the file since bind(). If nobody listens at the path, inode 0
  // makes Watch() bind again.
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

void ControlServer::Rebind() {
  retry_.cancel();
  asio::error_code ignored;
  acceptor_.close(ignored);
  const std::string path = path_;  // the same path, because status and log have shown it
  Status status;
  if (config_.socket.empty()) {
    status = PrepareDirectory(std::filesystem::path(path).parent_path().string());
  }
  if (status) status = Bind(path);
  const std::string trouble = status ? std::string() : status.error();
  if (status) {
    log::Warn("control socket {} was removed; the gateway has created it again", path);
  } else if (trouble != trouble_) {
    log::Warn(
        "control socket {} was removed and cannot be created again: {}; commands such as 'baudgate "
        "status' do not work. The gateway tries again every {}",
        path, trouble, FormatDuration(limits_.look));
  }
  trouble_ = trouble;
}

void ControlServer::Apply(const std::shared_ptr<const config::Config>& config,
                          std::shared_ptr<const history::HistorySource> history) {
  users_.SetFile(config->users.file);
  service_.Apply(config, std::move(history));
  const auto sessions = sessions_;  // a copy, because OnReload may remove sessions
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
  auto session = std::make_shared<ControlSession>(std::move(socket), service_, users_, limits_,
                                                  may_trace, closed);
  sessions_.emplace(session.get(), session);
  session->Start();
}

}  // namespace baudgate::control

namespace baudgate::control {

ControlOutput::ControlOutput(const config::Config& config, const Links& links)
    : server_(config, links.store, links.lines, links.commands, links.info, loop_.io()) {
  if (links.reload != nullptr) server_.SetReload(*links.reload);
}

Status ControlOutput::Begin(const Configuration& /*config*/) {
  if (const Status status = server_.Listen(); !status) {
    log::Warn(
        "no control socket, so commands such as 'baudgate status' do not work: {}; set another "
        "path in gateway.socket",
        status.error());
    return {};
  }
  log::Info("control socket {}", server_.path());
  listens_ = true;
  loop_.Start();
  return {};
}

void ControlOutput::SetHistory(const Configuration& config,
                               const std::shared_ptr<const history::HistorySource>& history) {
  if (listens_) transports::RunOn(loop_.io(), [&] { server_.Apply(config, history); });
}

void ControlOutput::StopRequests() {
  loop_.Stop([this] { server_.Stop(); });
}

}  // namespace baudgate::control
