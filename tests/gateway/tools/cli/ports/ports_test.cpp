// Tests of `baudgate ports` with folders that look like /sys, /dev and /proc.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/ports/ports.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "gateway/base/system_trouble.h"

namespace baudgate::tools {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

class Ports : public ::testing::Test {
 protected:
  Ports() {
    std::string form = (fs::temp_directory_path() / "baudgate-ports-XXXXXX").string();
    root_ = ::mkdtemp(form.data());
    place_.root = root_;
    fs::create_directories(root_ / "sys/class/tty/tty0");
  }
  ~Ports() override { fs::remove_all(root_); }

  void Write(const fs::path& file, const std::string& text) const {
    fs::create_directories((root_ / file).parent_path());
    std::ofstream(root_ / file) << text << '\n';
  }
  void Link(const fs::path& link, const fs::path& target) const {
    fs::create_directories((root_ / link).parent_path());
    fs::create_symlink(target, root_ / link);
  }
  /// Adds a port of a usb-serial driver, as Linux 6.1 shows it.
  void AddUsb(const std::string& name, const std::string& at, const std::string& driver,
              const std::string& ids, const std::string& serial) const {
    const fs::path adapter = "sys/devices/pci0000:00/0000:00:14.0/usb1/" + at;
    const fs::path port = adapter / (at + ":1.0") / name;
    Write(adapter / "idVendor", ids.substr(0, 4));
    Write(adapter / "idProduct", ids.substr(5));
    Write(adapter / "manufacturer", "FTDI");
    Write(adapter / "product", "FT232R USB UART");
    if (!serial.empty()) Write(adapter / "serial", serial);
    Write(adapter / (at + ":1.0") / "bInterfaceNumber", "00");
    if (driver == "ftdi_sio") Write(port / "latency_timer", "16");
    Link(port / "driver", "/sys/bus/usb-serial/drivers/" + driver);
    Link("sys/class/tty/" + name + "/device", root_ / port);
    Write("dev/" + name, "");
  }
  std::string Shown() const {
    std::ostringstream out;
    EXPECT_EQ(ShowPorts(false, place_, out), 0);
    return out.str();
  }
  Json AsJson() const {
    std::ostringstream out;
    EXPECT_EQ(ShowPorts(true, place_, out), 0);
    return Json::parse(out.str());
  }

  fs::path root_;
  PortsPlace place_;
};

TEST_F(Ports, WithoutAPortASentenceIsPrinted) {
  EXPECT_THAT(Shown(), HasSubstr("This machine has no serial port. Plug an adapter in"));
  EXPECT_THAT(AsJson()["ports"], IsEmpty());
}

TEST_F(Ports, AnFtdiAdapterIsShownWithAllItsNames) {
  AddUsb("ttyUSB0", "1-1.2", "ftdi_sio", "0403:6001", "FT1A2B3C");
  Link("dev/serial/by-id/usb-FTDI_FT232R_USB_UART_FT1A2B3C-if00-port0", "../../ttyUSB0");
  Link("dev/serial/by-path/pci-0000:00:14.0-usb-0:1.2:1.0-port0", "../../ttyUSB0");
  Link("dev/baudgate/sn-FT1A2B3C", "../ttyUSB0");
  Link("dev/baudgate/at-pci-0000_00_14_0-usb-0_1_2_1_0", "../ttyUSB0");
  const auto found = FindPorts(root_);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].path(), "/dev/ttyUSB0");
  EXPECT_EQ(found[0].driver, "ftdi_sio");
  EXPECT_EQ(found[0].at, "1-1.2");
  EXPECT_EQ(found[0].vendor + ":" + found[0].product, "0403:6001");
  EXPECT_EQ(found[0].serial, "FT1A2B3C");
  EXPECT_EQ(found[0].interface, "00");
  EXPECT_EQ(found[0].latency_ms, 16);
  EXPECT_THAT(found[0].links,
              ElementsAre("/dev/baudgate/sn-FT1A2B3C",
                          "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_FT1A2B3C-if00-port0",
                          "/dev/baudgate/at-pci-0000_00_14_0-usb-0_1_2_1_0",
                          "/dev/serial/by-path/pci-0000:00:14.0-usb-0:1.2:1.0-port0"));
  const std::string shown = Shown();
  EXPECT_THAT(shown, HasSubstr("0403:6001 FT232R USB UART"));
  EXPECT_THAT(shown, HasSubstr("/dev/baudgate/sn-FT1A2B3C"));
  EXPECT_THAT(shown, HasSubstr("ttyUSB0: the adapter delays bytes by up to 16 ms"));
  const Json port = AsJson()["ports"][0];
  EXPECT_EQ(port["port"], "/dev/ttyUSB0");
  EXPECT_EQ(port["usb"]["serial"], "FT1A2B3C");
  EXPECT_EQ(port["latency_ms"], 16);
  EXPECT_EQ(port["names"].size(), 4U);
}

/// All CP210x adapters have the serial number 0001, so the link by id names the latest adapter.
TEST_F(Ports, AdaptersWithEqualSerialNumbersAreNamedByPlace) {
  AddUsb("ttyUSB0", "1-1", "cp210x", "10c4:ea60", "0001");
  AddUsb("ttyUSB1", "1-2", "cp210x", "10c4:ea60", "0001");
  Link("dev/serial/by-id/usb-Silicon_Labs_CP2102_0001-if00-port0", "../../ttyUSB1");
  Link("dev/serial/by-path/pci-0000:00:14.0-usb-0:1:1.0-port0", "../../ttyUSB0");
  Link("dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0", "../../ttyUSB1");
  const auto found = FindPorts(root_);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_THAT(found[1].links,
              ElementsAre("/dev/serial/by-path/pci-0000:00:14.0-usb-0:2:1.0-port0"));
  EXPECT_THAT(Shown(), HasSubstr("another adapter has the same serial number 0001"));
  EXPECT_FALSE(found[0].latency_ms);
}

/// Since Linux 6.5 the path of a port contains two more devices, here ctrl0 and port0. A "type" of
/// 0 is an address without a UART.
TEST_F(Ports, PortsOfTheBoardAreShown) {
  for (const std::string name : {"ttyS10", "ttyS2"}) {
    const fs::path base = "sys/devices/pnp0/" + name;
    Link(base / "driver", "/sys/bus/pnp/drivers/serial");
    Link(base / "ctrl0/driver", "/sys/bus/serial-base/drivers/ctrl");
    Link(base / "ctrl0/port0/driver", "/sys/bus/serial-base/drivers/port");
    Link("sys/class/tty/" + name + "/device", root_ / base / "ctrl0/port0");
    Write("sys/class/tty/" + name + "/type", "4");
  }
  Link("sys/class/tty/ttyS3/device", root_ / "sys/devices/pnp0/ttyS2");
  Write("sys/class/tty/ttyS3/type", "0");
  const auto found = FindPorts(root_);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].name, "ttyS2");
  EXPECT_EQ(found[1].name, "ttyS10");
  EXPECT_EQ(found[0].driver, "serial");
  EXPECT_FALSE(found[0].is_usb());
}

TEST_F(Ports, ProgramsAndLinesThatUseAPortAreShown) {
  AddUsb("ttyUSB0", "1-1", "ftdi_sio", "0403:6001", "A");
  AddUsb("ttyUSB1", "1-2", "ftdi_sio", "0403:6001", "B");
  Link("dev/serial/by-id/usb-A", "../../ttyUSB0");
  Write("proc/77/comm", "minicom");
  Link("proc/77/fd/3", "/dev/ttyUSB1");
  Link("proc/77/fd/4", "/dev/ttyUSB1");
  Link("proc/77/fd/5", "socket:[4711]");
  Write("proc/78/comm", "baudgate");
  Link("proc/78/fd/9", "/dev/ttyUSB0");
  place_.status = [] {
    return Json{{"gateway", "plant"},
                {"lines",
                 {{{"name", "bay"}, {"port", "/dev/serial/by-id/usb-A"}, {"port_state", "open"}},
                  {{"name", "io"},
                   {"port", "/dev/ttyUSB1"},
                   {"port_state", "closed"},
                   {"port_text", "/dev/ttyUSB1 is in use by minicom (pid 77)"}}}},
                {"modbus", {{"masters", Json::array()}}}};
  };
  const Json ports = AsJson()["ports"];
  EXPECT_EQ(ports[0]["held_by"], Json({"line bay of plant (open)"}));
  EXPECT_THAT(ports[0]["advice"], IsEmpty()) << "the gateway has set its latency";
  EXPECT_EQ(ports[1]["held_by"], Json({"line io of plant (closed)", "minicom (pid 77)"}));
  EXPECT_THAT(Shown(), HasSubstr("ttyUSB1: line io: /dev/ttyUSB1 is in use by minicom (pid 77)"));
}

TEST_F(Ports, MissingPermissionsAreShown) {
  AddUsb("ttyUSB0", "1-1", "cp210x", "10c4:ea60", "X");
  fs::permissions(root_ / "dev/ttyUSB0", fs::perms::none);
  place_.people = {{"nobody", 65534, {65534}, false}};
  EXPECT_THAT(Shown(), HasSubstr("ttyUSB0: you (nobody) may not open /dev/ttyUSB0; run: sudo "));
  fs::permissions(root_ / "dev/ttyUSB0", fs::perms::all);
  EXPECT_THAT(Shown(), Not(HasSubstr("may not open")));
}

TEST_F(Ports, ControlCharactersInAdapterNamesAreRemoved) {
  AddUsb("ttyUSB0", "1-1", "cp210x", "10c4:ea60", "\x1b]0;x\x07");
  EXPECT_THAT(FindPorts(root_)[0].serial, Not(HasSubstr("\x1b")));
}

TEST_F(Ports, AConfiguredPathIsResolvedToItsPort) {
  Link("dev/serial/by-id/usb-A", "../../ttyUSB0");
  Link("dev/mine", "serial/by-id/usb-A");
  Link("dev/round", "round");
  EXPECT_EQ(PortNameOf(root_, "/dev/mine"), "ttyUSB0");
  EXPECT_EQ(PortNameOf(root_, "/dev/ttyUSB0"), "ttyUSB0");
  EXPECT_EQ(PortNameOf(root_, "/dev/pts/4"), "");
  EXPECT_EQ(PortNameOf(root_, "tcp://10.0.0.5:4001"), "");
  EXPECT_EQ(PortNameOf(root_, "/dev/round"), "round");
}

constexpr gid_t kDialout = 20;
const PortFile kUsual{"/dev/ttyUSB0", 0, kDialout, "dialout", 0660};
const Person kAnna{"anna", 1000, {1000}, false};
const Person kMember{"berta", 1001, {1001, kDialout}, false};
const Person kService{"baudgate", 990, {990, kDialout}, true};

TEST(PortRights, TheUsualPortNeedsItsGroup) {
  EXPECT_TRUE(MayUse(kMember, kUsual));
  EXPECT_TRUE(MayUse(kService, kUsual));
  EXPECT_TRUE(MayUse({"root", 0, {0}, false}, kUsual));
  EXPECT_FALSE(MayUse(kAnna, kUsual));
  EXPECT_EQ(HowToMend(kAnna, kUsual),
            "you (anna) may not open /dev/ttyUSB0; run: sudo usermod -aG dialout anna, then log in "
            "again");
}

/// The first class that matches (owner, group, others) decides, even if a later one has more
/// rights.
TEST(PortRights, FollowTheRulesOfTheKernel) {
  PortFile file = kUsual;
  file.mode = 0606;
  EXPECT_FALSE(MayUse(kMember, file));
  EXPECT_TRUE(MayUse(kAnna, file));
  file.owner = kAnna.id;
  file.mode = 0466;
  EXPECT_FALSE(MayUse(kAnna, file));
}

TEST(PortRights, AGroupWithoutPermissionsIsNotSuggested) {
  PortFile file{"/dev/ttyACM0", 0, 0, "root", 0600};
  EXPECT_FALSE(MayUse(kService, file));
  EXPECT_EQ(HowToMend(kService, file),
            "the service (user baudgate) may not open /dev/ttyACM0; run: sudo chgrp dialout "
            "/dev/ttyACM0 && "
            "sudo chmod 660 /dev/ttyACM0; to keep this after a restart, add a udev rule");
}

TEST(PortRights, TheServiceGetsAnotherGroupThroughItsUnit) {
  const PortFile file{"/dev/ttyX0", 0, 42, "plant", 0660};
  EXPECT_FALSE(MayUse(kService, file));
  EXPECT_EQ(
      HowToMend(kService, file),
      "the service (user baudgate) may not open /dev/ttyX0; run: sudo systemctl edit baudgate, "
      "with [Service] and SupplementaryGroups=plant, then sudo systemctl restart baudgate");
}

}  // namespace
}  // namespace baudgate::tools
