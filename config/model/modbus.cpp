// SPDX-License-Identifier: Apache-2.0
#include "config/model/modbus.h"

namespace baudgate::modbus {

std::string ExplainOther(Framing heard, Framing expected) {
  return "it speaks " + std::string(Title(heard)) + ", and " + std::string(Title(expected)) +
         " is spoken here; set framing: " + std::string(Name(heard)) +
         " at the listener, or change the other side";
}

}  // namespace baudgate::modbus
