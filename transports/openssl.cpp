// SPDX-License-Identifier: Apache-2.0
#include "transports/openssl.h"

#include <openssl/err.h>
#include <openssl/pem.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>

namespace baudgate::tls {
namespace {

constexpr std::size_t kLongestFile = 1U << 20;

/// Password callback for OpenSSL, which without a callback would ask for the password at the
/// terminal.
int GivePassword(char* to, int size, int, void* password) {
  const auto& text = *static_cast<const std::string*>(password);
  if (text.size() > static_cast<std::size_t>(size)) return -1;
  std::ranges::copy(text, to);
  return static_cast<int>(text.size());
}

}  // namespace

Bio Reading(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::string Written(const Bio& bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio.get(), &data);
  return size > 0 ? std::string(data, static_cast<std::size_t>(size)) : std::string();
}

Result<std::string> ReadFile(const std::string& path) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text(kLongestFile + 1, '\0');
  if (!file || !file.read(text.data(), static_cast<std::streamsize>(text.size())).eof()) {
    if (file) return Error{"is longer than 1 MiB"};
    return Error{std::string("cannot be read: ") + std::strerror(errno != 0 ? errno : EIO)};
  }
  text.resize(static_cast<std::size_t>(file.gcount()));
  return text;
}

std::vector<Certificate> ParseCertificates(const std::string& pem) {
  std::vector<Certificate> found;
  const Bio from = Reading(pem);
  while (X509* one = PEM_read_bio_X509(from.get(), nullptr, nullptr, nullptr)) {
    found.emplace_back(one);
  }
  ERR_clear_error();  // reading behind the last certificate has left an error
  return found;
}

PrivateKey ParseKey(const std::string& pem, const std::string& password) {
  const Bio from = Reading(pem);
  PrivateKey key(PEM_read_bio_PrivateKey(from.get(), nullptr, GivePassword,
                                         const_cast<std::string*>(&password)));
  ERR_clear_error();
  return key;
}

std::string SubjectOf(const Certificate& certificate) {
  const Bio to(BIO_new(BIO_s_mem()));
  X509_NAME_print_ex(to.get(), X509_get_subject_name(certificate.get()), 0,
                     XN_FLAG_RFC2253 & ~static_cast<unsigned long>(ASN1_STRFLGS_ESC_MSB));
  return Written(to);
}

std::string SerialOf(const Certificate& certificate) {
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate.get()), nullptr));
  char* const text = number ? BN_bn2hex(number.get()) : nullptr;
  if (text == nullptr) return {};
  std::string serial = text;
  OPENSSL_free(text);
  return serial;
}

WallTime TimeOf(const ASN1_TIME* time) {
  std::tm parts{};
  if (ASN1_TIME_to_tm(time, &parts) != 1) return {};
  return WallTime(std::chrono::seconds(::timegm(&parts)));
}

}  // namespace baudgate::tls
