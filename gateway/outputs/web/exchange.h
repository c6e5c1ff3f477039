// `Exchange` is one HTTP request and its answer on a connection of libmicrohttpd. The server's
// thread takes the answer, or the next bytes of a stream; any thread can supply them. The
// connection is suspended until they are supplied. `RequestOf` reads the request, and `Send` sends
// the answer.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <microhttpd.h>

#include <atomic>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "gateway/base/guarded.h"
#include "gateway/outputs/web/request.h"

struct MHD_Connection;

namespace baudgate::web {

class Exchange : public std::enable_shared_from_this<Exchange> {
 public:
  Exchange(MHD_Connection* connection, Request its_request)
      : request(std::move(its_request)), connection_(connection) {}

  // The server's thread alone may use the following members.

  Request request;
  std::uint64_t connection_id = 0;
  bool asked = false;    ///< true: the handler has received the request
  bool begun = false;    ///< Connections::Begin was called
  bool streams = false;  ///< the answer is a stream
  /// Returns the answer. If there is no answer yet, returns nothing and suspends the connection
  /// until Answer or End is called.
  std::optional<Response> TakeOrSuspend();
  /// Takes the stream from which the answer is read. The stream's wake function calls Wake.
  void Attach(std::shared_ptr<Stream> stream);
  /// Reads from the stream as Stream::Read does. If Read returns 0, suspends the connection.
  std::ptrdiff_t Read(std::span<char> into);
  /// Must be called when the answer was sent or the connection has ended.
  void Complete();

  // Any thread may call the following functions.

  void Answer(Response response);
  /// Must be called when the stream has bytes again.
  void Wake();
  /// Must be called when the server stops. The connection is not suspended any more.
  void End();

 private:
  void Resume() BAUDGATE_REQUIRES(mutex_);

  MHD_Connection* const connection_;
  std::shared_ptr<Stream> stream_;
  Mutex mutex_;
  std::optional<Response> response_ BAUDGATE_GUARDED_BY(mutex_);
  bool suspended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool woken_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool ended_ BAUDGATE_GUARDED_BY(mutex_) = false;
  bool completed_ BAUDGATE_GUARDED_BY(mutex_) = false;
};

/// Returns the request without its body.
Request RequestOf(MHD_Connection* connection, const char* url, const char* method);

int SocketOf(MHD_Connection* connection);
/// Returns the client's address, e.g. "10.0.0.7"; empty: the address is unknown.
std::string PeerOf(MHD_Connection* connection);

/// Decodes escapes in place (e.g. "%41" becomes A) and returns the new length. "%00" is not
/// decoded, because a zero byte would end the text for libmicrohttpd.
std::size_t Unescape(void*, MHD_Connection*, char* text);

using BytesUnderWay = std::shared_ptr<std::atomic<std::size_t>>;

/// Sends an answer. `last`: the connection is closed after it.
MHD_Result Send(MHD_Connection* connection, const Response& response,
                const std::shared_ptr<Exchange>& exchange, const BytesUnderWay& bytes, bool last);

}  // namespace baudgate::web
