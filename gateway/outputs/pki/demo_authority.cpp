// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/pki/demo_authority.h"

#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <array>
#include <ctime>

#include "gateway/outputs/pki/openssl.h"

namespace baudgate::pki {
namespace {

constexpr int kSerialBytes = 16;

Error OpenSslError(const std::string& what) {
  std::array<char, 256> text{};
  ERR_error_string_n(ERR_get_error(), text.data(), text.size());
  ERR_clear_error();
  return Error{what + " could not be made: " + text.data()};
}

std::time_t Seconds(WallTime time) {
  return std::chrono::floor<std::chrono::seconds>(time.time_since_epoch()).count();
}

bool SetSerial(X509* certificate) {
  std::array<unsigned char, kSerialBytes> bytes{};
  if (RAND_bytes(bytes.data(), kSerialBytes) != 1) return false;
  bytes[0] &= 0x7F;  // a positive number
  const std::unique_ptr<BIGNUM, Freed<BN_free>> number(
      BN_bin2bn(bytes.data(), kSerialBytes, nullptr));
  return BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool SetSubject(X509* certificate, const std::string& name) {
  return X509_NAME_add_entry_by_txt(X509_get_subject_name(certificate), "CN", MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(name.data()),
                                    static_cast<int>(name.size()), -1, 0) == 1;
}

bool AddExtension(X509* certificate, X509* issuer, int which, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, which, value));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

/// Signed by `issuer`, or by itself.
Result<Issued> Make(const std::string& name, const Validity& validity, X509* issuer,
                    EVP_PKEY* issuer_key) {
  const PrivateKey key(EVP_EC_gen("prime256v1"));
  const Certificate certificate(X509_new());
  X509* const raw = certificate.get();
  const bool authority = issuer == nullptr;
  if (authority) {
    issuer = raw;
    issuer_key = key.get();
  }
  const bool good = key && raw != nullptr && X509_set_version(raw, X509_VERSION_3) == 1 &&
                    SetSerial(raw) &&
                    ASN1_TIME_set(X509_getm_notBefore(raw), Seconds(validity.from)) != nullptr &&
                    ASN1_TIME_set(X509_getm_notAfter(raw), Seconds(validity.until)) != nullptr &&
                    X509_set_pubkey(raw, key.get()) == 1 && SetSubject(raw, name) &&
                    X509_set_issuer_name(raw, X509_get_subject_name(issuer)) == 1 &&
                    AddExtension(raw, issuer, NID_basic_constraints,
                                 authority ? "critical,CA:TRUE,pathlen:0" : "critical,CA:FALSE") &&
                    AddExtension(raw, issuer, NID_key_usage,
                                 authority ? "critical,keyCertSign,cRLSign,digitalSignature"
                                           : "critical,digitalSignature,keyAgreement") &&
                    AddExtension(raw, issuer, NID_subject_key_identifier, "hash") &&
                    AddExtension(raw, issuer, NID_authority_key_identifier, "keyid:always") &&
                    X509_sign(raw, issuer_key, EVP_sha256()) > 0;
  const Bio certificate_text(BIO_new(BIO_s_mem()));
  const Bio key_text(BIO_new(BIO_s_mem()));
  if (!good || PEM_write_bio_X509(certificate_text.get(), raw) != 1 ||
      PEM_write_bio_PKCS8PrivateKey(key_text.get(), key.get(), nullptr, nullptr, 0, nullptr,
                                    nullptr) != 1) {
    return OpenSslError("the certificate of " + name);
  }
  return Issued{Written(certificate_text), Written(key_text)};
}

}  // namespace

Result<Issued> MakeAuthority(const std::string& name, const Validity& validity) {
  return Make(name, validity, nullptr, nullptr);
}

Result<Issued> IssueIdentity(const Issued& authority, const std::string& name,
                             const Validity& validity) {
  const auto certificates = ParseCertificates(authority.certificate);
  const PrivateKey key = ParseKey(authority.key, {});
  if (certificates.empty() || !key) return Error{"certificate or key of the authority is damaged"};
  return Make(name, validity, certificates.front().get(), key.get());
}

Result<std::string> SignDocument(const Issued& authority, const std::string& xml) {
  constexpr int kFlags = PKCS7_TEXT | PKCS7_DETACHED | PKCS7_STREAM;
  const auto certificates = ParseCertificates(authority.certificate);
  const PrivateKey key = ParseKey(authority.key, {});
  if (certificates.empty() || !key) return Error{"certificate or key of the authority is damaged"};
  const Bio from = Reading(xml);
  const Bio to(BIO_new(BIO_s_mem()));
  const Pkcs7 signature(
      PKCS7_sign(certificates.front().get(), key.get(), nullptr, from.get(), kFlags));
  if (!signature || SMIME_write_PKCS7(to.get(), signature.get(), from.get(), kFlags) != 1) {
    return OpenSslError("a signature");
  }
  return Written(to);
}

}  // namespace baudgate::pki
