# OpenCV's own package where it is installed, else the libraries that are asked for. Debian ships the package file only with
# libopencv-dev, which brings VTK and Qt along (330 MB); the parts (libopencv-core-dev, ...) come without one.
# Sets OpenCV_FOUND, OpenCV_INCLUDE_DIRS, OpenCV_LIBS and the targets opencv_core, ...
if(NOT OpenCV_FIND_COMPONENTS)
  set(OpenCV_FIND_COMPONENTS core imgproc)
endif()
find_package(OpenCV QUIET CONFIG COMPONENTS ${OpenCV_FIND_COMPONENTS})
if(OpenCV_FOUND)
  return()
endif()
find_path(OpenCV_INCLUDE_DIRS opencv2/core.hpp PATH_SUFFIXES opencv4)
mark_as_advanced(OpenCV_INCLUDE_DIRS)
set(OpenCV_LIBS "")
set(_opencv_needed OpenCV_INCLUDE_DIRS)
foreach(_opencv_part IN LISTS OpenCV_FIND_COMPONENTS)
  string(REGEX REPLACE "^opencv_" "" _opencv_part ${_opencv_part})
  find_library(OpenCV_${_opencv_part}_LIBRARY opencv_${_opencv_part})
  mark_as_advanced(OpenCV_${_opencv_part}_LIBRARY)
  list(APPEND _opencv_needed OpenCV_${_opencv_part}_LIBRARY)
  list(APPEND OpenCV_LIBS opencv_${_opencv_part})
  if(OpenCV_${_opencv_part}_LIBRARY AND NOT TARGET opencv_${_opencv_part})
    add_library(opencv_${_opencv_part} UNKNOWN IMPORTED GLOBAL)
    set_target_properties(opencv_${_opencv_part} PROPERTIES
      IMPORTED_LOCATION "${OpenCV_${_opencv_part}_LIBRARY}" INTERFACE_SYSTEM_INCLUDE_DIRECTORIES "${OpenCV_INCLUDE_DIRS}"
      INTERFACE_INCLUDE_DIRECTORIES "${OpenCV_INCLUDE_DIRS}")
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenCV REQUIRED_VARS ${_opencv_needed})
