# Cross-compiles the library for macOS on x86-64 with zig's clang, libc++ and linker; scripts/cross.sh creates these programs.
set(CMAKE_SYSTEM_NAME Darwin)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(zig "${CMAKE_CURRENT_LIST_DIR}/../build/darwin64/zig")
set(CMAKE_C_COMPILER "${zig}/cc")
set(CMAKE_CXX_COMPILER "${zig}/c++")
set(CMAKE_AR "${zig}/ar" CACHE FILEPATH "")
set(CMAKE_RANLIB "${zig}/ranlib" CACHE FILEPATH "")
# the install location equals the link location
set(CMAKE_INSTALL_NAME_TOOL true CACHE FILEPATH "")
