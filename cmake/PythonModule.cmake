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
install(TARGETS _core LIBRARY DESTINATION amontons COMPONENT python)

# Written beside the module; python/amontons/_core.pyi is the committed copy (make stubs), compared by a test.
nanobind_add_stub(amontons_stub MODULE _core OUTPUT ${PROJECT_BINARY_DIR}/_core.pyi
                  PYTHON_PATH $<TARGET_FILE_DIR:_core> DEPENDS _core)
