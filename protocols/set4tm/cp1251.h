// Windows-1251 text of a meter (its metering point's name) to and from UTF-8.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"

namespace baudgate::protocols::set4tm {

/// Up to the first zero byte, without blanks at the end; control bytes become '?'.
std::string FromCp1251(View bytes);
/// Characters that Windows-1251 does not have become '?'.
Bytes ToCp1251(std::string_view utf8);

}  // namespace baudgate::protocols::set4tm
