// The key web: the page for browsers, JSON for programs, metrics for Prometheus.
//
//   web:
//     listen: 127.0.0.1:8502
//     allow: [10.0.0.0/8]
//     hosts: [gate.example.com]
//     token: { file: /etc/baudgate/web.token }
//     acknowledge: allow
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/web.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// A server that listens beyond loopback without a token is a problem.
Web ReadWeb(const YamlNode& node, Problems& problems);

}  // namespace baudgate::config
