// One request and its answer on a connection of libmicrohttpd. Its thread asks; the answer, or the
// next bytes of a stream, may come from any other, and the connection is suspended until then. Only
// what was suspended is resumed. RequestOf reads the request, and Send sends the answer.
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

  // Used by the server's thread.

  Request request;
  std::uint64_t connection_id = 0;
  bool asked = false;  ///< the handler has it
  /// Empty: the connection is suspended until Answer or End.
  std::optional<Response> TakeOrSuspend();
  void Attach(std::shared_ptr<Stream> stream);
  /// As Stream::Read; at 0 the connection is suspended.
  std::ptrdiff_t Read(std::span<char> into);
  /// The connection is done with it, or gone.
  void Complete();

  // Used by any thread.

  void Answer(Response response);
  /// A stream has something.
  void Wake();
  /// The server stops: nothing is suspended after this.
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

// A request as libmicrohttpd has it, as a plain value.

/// Without its content.
Request RequestOf(MHD_Connection* connection, const char* url, const char* method);

int SocketOf(MHD_Connection* connection);
/// "10.0.0.7"; empty: not known.
std::string PeerOf(MHD_Connection* connection);

/// "%41" is A. A zero stays as it is written: for the library a text ends there.
std::size_t Unescape(void*, MHD_Connection*, char* text);

// An answer as libmicrohttpd sends it: with the headers that every answer has.

/// The bytes of all answers that are under way.
using BytesUnderWay = std::shared_ptr<std::atomic<std::size_t>>;

/// `last`: the connection ends behind it.
MHD_Result Send(MHD_Connection* connection, const Response& response,
                const std::shared_ptr<Exchange>& exchange, const BytesUnderWay& bytes, bool last);

}  // namespace baudgate::web
