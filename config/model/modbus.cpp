// SPDX-License-Identifier: Apache-2.0
#include "config/model/modbus.h"

namespace baudgate::modbus {

std::string ExplainOther(Framing heard, Framing expected) {
  return "it sends " + std::string(Title(heard)) + ", but this listener expects " +
         std::string(Title(expected)) + "; set framing: " + std::string(Name(heard)) +
         " at the listener, or change the master";
}

}  // namespace baudgate::modbus
