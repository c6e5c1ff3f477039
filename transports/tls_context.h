// `Context` is what one end of a TLS connection needs: its certificate, its key, and the
// authorities that it trusts. `ContextFiles` makes a Context of files, and makes it anew when a
// file has changed. `Channel` is one encrypted connection after its handshake
// (transports/tls_handshakes.h), and `Identity` says whom the verified certificate of the other
// end names.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openssl/ssl.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "config/model/network.h"
#include "gateway/base/bytes.h"
#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "transports/openssl.h"
#include "transports/tls_files.h"

namespace baudgate::tls {

/// The object identifier of the role in certificates for Modbus (MB-TCP-Security v36, R-21).
inline constexpr const char* kRoleExtension = "1.3.6.1.4.1.50316.802.1";

/// Returns the role in a certificate; empty: the certificate has none. Error: the extension stands
/// twice, or is not exactly one UTF8String of 1 to 128 bytes (MB-TCP-Security v36, R-22).
Result<std::string> RoleOf(const X509& certificate);

/// The owner of a verified certificate.
struct Identity {
  std::string subject{};  ///< in the form of RFC 2253: "CN=pump station,O=Example"
  std::string serial{};   ///< serial number in hexadecimal digits
  std::string role{};     ///< RoleOf; empty: the certificate has no role, or a wrong one
  std::string trouble{};  ///< why the role cannot be used; empty: it can

  /// Returns "CN=pump station (4A01)"; empty: the client has no certificate.
  std::string Name() const {
    if (serial.empty()) return {};
    return (subject.empty() ? "no subject" : subject) + " (" + serial + ")";
  }
};

enum class End : std::uint8_t { server, client };

class Context {
 public:
  /// For a server, `texts.authorities` is the authority of its clients; empty: clients need no
  /// certificate. For a client it is the authority of the server, and is required; certificate and
  /// key may be missing. TLS 1.2 and 1.3 are spoken; no session is resumed, because a resumed
  /// session would not be verified again.
  static Result<std::shared_ptr<const Context>> Make(End end, const TlsTexts& texts);
  explicit Context(SSL_CTX* owned) : context_(owned) {}

  SSL_CTX* get() const { return context_.get(); }

 private:
  std::unique_ptr<SSL_CTX, Freed<SSL_CTX_free>> context_;
};

/// Any thread may call the functions.
class ContextFiles {
 public:
  ContextFiles(End end, config::TlsFiles files) : end_(end), files_(std::move(files)) {}

  End end() const { return end_; }
  /// Returns the context of the files. If a file has changed since the last call, the files are
  /// read again; if they are wrong then, the log gets a warning, and the old context stays. Error:
  /// the files have been wrong since the start (ReadTls).
  Result<std::shared_ptr<const Context>> Current();

 private:
  /// Identifies the contents of the files: device, inode, size and time of change of each.
  std::string Stamp() const;

  const End end_;
  const config::TlsFiles files_;
  Mutex mutex_;
  std::string stamp_ BAUDGATE_GUARDED_BY(mutex_);
  std::shared_ptr<const Context> context_ BAUDGATE_GUARDED_BY(mutex_);
};

// `Channel` encrypts what is written to one connected, non-blocking TCP socket, and decrypts what
// is read. All calls must come from one thread.
class Channel {
 public:
  struct Moved {
    std::size_t count = 0;
    /// would_block: no byte could be moved now; eof: the other end sends no more.
    std::error_code error{};
  };

  /// `socket` is the socket of `owned`.
  Channel(SSL* owned, int socket, Identity peer)
      : ssl_(owned), socket_(socket), peer_(std::move(peer)) {}
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  /// Passes the socket to the caller, who waits for it and closes it. Else the destructor closes
  /// it.
  int Release() { return std::exchange(socket_, -1); }

  Moved Read(std::span<std::uint8_t> space);
  Moved Write(View bytes);
  /// True if OpenSSL holds bytes that Read has not tried yet. Read must then be called without
  /// waiting for the socket, which perhaps never becomes readable again. The bytes may be a part of
  /// a record only: then Read returns would_block.
  bool HasPending() const { return !is_drained_ && SSL_has_pending(ssl_.get()) == 1; }
  /// Sends close_notify, which announces the end of the stream, if the socket takes it at once.
  /// Does not wait, and does not close the socket.
  void End();

  const Identity& peer() const { return peer_; }

 private:
  Moved Failed(int returned) const;

  std::unique_ptr<SSL, Freed<SSL_free>> ssl_;
  int socket_;
  /// True: the last Read has found no whole record, so only new bytes at the socket can give one.
  bool is_drained_ = false;
  Identity peer_;
};

}  // namespace baudgate::tls
