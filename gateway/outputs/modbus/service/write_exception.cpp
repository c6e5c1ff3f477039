// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/write_exception.h"

namespace baudgate::modbus {

ExceptionCode ExceptionOf(const WriteDenial& denial) {
  switch (denial.why) {
    case WriteDenial::Why::read_only:
      return kIllegalAddress;
    case WriteDenial::Why::value:
      return kIllegalValue;
    case WriteDenial::Why::busy:
      return kBusy;
    case WriteDenial::Why::not_selected:
    case WriteDenial::Why::locked:
      break;
  }
  return kDeviceFailure;
}

ExceptionCode ExceptionOf(const WriteResult& result) {
  if (result.unfit) return kIllegalValue;
  switch (result.end) {
    case WriteEnd::ok:
      return kNoException;
    case WriteEnd::differs:
    case WriteEnd::refused:
    case WriteEnd::denied:
      return kDeviceFailure;
    case WriteEnd::busy:
      return kBusy;
    case WriteEnd::unknown:
    case WriteEnd::not_sent:
      break;
  }
  return kNoTarget;
}

}  // namespace baudgate::modbus
