# Compiles the library to WebAssembly with Emscripten; scripts/cross.sh uses it.
include(/usr/share/emscripten/cmake/Modules/Platform/Emscripten.cmake)
# without Emscripten's JavaScript: exceptions are those of WebAssembly, and checks of the compiler link nothing
set(CMAKE_CXX_FLAGS_INIT -fwasm-exceptions)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
