// `Exchange` is one HTTP request and its answer on a connection of libmicrohttpd. The server's
// thread asks for the answer, or for the next bytes of a stream; any thread may supply them. The
// connection is suspended until then, and only suspended connections are resumed. `RequestOf` reads
// the request, and `Send` sends the answer.
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

  // For the server's thread only.

  Request request;
  std::uint64_t connection_id = 0;
  bool asked = false;  ///< true once the handler has received the request
  /// Returns the answer. Empty: the connection is suspended until Answer or End is called.
  std::optional<Response> TakeOrSuspend();
  /// Makes the exchange read its answer from `stream`, and receive the stream's wake calls.
  void Attach(std::shared_ptr<Stream> stream);
  /// Reads from the stream as Stream::Read does; if that returns 0, the connection is suspended.
  std::ptrdiff_t Read(std::span<char> into);
  /// To be called when the answer is sent or the connection is gone.
  void Complete();

  // For any thread.

  void Answer(Response response);
  /// To be called when the stream has bytes again.
  void Wake();
  /// To be called when the server stops: the connection is not suspended after this.
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

/// The request without its content.
Request RequestOf(MHD_Connection* connection, const char* url, const char* method);

int SocketOf(MHD_Connection* connection);
/// "10.0.0.7"; empty: not known.
std::string PeerOf(MHD_Connection* connection);

/// Decodes escapes in place ("%41" is A) and returns the new length. "%00" stays, because a zero
/// would end the text for the library.
std::size_t Unescape(void*, MHD_Connection*, char* text);

using BytesUnderWay = std::shared_ptr<std::atomic<std::size_t>>;

/// Sends an answer, with the headers that every answer has. `last`: the connection closes after it.
MHD_Result Send(MHD_Connection* connection, const Response& response,
                const std::shared_ptr<Exchange>& exchange, const BytesUnderWay& bytes, bool last);

}  // namespace baudgate::web
