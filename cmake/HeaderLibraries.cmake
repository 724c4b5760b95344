# Sets AMONTONS_EIGEN_INCLUDE_DIR and AMONTONS_JSON_INCLUDE_DIR: the headers of Eigen 3.4 and of nlohmann/json 3 from,
# in this order, CMAKE_PREFIX_PATH, the wheels of the Python that builds the bindings, the wheels in .venv, the system.
function(amontons_find_headers variable header wheel folder debian)
  set(hints "")
  if(Python_EXECUTABLE)
    execute_process(
      COMMAND ${Python_EXECUTABLE} -c
              "from importlib.metadata import distribution as d; print(d('${wheel}').locate_file('${folder}'))"
      OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    list(APPEND hints ${found})
  endif()
  file(GLOB local ${PROJECT_SOURCE_DIR}/.venv/lib/python3*/site-packages/${folder})
  find_path(${variable} ${header} HINTS ${hints} ${local} PATH_SUFFIXES eigen3
            DOC "Directory that contains ${header}")
  if(NOT ${variable})
    message(FATAL_ERROR "${header} not found: install it (Debian: ${debian}; Python: pip install ${wheel}), "
                        "or set ${variable} to the directory that contains ${header}")
  endif()
endfunction()

amontons_find_headers(AMONTONS_EIGEN_INCLUDE_DIR Eigen/SparseCholesky cmeel-eigen cmeel.prefix/include libeigen3-dev)
amontons_find_headers(AMONTONS_JSON_INCLUDE_DIR nlohmann/json.hpp nlohmann-json nlohmann_json/include
                      nlohmann-json3-dev)
