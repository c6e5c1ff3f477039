// SPDX-License-Identifier: Apache-2.0
#include "gateway/dds/fast/refusal.h"

namespace baudgate::dds {

std::string_view Words(Refusal reason) {
  switch (reason) {
    case Refusal::none:
      return "nothing";
    case Refusal::not_rtps:
      return "not RTPS";
    case Refusal::length:
      return "a length beyond the datagram";
    case Refusal::fragment:
      return "a fragment";
    case Refusal::vendor_submessage:
      return "a vendor's submessage among others";
    case Refusal::data:
      return "broken DATA";
    case Refusal::parameters:
      return "a broken parameter list";
    case Refusal::numbers:
      return "impossible sequence numbers";
    case Refusal::window:
      return "sequence numbers that jump too far";
    case Refusal::security:
      return "DDS Security, which is not used here";
    case Refusal::participants:
      return "too many participants";
    case Refusal::address:
      return "too many participants of one address";
  }
  return "";
}

}  // namespace baudgate::dds
