// Which protocol is meant by a name that is none.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/config/shipped.h"

namespace baudgate::testing {
namespace {

TEST(MeantProtocol, IsFoundByWhatPeopleCallIt) {
  const struct {
    const char* name;
    const char* port;
    std::string_view meant;
  } rows[] = {
      {"SPA", "/dev/ttyUSB0", "spabus"},
      {"spa", "tcp://10.0.0.5:4001", "spabus"},
      {"SPAbus", "", "spabus"},
      {"spabuss", "", "spabus"},
      {"modbus", "/dev/ttyUSB0", "modbus_rtu"},
      {"Modbus", "tcp://10.0.0.5:502", "modbus_tcp"},
      {"modbus", "tcp://10.0.0.5:4001", "modbus_rtu"},
      {"modbus-rtu", "", "modbus_rtu"},
      {"modbus_asci", "", "modbus_ascii"},
      {"owen", "", "dcon"},
      {"ADAM", "", "dcon"},
      {"mercury", "", "set4tm"},
      {"set-4tm", "", "set4tm"},
      {"telex", "", ""},
      {"", "", ""},
  };
  for (const auto& row : rows) {
    const Protocol* meant = Shipped().MeantProtocol(row.name, row.port);
    EXPECT_EQ(meant == nullptr ? "" : meant->name, row.meant) << row.name << " " << row.port;
  }
  EXPECT_EQ(Shipped().NeedProtocol("SPA").error().substr(0, 51),
            "'SPA' is not installed; did you mean 'spabus'? inst");
}

}  // namespace
}  // namespace baudgate::testing
