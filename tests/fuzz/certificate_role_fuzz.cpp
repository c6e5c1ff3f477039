// Fuzzes the role extension of certificates for Modbus, and whole certificates in DER form.
// Input: 0 and a certificate; or another byte, and values of the role extension, each behind its
// length byte.
// SPDX-License-Identifier: Apache-2.0
#include <openssl/asn1.h>
#include <openssl/err.h>
#include <openssl/objects.h>
#include <openssl/x509v3.h>

#include <memory>
#include <string>
#include <vector>

#include "gateway/base/text.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"
#include "transports/tls_context.h"

namespace baudgate::fuzz {
namespace {

using tls::Certificate;
using tls::Freed;

void CheckRole(const Result<std::string>& role) {
  if (!role) {
    Require(!role.error().empty(), "a refused role has a reason");
    return;
  }
  Require(role->size() <= 128, "a role is bounded");
  Require(FirstNotUtf8(*role) == std::string_view::npos, "a role is UTF-8");
  Require(role->find('\0') == std::string::npos, "a role has no NUL");
}

void Extend(X509& certificate, View value) {
  using Object = std::unique_ptr<ASN1_OBJECT, Freed<ASN1_OBJECT_free>>;
  using Octets = std::unique_ptr<ASN1_OCTET_STRING, Freed<ASN1_OCTET_STRING_free>>;
  using Extension = std::unique_ptr<X509_EXTENSION, Freed<X509_EXTENSION_free>>;
  const Object kind(OBJ_txt2obj(tls::kRoleExtension, 1));
  const Octets octets(ASN1_OCTET_STRING_new());
  ASN1_OCTET_STRING_set(octets.get(), value.data(), static_cast<int>(value.size()));
  const Extension extension(X509_EXTENSION_create_by_OBJ(nullptr, kind.get(), 0, octets.get()));
  X509_add_ext(&certificate, extension.get(), -1);
}

void FuzzCertificateRole(View bytes) {
  Input input(bytes);
  if (input.U8() == 0) {
    const View der = input.Rest();
    const unsigned char* next = der.data();
    const Certificate certificate(d2i_X509(nullptr, &next, static_cast<long>(der.size())));
    ERR_clear_error();
    if (certificate) CheckRole(tls::RoleOf(*certificate));
    return;
  }
  const Certificate certificate(X509_new());
  std::vector<View> values;
  while (!input.empty() && values.size() < 3) {
    values.push_back(input.TakeCounted());
    Extend(*certificate, values.back());
  }
  const auto role = tls::RoleOf(*certificate);
  CheckRole(role);
  Require(ERR_peek_error() == 0, "no error is left for the next call of OpenSSL");
  if (values.empty()) Require(role && role->empty(), "without the extension there is no role");
  if (values.size() > 1) Require(!role.ok(), "the extension stands once");
  if (values.size() != 1) return;
  Require(!role || !role->empty(), "an empty role is refused");
  const View value = values.front();
  const bool is_plain =
      value.size() > 2 && value[0] == 0x0C && value[1] < 0x80 && value[1] == value.size() - 2;
  if (!is_plain) return;
  const std::string text(value.begin() + 2, value.end());
  const bool fits =
      FirstNotUtf8(text) == std::string_view::npos && text.find('\0') == std::string::npos;
  Require(role.ok() == fits, "a plain UTF8String is the role, unless it is not UTF-8");
  if (fits) Require(*role == text, "and it is the whole role");
}

const Registered kCertificateRole("certificate_role", FuzzCertificateRole);

}  // namespace
}  // namespace baudgate::fuzz
