// Modules that the loader must refuse: they have no ABI tag, or a wrong one. A call into such a
// module aborts the test.
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
