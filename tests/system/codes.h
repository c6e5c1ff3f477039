// Codes of the gateway: Modbus exceptions, qualities over Modbus, exit codes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace baudgate::system_test {

inline constexpr int kIllegalFunction = 0x01;
inline constexpr int kIllegalAddress = 0x02;
inline constexpr int kIllegalValue = 0x03;
inline constexpr int kBusy = 0x06;
inline constexpr int kNoPath = 0x0A;
inline constexpr int kNotAnswering = 0x0B;

inline constexpr int kNotConnected = 0x08;
inline constexpr int kGood = 0xC0;

inline constexpr int kUsage = 2;
inline constexpr int kBadConfiguration = 3;
inline constexpr int kCannotOpen = 4;

}  // namespace baudgate::system_test
