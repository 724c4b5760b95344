# A toolchain file: Clang as the package ziglang of PyPI brings it, which has the headers, the C library and the linker
# of every system that wheels are for. tools/cross_build.py writes the programs of AMONTONS_TOOLS (c++, ar, ranlib),
# each for AMONTONS_TARGET, a triple of zig: x86_64-linux-gnu.2.28, aarch64-macos.12.0, x86_64-windows-gnu.
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES AMONTONS_TARGET AMONTONS_TOOLS)
string(REGEX MATCH "^([^-]+)-([^-.]+)" unused ${AMONTONS_TARGET})
set(CMAKE_SYSTEM_PROCESSOR ${CMAKE_MATCH_1})
if(CMAKE_MATCH_2 STREQUAL "windows")
  set(CMAKE_SYSTEM_NAME Windows)
elseif(CMAKE_MATCH_2 STREQUAL "macos")
  set(CMAKE_SYSTEM_NAME Darwin)
  # What CMake would ask of Xcode.
  set(CMAKE_OSX_SYSROOT "" CACHE STRING "")
  set(CMAKE_INSTALL_NAME_TOOL true)
else()
  set(CMAKE_SYSTEM_NAME Linux)
endif()
set(CMAKE_CXX_COMPILER ${AMONTONS_TOOLS}/c++)
set(CMAKE_AR ${AMONTONS_TOOLS}/ar CACHE FILEPATH "")
set(CMAKE_RANLIB ${AMONTONS_TOOLS}/ranlib CACHE FILEPATH "")
set(CMAKE_CXX_COMPILER_AR ${CMAKE_AR})
set(CMAKE_CXX_COMPILER_RANLIB ${CMAKE_RANLIB})
# Checks of the compiler need no program: what links is seen when the wheel is linked.
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
