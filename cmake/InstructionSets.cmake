# Kernels (src/*/*.isa.cpp) are compiled once per instruction set, each into its own namespace
# amontons::AMONTONS_ISA; include/amontons/base/isa.hpp chooses among them at run time.
# Threads share their work alike in every set: the thread sanitizer takes one.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$" AND CMAKE_SIZEOF_VOID_P EQUAL 8
   AND NOT AMONTONS_SANITIZE STREQUAL "thread")
  set(AMONTONS_X86 TRUE)
  set(amontons_isas baseline avx2 avx512)
else()
  set(amontons_isas baseline)
endif()
set(amontons_flags_baseline "")
# Never -mfma: the same bits on every instruction set.
set(amontons_flags_avx2 -mavx2)
set(amontons_flags_avx512 -mavx512f -mavx512dq -mavx512vl -mprefer-vector-width=512)

function(amontons_add_kernels target)
  if(AMONTONS_X86)
    target_compile_definitions(${target} PRIVATE AMONTONS_X86)
  endif()
  if(NOT ARGN)
    return()
  endif()
  foreach(isa IN LISTS amontons_isas)
    add_library(${target}_${isa} OBJECT ${ARGN})
    target_include_directories(${target}_${isa} PRIVATE ${PROJECT_SOURCE_DIR}/include ${PROJECT_SOURCE_DIR}/src)
    target_compile_definitions(${target}_${isa} PRIVATE AMONTONS_ISA=${isa})
    if(AMONTONS_X86)
      target_compile_definitions(${target}_${isa} PRIVATE AMONTONS_X86)
    endif()
    amontons_settings(${target}_${isa})
    # -Wno-psabi: vectors are passed between functions of one object file only, so the note that their calling
    # convention depends on the instruction set does not apply. -Wno-maybe-uninitialized: with little optimisation
    # GCC warns of the deliberately undefined operands in its own intrinsics headers (its bug 105593).
    target_compile_options(${target}_${isa} PRIVATE ${amontons_flags_${isa}} -Wno-psabi
                           $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:${target}_${isa}>)
  endforeach()
endfunction()
