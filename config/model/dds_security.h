// Which files a DDS participant proves itself with, and by which it knows others (DDS
// Security 1.1).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "config/model/fields.h"
#include "config/model/mark.h"

namespace baudgate::config {

/// Absolute paths; without `identity` DDS is open to everybody who reaches its ports.
struct DdsSecurity {
  std::string ca;              ///< certificates of the authority that issues identities
  std::string permissions_ca;  ///< of the one that signs the two documents; empty: `ca`
  std::string identity;        ///< the participant's certificate
  std::string key;             ///< its private key
  std::string password_file;   ///< holds the key's password; empty: it has none
  std::string governance;      ///< what is protected in the domain; signed
  std::string permissions;     ///< who may publish and subscribe what; signed
  Keys keys;                   ///< places in the configuration

  bool on() const { return !identity.empty(); }
  const std::string& signer() const { return permissions_ca.empty() ? ca : permissions_ca; }
};

template <typename Visit>
void VisitFields(const DdsSecurity*, Visit visit) {
  visit(Field<&DdsSecurity::ca>());
  visit(Field<&DdsSecurity::permissions_ca>());
  visit(Field<&DdsSecurity::identity>());
  visit(Field<&DdsSecurity::key>());
  visit(Field<&DdsSecurity::password_file>());
  visit(Field<&DdsSecurity::governance>());
  visit(Field<&DdsSecurity::permissions>());
  visit(Derived<&DdsSecurity::keys>());
}

/// The five files by the names that `baudgate certs dds` gives them.
inline DdsSecurity SecurityIn(const std::string& directory) {
  DdsSecurity security;
  security.ca = directory + "/ca.pem";
  security.identity = directory + "/identity.pem";
  security.key = directory + "/key.pem";
  security.governance = directory + "/governance.p7s";
  security.permissions = directory + "/permissions.p7s";
  return security;
}

}  // namespace baudgate::config
