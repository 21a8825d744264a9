# Compiles programs for Linux on x86-64 with glibc 2.17 or newer by zig's clang, libc++ and linker; scripts/cross.sh creates these programs.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(zig "${CMAKE_CURRENT_LIST_DIR}/../build/linux64/zig")
set(CMAKE_C_COMPILER "${zig}/cc")
set(CMAKE_CXX_COMPILER "${zig}/c++")
set(CMAKE_AR "${zig}/ar" CACHE FILEPATH "")
set(CMAKE_RANLIB "${zig}/ranlib" CACHE FILEPATH "")
