// Tests that `cmake --install` puts files where Debian expects them.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Installed : public Station {
 protected:
  fs::path At(const std::string& path) const {
    return directory() / "root" / fs::path(path).relative_path();
  }
};

TEST_F(Installed, AllFilesAreInTheirPlaces) {
  const Finished install = RunToEnd({CMAKE_PROGRAM, "--install", BUILD_DIRECTORY}, directory(),
                                    {{"DESTDIR", (directory() / "root").string()}});
  ASSERT_EQ(install.code, 0) << install.errors;

  const fs::path modules = At(INSTALLED_LIBRARIES "/baudgate");
  const fs::path data = At(INSTALLED_DATA "/baudgate");
  EXPECT_TRUE(fs::is_regular_file(At(INSTALLED_BINARIES "/baudgate")));
  for (const char* protocol : {"spabus", "dcon", "set4tm"}) {
    EXPECT_TRUE(fs::is_regular_file(modules / "protocols" / (std::string(protocol) + ".so")));
  }
  for (const char* profile : {"spabus/spaj140c", "dcon/owen-mv110-8a", "set4tm/set-4tm.03m"}) {
    EXPECT_TRUE(fs::is_regular_file(data / "profiles" / (std::string(profile) + ".yaml")));
  }
#ifdef CYCLONE_SUBSCRIBER
  EXPECT_TRUE(fs::is_regular_file(data / "idl/baudgate.idl"));
  EXPECT_TRUE(fs::is_regular_file(At(INSTALLED_BINARIES "/baudgate-dds")));
  const std::string dds_unit = ReadWholeFile(At(SYSTEMD_DIRECTORY "/system/baudgate-dds.service"));
  EXPECT_THAT(dds_unit, HasSubstr("\nExecStart=" INSTALLED_BINARIES
                                  "/baudgate-dds --socket /run/baudgate/dds.sock\n"));
  EXPECT_THAT(dds_unit, HasSubstr("\nUser=baudgate-dds\n"));
  EXPECT_THAT(dds_unit, HasSubstr("\nPartOf=baudgate.service\n"));
  EXPECT_THAT(dds_unit, HasSubstr("\nBefore=baudgate.service\n"))
      << "or it stops before the gateway's last words";
  const std::string discovery_unit =
      ReadWholeFile(At(SYSTEMD_DIRECTORY "/system/baudgate-discovery.service"));
  EXPECT_THAT(discovery_unit,
              HasSubstr("\nExecStart=" INSTALLED_BINARIES "/baudgate discovery-server --listen "
                        "${BAUDGATE_DISCOVERY_LISTEN}\n"));
  EXPECT_THAT(discovery_unit, HasSubstr("\nDynamicUser=yes\n"));
#endif

  const std::string unit = ReadWholeFile(At(SYSTEMD_DIRECTORY "/system/baudgate.service"));
  EXPECT_THAT(unit, HasSubstr("\nType=notify\n"));
  EXPECT_THAT(unit, HasSubstr("\nExecStart=" INSTALLED_BINARIES "/baudgate run\n"));
  EXPECT_THAT(unit, HasSubstr("\nExecReload=" INSTALLED_BINARIES "/baudgate reload\n"));
  EXPECT_THAT(unit, HasSubstr("\nConditionPathExists=/etc/baudgate/baudgate.yaml\n"));
  EXPECT_THAT(unit, HasSubstr("\nUser=baudgate\n"));
  EXPECT_THAT(unit, HasSubstr("\nRestartPreventExitStatus=3\n"));
  EXPECT_THAT(unit.substr(0, unit.find("[Service]")), HasSubstr("\nStartLimitIntervalSec=0\n"))
      << "or systemd gives up for ever after five attempts";
  EXPECT_THAT(unit, HasSubstr("\nLimitNOFILE=65536\n"));
  EXPECT_THAT(unit, HasSubstr("\nEnvironment=BAUDGATE_DDS_SOCKET=/run/baudgate/dds.sock\n"));
  EXPECT_THAT(unit, HasSubstr("\nAmbientCapabilities=CAP_NET_BIND_SERVICE\n"));
  EXPECT_THAT(unit, HasSubstr("\nWatchdogSec=10\n"));
  EXPECT_THAT(unit, HasSubstr("\nDeviceAllow=char-188 rw\n")) << "ttyUSB, loaded or not";
  EXPECT_THAT(ReadWholeFile(At(INSTALL_PREFIX "/lib/modules-load.d/baudgate.conf")),
              AllOf(HasSubstr("\nusbserial\n"), HasSubstr("\ncdc-acm\n")));
  EXPECT_THAT(ReadWholeFile(At(UDEV_DIRECTORY "/rules.d/70-baudgate.rules")),
              AllOf(HasSubstr("DRIVER==\"ftdi_sio\", ATTR{latency_timer}=\"1\""),
                    HasSubstr("SYMLINK+=\"baudgate/sn-"), HasSubstr("SYMLINK+=\"baudgate/at-")));
  EXPECT_THAT(ReadWholeFile(At(INSTALL_PREFIX "/lib/sysusers.d/baudgate.conf")),
              AllOf(HasSubstr("\nu baudgate - "), HasSubstr("\nu baudgate-dds - ")));

  const Finished protocols = RunToEnd({At(INSTALLED_BINARIES "/baudgate").string(), "protocols"},
                                      directory(), {{"BAUDGATE_MODULES", modules.string()}});
  EXPECT_EQ(protocols.code, 0) << protocols.errors;
  EXPECT_THAT(protocols.output, HasSubstr("spabus"));
  const Finished profiles =
      RunToEnd({At(INSTALLED_BINARIES "/baudgate").string(), "profiles", "spaj140c"}, directory(),
               {{"BAUDGATE_MODULES", modules.string() + ":" + data.string()}});
  EXPECT_EQ(profiles.code, 0) << profiles.errors;
  EXPECT_THAT(profiles.output, HasSubstr("current_l1"));
}

}  // namespace
}  // namespace baudgate::system_test
