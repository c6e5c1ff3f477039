// SPDX-License-Identifier: Apache-2.0
#include "transports/tls_context.h"

#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <asio/error.hpp>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstring>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/base/text.h"

namespace baudgate::tls {
namespace {

constexpr int kLongestRole = 128;

using Object = std::unique_ptr<ASN1_OBJECT, Freed<ASN1_OBJECT_free>>;
using Utf8String = std::unique_ptr<ASN1_UTF8STRING, Freed<ASN1_UTF8STRING_free>>;

Error ContextError() {
  ERR_clear_error();
  return Error{"there is not enough memory for TLS"};
}

}  // namespace

Result<std::string> RoleOf(const X509& certificate) {
  const Object kind(OBJ_txt2obj(kRoleExtension, 1));
  const int at = X509_get_ext_by_OBJ(&certificate, kind.get(), -1);
  if (at < 0) return std::string();
  if (X509_get_ext_by_OBJ(&certificate, kind.get(), at) >= 0) {
    return Error{"the certificate contains its role twice"};
  }
  const ASN1_OCTET_STRING* const value = X509_EXTENSION_get_data(X509_get_ext(&certificate, at));
  const unsigned char* next = ASN1_STRING_get0_data(value);
  const unsigned char* const end = next + ASN1_STRING_length(value);
  const Utf8String text(d2i_ASN1_UTF8STRING(nullptr, &next, end - next));
  ERR_clear_error();
  unsigned char* encoded = nullptr;
  const int length = text ? i2d_ASN1_UTF8STRING(text.get(), &encoded) : -1;
  // Other encodings of the same text than DER are no role.
  const bool is_der =
      length == ASN1_STRING_length(value) &&
      std::memcmp(encoded, ASN1_STRING_get0_data(value), static_cast<std::size_t>(length)) == 0;
  OPENSSL_free(encoded);
  if (!is_der || next != end) return Error{"the role in the certificate is not one UTF8String"};
  const int size = ASN1_STRING_length(text.get());
  std::string role(reinterpret_cast<const char*>(ASN1_STRING_get0_data(text.get())),
                   static_cast<std::size_t>(size));
  if (size == 0 || size > kLongestRole || FirstNotUtf8(role) != std::string_view::npos ||
      role.find('\0') != std::string::npos) {
    return Error{"the role in the certificate is empty, too long, or not UTF-8"};
  }
  return role;
}

Result<std::shared_ptr<const Context>> Context::Make(End end, const TlsTexts& texts) {
  // OpenSSL calls write(), which would end the process if the other end has closed the connection.
  ::signal(SIGPIPE, SIG_IGN);
  const bool server = end == End::server;
  SSL_CTX* const raw = SSL_CTX_new(server ? TLS_server_method() : TLS_client_method());
  if (raw == nullptr) return ContextError();
  auto context = std::make_shared<const Context>(raw);
  SSL_CTX_set_min_proto_version(raw, TLS1_2_VERSION);
  SSL_CTX_set_options(raw, SSL_OP_NO_RENEGOTIATION | SSL_OP_NO_COMPRESSION | SSL_OP_NO_TICKET |
                               SSL_OP_CIPHER_SERVER_PREFERENCE);
  SSL_CTX_set_mode(raw, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                            SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_read_ahead(raw, 1);  // one system call for each record, not two
  SSL_CTX_set_session_cache_mode(raw, SSL_SESS_CACHE_OFF);
  SSL_CTX_set_num_tickets(raw, 0);
  if (!texts.certificate.empty()) {
    const auto chain = ParseCertificates(texts.certificate);
    const PrivateKey key = ParseKey(texts.key, {});
    if (chain.empty() || SSL_CTX_use_certificate(raw, chain.front().get()) != 1 ||
        SSL_CTX_use_PrivateKey(raw, key.get()) != 1) {
      ERR_clear_error();
      return Error{"certificate or key cannot be used for TLS: its algorithm is too weak"};
    }
    for (std::size_t i = 1; i < chain.size(); ++i) {
      if (SSL_CTX_add1_chain_cert(raw, chain[i].get()) != 1) return ContextError();
    }
  }
  if (texts.authorities.empty()) return context;
  // Every certificate in the file is trusted: an intermediate authority without its root, too.
  X509_STORE_set_flags(SSL_CTX_get_cert_store(raw), X509_V_FLAG_PARTIAL_CHAIN);
  for (const Certificate& authority : ParseCertificates(texts.authorities)) {
    if (X509_STORE_add_cert(SSL_CTX_get_cert_store(raw), authority.get()) != 1 ||
        (server && SSL_CTX_add_client_CA(raw, authority.get()) != 1)) {
      return ContextError();
    }
  }
  // A server that asks for a certificate refuses clients without one (MB-TCP-Security v36, R-06).
  SSL_CTX_set_verify(raw, SSL_VERIFY_PEER | SSL_VERIFY_FAIL_IF_NO_PEER_CERT, nullptr);
  return context;
}

std::string ContextFiles::Stamp() const {
  std::string stamp;
  for (const std::string* file : {&files_.certificate, &files_.key, &files_.authorities}) {
    struct stat its {};
    if (file->empty() || ::stat(file->c_str(), &its) != 0) {
      stamp += "-;";
      continue;
    }
    stamp += fmt::format("{}:{}:{}:{}.{};", its.st_dev, its.st_ino, its.st_size, its.st_mtim.tv_sec,
                         its.st_mtim.tv_nsec);
  }
  return stamp;
}

Result<std::shared_ptr<const Context>> ContextFiles::Current() {
  const MutexLock lock(mutex_);
  std::string stamp = Stamp();
  if (context_ && stamp == stamp_) return context_;
  stamp_ = std::move(stamp);
  const auto texts = ReadTls(files_);
  auto made = texts ? Context::Make(end_, *texts)
                    : Result<std::shared_ptr<const Context>>(Error{texts.error()});
  if (!made && context_) {
    log::Warn("tls: {}; the certificates that were read before stay in use", made.error());
  } else if (made && context_) {
    log::Info("tls: the changed certificates in {} are in use for new connections",
              files_.certificate.empty() ? files_.authorities : files_.certificate);
  }
  if (made) context_ = *made;
  if (context_) return context_;
  return made;
}

Channel::~Channel() {
  if (socket_ >= 0) ::close(socket_);
}

Channel::Moved Channel::Failed(int returned) const {
  switch (SSL_get_error(ssl_.get(), returned)) {
    case SSL_ERROR_WANT_READ:
    case SSL_ERROR_WANT_WRITE:
      return {0, asio::error::would_block};
    case SSL_ERROR_ZERO_RETURN:
      return {0, asio::error::eof};
    case SSL_ERROR_SYSCALL: {
      const int error = errno;
      ERR_clear_error();
      if (error == 0) return {0, asio::error::eof};
      return {0, std::error_code(error, std::system_category())};
    }
    default:
      break;
  }
  // Many programs close TCP without the announcement that TLS wants.
  const bool cut = ERR_GET_REASON(ERR_peek_error()) == SSL_R_UNEXPECTED_EOF_WHILE_READING;
  ERR_clear_error();
  if (cut) return {0, asio::error::eof};
  return {0, std::make_error_code(std::errc::protocol_error)};
}

Channel::Moved Channel::Read(std::span<std::uint8_t> space) {
  const int most = static_cast<int>(std::min<std::size_t>(space.size(), INT_MAX));
  errno = 0;
  const int count = SSL_read(ssl_.get(), space.data(), most);
  is_drained_ = count <= 0;
  return count > 0 ? Moved{static_cast<std::size_t>(count)} : Failed(count);
}

Channel::Moved Channel::Write(View bytes) {
  if (bytes.empty()) return {};
  const int most = static_cast<int>(std::min<std::size_t>(bytes.size(), INT_MAX));
  errno = 0;
  const int count = SSL_write(ssl_.get(), bytes.data(), most);
  return count > 0 ? Moved{static_cast<std::size_t>(count)} : Failed(count);
}

void Channel::End() {
  SSL_shutdown(ssl_.get());
  ERR_clear_error();
}

}  // namespace baudgate::tls
