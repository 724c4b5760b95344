# The module amontons._core, of the stable ABI from Python 3.12 on, and its generated stub.
execute_process(COMMAND ${Python_EXECUTABLE} -m nanobind --cmake_dir
                OUTPUT_VARIABLE nanobind_ROOT OUTPUT_STRIP_TRAILING_WHITESPACE)
find_package(nanobind CONFIG REQUIRED)

file(GLOB bindings CONFIGURE_DEPENDS bindings/*.cpp)
nanobind_add_module(_core STABLE_ABI NB_STATIC NB_SUPPRESS_WARNINGS ${bindings})
target_link_libraries(_core PRIVATE amontons)
amontons_settings(_core)
# nanobind 3.1 uses stderr in its headers, and Python.h of the stable ABI does not bring <stdio.h>, as that of 3.11 does.
if(TARGET nanobind-static-abi3)
  target_compile_options(nanobind-static-abi3 PUBLIC -include cstdio)
endif()
amontons_unite_in_batches(_core 4)
foreach(runtime nanobind-static nanobind-static-abi3)
  if(TARGET ${runtime})
    amontons_unite_in_batches(${runtime} 0)
    amontons_hide_folders(${runtime})
    # Outside the folder of the project, in an environment that pip makes anew for each build.
    target_compile_options(${runtime} PRIVATE $<$<BOOL:${AMONTONS_HAS_PREFIX_MAP}>:-ffile-prefix-map=${NB_DIR}/=nanobind/>)
  endif()
endforeach()
install(TARGETS _core LIBRARY DESTINATION amontons COMPONENT python)
# The files of amontons.examples, which programs outside a clone read.
install(DIRECTORY examples/models examples/problems examples/assemblies DESTINATION amontons/example_files COMPONENT python)

# What is compiled into the module, for amontons-VERSION.dist-info/sboms of the wheel (PEP 770).
include(CheckCXXSourceCompiles)
check_cxx_source_compiles("#include <cstddef>\n#ifndef _LIBCPP_VERSION\n#error\n#endif\nint main() {}" AMONTONS_HAS_LIBCXX)
check_cxx_source_compiles("#include <cstddef>\n#ifndef __GLIBCXX__\n#error\n#endif\nint main() {}" AMONTONS_HAS_LIBSTDCXX)
set(runtime $<IF:$<BOOL:${AMONTONS_HAS_LIBCXX}>,libc++,$<$<BOOL:${AMONTONS_HAS_LIBSTDCXX}>:libstdc++>>)
set(sbom ${PROJECT_BINARY_DIR}/amontons.cdx.json)
add_custom_command(TARGET _core POST_BUILD
  COMMAND ${Python_EXECUTABLE} ${PROJECT_SOURCE_DIR}/tools/make_sbom.py --module $<TARGET_FILE:_core>
          --include ${NB_DIR}/include --include ${NB_DIR}/ext/robin_map/include
          --include ${AMONTONS_EIGEN_INCLUDE_DIR} --include ${AMONTONS_JSON_INCLUDE_DIR}
          "--runtime=${runtime}" "--compiler=${CMAKE_CXX_COMPILER_ID} ${CMAKE_CXX_COMPILER_VERSION}"
          --system ${CMAKE_SYSTEM_NAME} -o ${sbom}
  BYPRODUCTS ${sbom} VERBATIM)
if(SKBUILD_METADATA_DIR)
  install(FILES ${sbom} DESTINATION ${SKBUILD_METADATA_DIR}/sboms COMPONENT python)
endif()

# Written beside the module; python/amontons/_core.pyi is the committed copy (make stubs), compared by a test.
nanobind_add_stub(amontons_stub MODULE _core OUTPUT ${PROJECT_BINARY_DIR}/_core.pyi
                  PYTHON_PATH $<TARGET_FILE_DIR:_core> DEPENDS _core)
