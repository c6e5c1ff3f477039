// `Certificate`, `PrivateKey`, `Bio` and others own objects of OpenSSL. Only files about TLS in
// this folder and gateway/outputs/pki use them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <openssl/bio.h>
#include <openssl/evp.h>
#include <openssl/pkcs7.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::tls {

template <auto kFree>
struct Freed {
  template <typename T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using Certificate = std::unique_ptr<X509, Freed<X509_free>>;
using PrivateKey = std::unique_ptr<EVP_PKEY, Freed<EVP_PKEY_free>>;
using Bio = std::unique_ptr<BIO, Freed<BIO_free_all>>;
using Store = std::unique_ptr<X509_STORE, Freed<X509_STORE_free>>;
using StoreContext = std::unique_ptr<X509_STORE_CTX, Freed<X509_STORE_CTX_free>>;
using Pkcs7 = std::unique_ptr<PKCS7, Freed<PKCS7_free>>;

/// Returns a Bio that reads `text`, which must outlive the Bio.
Bio Reading(const std::string& text);
std::string Written(const Bio& bio);

/// Returns the text of a file of at most 1 MiB. The error completes a sentence that begins with the
/// file's name.
Result<std::string> ReadFile(const std::string& path);
std::vector<Certificate> ParseCertificates(const std::string& pem);
/// Returns the key; null: the text is damaged, or the password is wrong. Never asks for a password
/// at the terminal.
PrivateKey ParseKey(const std::string& pem, const std::string& password);

/// Returns the subject as in the documents of DDS Security, e.g. "CN=baudgate" (RFC 2253).
std::string SubjectOf(const Certificate& certificate);
/// Returns the serial number in hexadecimal digits.
std::string SerialOf(const Certificate& certificate);
WallTime TimeOf(const ASN1_TIME* time);

}  // namespace baudgate::tls
