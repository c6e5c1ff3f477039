// The one symbol of the loadable module: hands the descriptor in protocol.cpp to the daemon.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/protocol.h"

extern "C" const baudgate::Protocol* baudgate_protocol() { return &baudgate::DconProtocol(); }
