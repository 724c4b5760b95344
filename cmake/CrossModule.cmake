# The module amontons._core for a Python that does not run here. nanobind's own functions and FindPython ask an
# interpreter; here AMONTONS_CROSS_MODULES names what they would find, an entry for each module:
#   NAME=HEADERS[=LIBRARY]    abi3=/path/include/python3.12=/path/libpython3.a
# NAME is abi3 (stable ABI from Python 3.12 on) or cp311; LIBRARY is the import library that Windows needs. The target
# _core_NAME makes NAME/_core.abi3.so, whose suffix tools/wheel_targets.py turns into that of the system.
file(GLOB bindings CONFIGURE_DEPENDS bindings/*.cpp)
execute_process(COMMAND ${AMONTONS_HOST_PYTHON} -m nanobind --include_dir
                OUTPUT_VARIABLE nanobind_include OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
get_filename_component(nanobind_root ${nanobind_include} DIRECTORY)

# The linker of zig 0.17 fails on a bundle, which CMake makes of a module for macOS. Python loads a library too. The name
# that it carries is that of the file, without a folder.
if(APPLE)
  set(CMAKE_SHARED_MODULE_CREATE_CXX_FLAGS -shared)
endif()

add_custom_target(amontons_modules)
foreach(entry IN LISTS AMONTONS_CROSS_MODULES)
  string(REPLACE "=" ";" entry ${entry})
  list(GET entry 0 name)
  list(GET entry 1 headers)
  set(module _core_${name})
  # nanobind's own sources in one object: their warnings are theirs.
  add_library(nanobind_${name} OBJECT ${nanobind_root}/src/nb_combined.cpp)
  target_compile_features(nanobind_${name} PRIVATE cxx_std_20)
  target_compile_definitions(nanobind_${name} PRIVATE NB_BUILD NB_COMPACT_ASSERTIONS)
  target_compile_options(nanobind_${name} PRIVATE -w -Os -fno-strict-aliasing
    -ffile-prefix-map=${nanobind_root}/=nanobind/)
  set_target_properties(nanobind_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON CXX_VISIBILITY_PRESET hidden)
  add_library(${module} MODULE ${bindings})
  target_link_libraries(${module} PRIVATE amontons nanobind_${name})
  foreach(target ${module} nanobind_${name})
    target_include_directories(${target} SYSTEM PRIVATE ${headers} ${nanobind_include} ${nanobind_root}/ext/robin_map/include)
    target_compile_options(${target} PRIVATE -include cstdio)
    if(name STREQUAL "abi3")
      target_compile_definitions(${target} PRIVATE Py_LIMITED_API=0x030C0000)
    endif()
  endforeach()
  amontons_settings(${module})
  amontons_unite_in_batches(${module} 4)
  amontons_hide_folders(nanobind_${name})
  # As nanobind compiles modules: bindings are large and cold.
  target_compile_options(${module} PRIVATE -w -Os -fno-strict-aliasing)
  if(WIN32)
    list(GET entry 2 library)
    target_link_libraries(${module} PRIVATE ${library})
  elseif(APPLE)
    target_link_options(${module} PRIVATE -undefined dynamic_lookup -Wl,-install_name,@rpath/_core.so)
  else()
    target_link_options(${module} PRIVATE -Wl,--gc-sections)
  endif()
  target_link_options(${module} PRIVATE -s)
  set_target_properties(${module} PROPERTIES
    PREFIX "" OUTPUT_NAME _core SUFFIX ".built" LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/${name})
  add_dependencies(amontons_modules ${module})
endforeach()
