# Most of the time of a compiler goes into reading headers and into inline functions that every source has again. With
# AMONTONS_UNITY the sources of one folder are one to the compiler (a unity build): the library takes about half of the
# processor time. A name in an unnamed namespace is then one of the folder. The preset dev compiles source by source, which
# shows includes that a source lacks: make release_checks builds it.
option(AMONTONS_UNITY "Compile the sources of a folder together: less processor time" ON)

# Sources of one folder below `root` form a group; a folder alone stays as it is.
function(amontons_unite_folders target root)
  if(NOT AMONTONS_UNITY)
    return()
  endif()
  foreach(source IN LISTS ARGN)
    file(RELATIVE_PATH path ${root} ${source})
    get_filename_component(folder ${path} DIRECTORY)
    string(MAKE_C_IDENTIFIER "sources_${folder}" group)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # GCC takes a source that another one includes for a header, whose classes should hold nothing of an unnamed namespace,
  # and warns of "a" + std::string where it inlines more (its bug 105651).
  target_compile_options(${target} PRIVATE "$<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage;-Wno-restrict>")
endfunction()

# All sources of a target form groups of at most `size`, in the order of their names.
function(amontons_unite_in_batches target size)
  if(AMONTONS_UNITY AND TARGET ${target})
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE BATCH UNITY_BUILD_BATCH_SIZE ${size})
  endif()
endfunction()
