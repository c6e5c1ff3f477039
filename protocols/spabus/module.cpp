// The loadable module: hands the SPA Bus descriptor to the daemon, and nothing else.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/protocol.h"

extern "C" const baudgate::Protocol* baudgate_protocol() { return &baudgate::SpabusProtocol(); }
