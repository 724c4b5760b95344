# Sets AMONTONS_EIGEN_INCLUDE_DIR: the headers of Eigen 3.4 from, in this order, CMAKE_PREFIX_PATH, the wheel
# cmeel-eigen of the Python that builds the bindings, the wheel in .venv, the system.
set(eigen_hints "")
if(Python_EXECUTABLE)
  execute_process(
    COMMAND ${Python_EXECUTABLE} -c
            "from importlib.metadata import distribution as d; print(d('cmeel-eigen').locate_file('cmeel.prefix'))"
    OUTPUT_VARIABLE eigen_wheel OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(eigen_wheel)
    list(APPEND eigen_hints ${eigen_wheel}/include)
  endif()
endif()
file(GLOB eigen_local ${PROJECT_SOURCE_DIR}/.venv/lib/python3*/site-packages/cmeel.prefix/include)
find_path(AMONTONS_EIGEN_INCLUDE_DIR Eigen/SparseCholesky HINTS ${eigen_hints} ${eigen_local}
          PATH_SUFFIXES eigen3 DOC "Directory that contains Eigen/SparseCholesky")
if(NOT AMONTONS_EIGEN_INCLUDE_DIR)
  message(FATAL_ERROR "Eigen 3.4 not found: install it (Debian: libeigen3-dev; Python: pip install cmeel-eigen), "
                      "or set AMONTONS_EIGEN_INCLUDE_DIR to the directory that contains Eigen/SparseCholesky")
endif()
