// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/permission.h"

#include "protocols/modbus/pdu/modbus_pdu.h"

namespace baudgate::modbus {

bool Permits(config::Permit permit, std::uint8_t function) {
  switch (permit) {
    case config::Permit::read:
      return IsRead(function);
    case config::Permit::data:
      return IsRead(function) || IsPlainWrite(function);
    case config::Permit::all:
      return true;
  }
  return false;
}

}  // namespace baudgate::modbus
