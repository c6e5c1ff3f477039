// SPDX-License-Identifier: Apache-2.0
#include "tests/config/shipped.h"

#include "protocols/dcon/protocol.h"
#include "protocols/modbus/protocol.h"
#include "protocols/set4tm/protocol.h"
#include "protocols/spabus/protocol.h"

namespace baudgate::testing {

const config::Catalog& Shipped() {
  static const config::Catalog kCatalog = {{{"dcon", &DconProtocol()},
                                            {"modbus_ascii", &ModbusAsciiProtocol()},
                                            {"modbus_rtu", &ModbusRtuProtocol()},
                                            {"set4tm", &Set4tmProtocol()},
                                            {"spabus", &SpabusProtocol()}},
                                           {"config/profiles"}};
  return kCatalog;
}

}  // namespace baudgate::testing
