// TLS of all interfaces with foreign programs at the other end: stunnel and mbpoll, `openssl
// s_client`, socat and curl.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/raw_client.h"
#include "tests/system/three_devices.h"

namespace baudgate::system_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class Tls : public ThreeDevices {
 protected:
  void SetUp() override {
    for (const char* use : {"modbus", "ports", "web"}) {
      const Finished made = Command({"certs", use, File(use), "--name", "localhost"});
      ASSERT_EQ(made.code, 0) << made.errors;
      ASSERT_THAT(made.output, HasSubstr("certificate: " + File(use, "gateway.pem")));
    }
  }

  std::string File(const std::string& use, const std::string& name = {}) const {
    return (directory() / use / name).string();
  }

  /// The configuration with a listener with TLS and the page, and the line `io` behind a server
  /// with TLS.
  std::string SecureYaml() const {
    std::string yaml = Yaml();
    const auto replace = [&yaml](const std::string& old, const std::string& text) {
      yaml.replace(yaml.find(old), old.size(), text);
    };
    const auto files = [this](const char* use) {
      return "certificate: " + File(use, "gateway.pem") + ", key: " + File(use, "gateway.key");
    };
    replace("modbus: { listen: \"127.0.0.1:" + std::to_string(port()) + "\" }",
            "modbus: { listen: [\"127.0.0.1:" + std::to_string(port()) +
                "\", { at: \"127.0.0.1:" + std::to_string(secure_) + "\", protocol: tls, " +
                files("modbus") + ", ca: " + File("modbus", "ca.pem") +
                " }] }\nweb: { listen: \"127.0.0.1:" + std::to_string(web_) + "\", " +
                files("web") + " }");
    replace("port: " + LinkOf("io") + "\n",
            "port: \"tls://localhost:" + std::to_string(line_) + "\"\n    ca: " +
                File("ports", "ca.pem") + "\n    certificate: " + File("ports", "client.pem") +
                "\n    key: " + File("ports", "client.key") + "\n");
    return yaml;
  }

  std::unique_ptr<Child> Run(const std::vector<std::string>& words) const {
    return std::make_unique<Child>(words, directory(), Environment());
  }

  /// Starts stunnel, which has a certificate of `role`, and returns its port for plain Modbus.
  std::uint16_t StartTunnel(const std::string& role) {
    const std::uint16_t plain = FreePort();
    const auto file = Write(
        role + ".conf",
        "foreground = yes\npid =\n[modbus]\nclient = yes\n"
        "accept = 127.0.0.1:" +
            std::to_string(plain) + "\nconnect = 127.0.0.1:" + std::to_string(secure_) +
            "\ncert = " + File("modbus", role + ".pem") +
            "\nkey = " + File("modbus", role + ".key") + "\nCAfile = " + File("modbus", "ca.pem") +
            "\nverifyChain = yes\ncheckHost = localhost\n");
    tunnels_.push_back(Run({"stunnel4", file.string()}));
    EXPECT_TRUE(Eventually([plain] { return RawClient(plain).connected(); }));
    return plain;
  }

  Finished Poll(std::uint16_t at, std::vector<std::string> more) const {
    std::vector<std::string> words{"mbpoll", "-m", "tcp", "-p", std::to_string(at), "-a", "11",
                                   "-0",     "-1", "-o",  "5"};
    words.insert(words.end(), more.begin(), more.end());
    const auto poll = Run(words);
    const auto code = poll->WaitForEnd();
    return {code.value_or(-1), poll->Output(), poll->Errors()};
  }

  const std::uint16_t secure_ = FreePort();
  const std::uint16_t web_ = FreePort();
  const std::uint16_t line_ = FreePort();
  std::vector<std::unique_ptr<Child>> tunnels_;
};

TEST_F(Tls, IsSpokenByForeignPrograms) {
  StartTwins();
  const auto server = Run({"socat",
                           "openssl-listen:" + std::to_string(line_) +
                               ",reuseaddr,fork,cert=" + File("ports", "gateway.pem") + ",key=" +
                               File("ports", "gateway.key") + ",cafile=" + File("ports", "ca.pem"),
                           LinkOf("io") + ",rawer"});
  daemon = StartDaemon(SecureYaml());
  // A line behind a server with TLS.
  ASSERT_TRUE(EventuallyFloat(client, kModuleUnit, 0, 100.25F)) << daemon->Errors();

  // Modbus, with the roles of two certificates.
  const Finished read =
      Poll(StartTunnel("viewer"), {"-t", "3:float", "-B", "-r", "0", "127.0.0.1"});
  EXPECT_THAT(read.output, HasSubstr("100.2")) << read.errors;
  const Finished denied = Poll(StartTunnel("viewer"), {"-t", "4", "-r", "0", "127.0.0.1", "1"});
  EXPECT_THAT(denied.errors, HasSubstr("Illegal function"));
  const Finished allowed = Poll(StartTunnel("operator"), {"-t", "4", "-r", "0", "127.0.0.1", "1"});
  EXPECT_THAT(allowed.errors, ::testing::Not(HasSubstr("Illegal function")))
      << "the role may write, the point may not";

  // A client without a certificate.
  const std::vector<std::string> connect{"openssl",  "s_client",
                                         "-connect", "localhost:" + std::to_string(secure_),
                                         "-brief",   "-verify_return_error",
                                         "-CAfile",  File("modbus", "ca.pem")};
  const auto nobody = Run(connect);
  EXPECT_TRUE(EventuallyLogged(*daemon, "it has sent no certificate"));
  std::vector<std::string> with = connect;
  with.insert(with.end(), {"-cert", File("modbus", "viewer.pem"), "-key",
                           File("modbus", "viewer.key"), "-tls1_2"});
  const auto somebody = Run(with);
  EXPECT_TRUE(Eventually([&] {
    const std::string text = somebody->Output() + somebody->Errors();
    return text.find("TLSv1.2") != std::string::npos &&
           text.find("Verification: OK") != std::string::npos;
  })) << somebody->Errors();

  // The page.
  const auto page = Run({"curl", "-sS", "--cacert", File("web", "ca.pem"),
                         "https://localhost:" + std::to_string(web_) + "/api/v1/status"});
  EXPECT_EQ(page->WaitForEnd(), 0) << page->Errors();
  EXPECT_THAT(page->Output(), HasSubstr("\"lines\""));
}

TEST_F(Tls, AReloadToWrongFilesIsRefusedAndChecked) {
  const std::string yaml = WithSocket(SecureYaml());
  daemon = StartDaemon(yaml);
  const std::string file = Write("baudgate.yaml", yaml).string();
  EXPECT_THAT(Command({"check", "-c", file}).output, HasSubstr("with TLS"));
  const std::string key = File("modbus", "gateway.key");
  std::string wrong = yaml;
  wrong.replace(wrong.find(key), key.size(), File("web", "gateway.key"));
  Write("baudgate.yaml", wrong);
  const Finished reload = Ask({"reload"});
  EXPECT_NE(reload.code, 0) << reload.output;
  EXPECT_THAT(reload.errors, HasSubstr("does not belong to the certificate"));
  StartTwins();
  const Finished read = Poll(StartTunnel("viewer"), {"-t", "4", "-r", "0", "127.0.0.1"});
  EXPECT_THAT(read.output + read.errors, ::testing::Not(HasSubstr("Connection"))) << read.errors;
}

TEST_F(Tls, APortIsServedToForeignPrograms) {
  StartTwins();
  daemon = StartDaemon(Head() + "  - name: io\n    port: " + LinkOf("io") +
                       "\n    serial_server: { at: \"127.0.0.1:" + std::to_string(line_) +
                       "\", certificate: " + File("ports", "gateway.pem") +
                       ", key: " + File("ports", "gateway.key") +
                       ", client_ca: " + File("ports", "ca.pem") + " }\n");
  ASSERT_TRUE(EventuallyLogged(*daemon, "clients can connect to the port"));
  {
    const RawClient plain(line_);
    plain.Send("$01M\r");
    EXPECT_TRUE(EventuallyLogged(*daemon, "it does not speak TLS"));
  }
  const std::string pty = LinkOf("tool");
  const auto tool =
      Run({"socat", "pty,link=" + pty + ",rawer",
           "openssl:localhost:" + std::to_string(line_) + ",cafile=" + File("ports", "ca.pem") +
               ",cert=" + File("ports", "client.pem") + ",key=" + File("ports", "client.key")});
  EXPECT_TRUE(EventuallyLogged(*daemon, "CN=client")) << tool->Errors();
  EXPECT_TRUE(EventuallyLogged(*daemon, "security: login CN=client")) << tool->Errors();
  const Finished answer = Command({"read", "--port", pty, "--profile", "module", "--address", "1"});
  EXPECT_THAT(answer.output, HasSubstr("100.3")) << answer.errors << daemon->Errors();
}

}  // namespace
}  // namespace baudgate::system_test
