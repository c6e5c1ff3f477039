// What messages are that cannot be read, and what is said of them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "protocols/reader/rules.h"
#include "tests/protocols/reader/support.h"

namespace baudgate::protocols::reader {
namespace {

TEST(ReaderRecognise, SaysWhatIsOtherwiseThanConfigured) {
  const struct {
    std::string form;
    std::string start;
    std::string end;
    std::string heard;
    std::string cause;
    std::string length = "0";
  } rows[] = {
      {"tag", "", "0x0D", "\n-06001259E3\n>", "its lines end in a line feed alone, not in CR LF"},
      {"tag", "", "0x0D", "4006381333931\r\n",
       "it sends text ('4006381333931'), and tags are configured"},
      {"tag", "", "0x0D", "\x07\x1b;h\x01", ""},
      {"text", "0x02", "0x03", "ST,+1.5kg\x03",
       "its messages do not begin with 0x02 ('ST,+1.5kg')"},
      {"text", "0x02", "0x03", "\x02ST,+1.5kg\r\n",
       "its messages do not end with 0x03 ('ST,+1.5kg')"},
      {"text", "", "0x0D", "4006381333931", "its messages have no end character ('4006381333931')"},
      {"text", "0x02", "0x03", "\x02ST,+1.5kg\x03", ""},
      {"text", "", "0x0D", "KJJJZk:", "bytes come that are no message ('KJJJZk:')"},
      {"text", "]", "0x0D", "]40121443\r",
       "its messages have 8 characters (']40121443'), and length is 13", "13"},
      {"text", "4", "0x0D", "441230000162\r",
       "its messages have 11 characters ('441230000162'), and length is 12", "12"},
  };
  for (const auto& row : rows) {
    const config::Device device = Reader(
        {{"form", row.form}, {"start", row.start}, {"end", row.end}, {"length", row.length}});
    const auto found = Recognise({}, ToBytes(row.heard), ReadSettings(device.options));
    EXPECT_EQ(found ? found->cause : std::string(), row.cause) << row.heard;
    EXPECT_TRUE(!found || !found->remedy.empty());
  }
}

}  // namespace
}  // namespace baudgate::protocols::reader
