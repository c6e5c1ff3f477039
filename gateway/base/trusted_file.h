// `WhyNotTrusted` checks that no other user of this machine can change a file that the gateway
// executes or believes: a protocol module, a profile, a token, its state.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace baudgate {

/// Returns why users other than root and the user of this process could change the file or folder,
/// with the remedy: "/srv/modules/dcon.so can be changed by user 'anna': run: chown root …". Empty:
/// they cannot, or the file does not exist.
///
/// Checked are the file behind symbolic links and all folders above the file and above the link:
/// each must belong to root or this user, and must not be writable for group or others. A folder
/// with the sticky bit, such as /tmp, may be writable, because nobody can replace the files of
/// others in it.
std::string WhyNotTrusted(const std::filesystem::path& file);

}  // namespace baudgate
