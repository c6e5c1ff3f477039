// Modules without an ABI tag, or with a wrong one. The loader must not call into them.
// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#ifdef ODD_TAG
extern "C" const char* baudgate_protocol_abi() { return ODD_TAG; }
#endif
#ifdef ODD_ENTRY
extern "C" const void* baudgate_protocol() { std::abort(); }
#else
extern "C" void something_else() {}
#endif
