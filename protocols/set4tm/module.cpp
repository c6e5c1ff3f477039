// The entry of the loadable module: hands the SET-4TM descriptor to the daemon.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/protocol.h"

extern "C" const baudgate::Protocol* baudgate_protocol() { return &baudgate::Set4tmProtocol(); }
