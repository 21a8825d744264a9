// Loading and unloading the library repeatedly must not leak memory. The statically linked libstdc++ keeps a
// pool for exceptions in low memory and frees it for leak checkers only: request that here.

#include <cstddef>  // names the C++ library

#ifdef __GLIBCXX__
namespace __gnu_cxx {
void __freeres();
}

__attribute__((destructor)) static void give_back_exception_pool() { __gnu_cxx::__freeres(); }
#endif
