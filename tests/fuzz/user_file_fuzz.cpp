// Fuzzes the users file. A text is refused with its line, or has users that the text of the file
// gives back.
// SPDX-License-Identifier: Apache-2.0
#include <set>
#include <string>

#include "gateway/outputs/users/user_file.h"
#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/target.h"

namespace baudgate::fuzz {
namespace {

void FuzzUserFile(View bytes) {
  const auto file = users::UserFile::Parse(std::string(bytes.begin(), bytes.end()));
  if (!file) {
    Require(file.error().starts_with("line "), "a refused file has the line");
    return;
  }
  std::set<std::string> names;
  for (const users::User& user : file->users()) {
    Require(names.insert(user.name).second, "a user is listed once");
    Require(file->Find(user.name)->role == user.role, "a user is found by name");
  }
  for (const users::Token& token : file->tokens()) {
    Require(names.contains(token.user), "a token has a user");
  }
  const std::string text = file->Text();
  const auto again = users::UserFile::Parse(text);
  Require(again.ok(), "what was read can be written and read again");
  Require(again->Text() == text, "and says the same");
  Require(again->users().size() == file->users().size(), "and has the same users");
  Require(again->tokens().size() == file->tokens().size(), "and the same tokens");
}

const Registered kUserFile("user_file", FuzzUserFile);

}  // namespace
}  // namespace baudgate::fuzz
