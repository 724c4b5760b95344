include(CheckCXXCompilerFlag)

# The same sources give the same bytes in every folder: names of files in messages begin where the project begins.
function(amontons_hide_folders target)
  check_cxx_compiler_flag(-ffile-prefix-map=/a=/b AMONTONS_HAS_PREFIX_MAP)
  if(AMONTONS_HAS_PREFIX_MAP)
    target_compile_options(${target} PRIVATE
      -ffile-prefix-map=${PROJECT_SOURCE_DIR}/= -ffile-prefix-map=${PROJECT_BINARY_DIR}/=)
  endif()
endfunction()

# What every C++ target of this project is compiled with. Nothing here reaches a consumer.
function(amontons_settings target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF POSITION_INDEPENDENT_CODE ON)
  target_compile_options(${target} PRIVATE
    -Wall -Wextra -Wpedantic -Wshadow
    # Contraction into fused multiply-adds would round differently on processors that have them: results must
    # not depend on the instruction set, nor on what the compiler chose to contract.
    -ffp-contract=off
    # Square roots are instructions: nobody asks for errno. No value changes.
    -fno-math-errno)
  amontons_hide_folders(${target})
  # Functions are not replaced by those of another library: they may be inlined, and within the module of Python,
  # which takes the static library in, they are called directly and not by way of a table.
  check_cxx_compiler_flag(-fno-semantic-interposition AMONTONS_HAS_NO_INTERPOSITION)
  if(AMONTONS_HAS_NO_INTERPOSITION)
    target_compile_options(${target} PRIVATE -fno-semantic-interposition)
  endif()
  if(NOT BUILD_SHARED_LIBS)
    set_target_properties(${target} PROPERTIES CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
  # GCC copies and clears structures of this size with `rep movsq` and `rep stosq`, whose start takes as long as
  # a contact (368 bytes) in vector registers; contacts are copied into the problem and the state in every step,
  # and rows of joints begin as zeros.
  check_cxx_compiler_flag(-mmemcpy-strategy=vector_loop:512:noalign,libcall:-1:noalign AMONTONS_HAS_VECTOR_COPY)
  if(AMONTONS_HAS_VECTOR_COPY)
    foreach(operation memcpy memset)
      target_compile_options(${target} PRIVATE -m${operation}-strategy=vector_loop:512:noalign,libcall:-1:noalign)
    endforeach()
  endif()
  if(AMONTONS_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(AMONTONS_SANITIZE)
    target_compile_options(${target} PRIVATE
      -fsanitize=${AMONTONS_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
    # The address sanitizer reports an access by a null pointer, too. Checks of every pointer take the compiler a quarter
    # of its time: the build of a release, which names them, has them.
    if(AMONTONS_SANITIZE MATCHES "undefined" AND NOT AMONTONS_SANITIZE MATCHES "alignment")
      target_compile_options(${target} PRIVATE -fno-sanitize=null,alignment)
    endif()
    target_link_options(${target} PUBLIC -fsanitize=${AMONTONS_SANITIZE})
  endif()
endfunction()
