// A stub of F Prime's header of this name.
#ifndef FW_STUB_ASSERT_HPP
#define FW_STUB_ASSERT_HPP
#include <cstdlib>
#define FW_ASSERT(condition) ((condition) ? (void)0 : std::abort())
#endif
