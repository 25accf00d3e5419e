# Compilers, flags and the optional CUDA language. Every target gets them through `tactus_settings`.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

find_program(CCACHE_PROGRAM ccache)
if(CCACHE_PROGRAM)
  # Paths in keys are relative to the checkout: what one compiled, another finds.
  set(ccache_launcher ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${CCACHE_PROGRAM})
  set(CMAKE_CXX_COMPILER_LAUNCHER ${ccache_launcher})
  set(CMAKE_CUDA_COMPILER_LAUNCHER ${ccache_launcher})
endif()

# Who changes the code has a compiler cache; strangers have compilers that we don't know.
if(CCACHE_PROGRAM)
  option(TACTUS_WERROR "Warnings are errors" ON)
else()
  option(TACTUS_WERROR "Warnings are errors" OFF)
endif()

# Without a compiler cache everything is compiled once, and the standard library's headers take a third of the time. (With one
# they stay out: what is precompiled is no good key for a cache, and hides an #include that a source lacks.)
if(CCACHE_PROGRAM)
  option(TACTUS_PCH "Precompile the headers that most sources include" OFF)
else()
  option(TACTUS_PCH "Precompile the headers that most sources include" ON)
endif()

# g++ looks for memory to use again from 128 MB on, and finds little: 5 % of the time of large groups.
if(TACTUS_PCH AND CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:--param=ggc-min-heapsize=400000>)
endif()

# Sources with definitions of their own read the headers themselves: no reason to warn.
set(CMAKE_PCH_WARN_INVALID OFF)

# Likewise, sources are compiled together (tactus_batch). .ci/run builds so, too.
if(CCACHE_PROGRAM)
  option(TACTUS_UNITY "Compile sources in groups" OFF)
else()
  option(TACTUS_UNITY "Compile sources in groups" ON)
endif()

# tactus_gpus_here(out): the compute capabilities of this machine's GPUs, as 86 for 8.6; none without a driver.
function(tactus_gpus_here out)
  find_program(NVIDIA_SMI nvidia-smi)
  mark_as_advanced(NVIDIA_SMI)
  set(capabilities "")
  if(NVIDIA_SMI)
    execute_process(COMMAND ${NVIDIA_SMI} --query-gpu=compute_cap --format=csv,noheader
                    OUTPUT_VARIABLE lines ERROR_QUIET RESULT_VARIABLE status)
    if(status EQUAL 0)
      string(REGEX MATCHALL "[0-9]+\\.[0-9]" capabilities "${lines}")
      list(REMOVE_DUPLICATES capabilities)
      list(TRANSFORM capabilities REPLACE "\\." "")
    endif()
  endif()
  set(${out} ${capabilities} PARENT_SCOPE)
endfunction()

# tactus_supported_gpus(out capability ...): those that this nvcc makes machine code for, as 86-real.
function(tactus_supported_gpus out)
  execute_process(COMMAND ${CMAKE_CUDA_COMPILER} --list-gpu-code OUTPUT_VARIABLE known ERROR_QUIET)
  set(architectures "")
  foreach(capability IN LISTS ARGN)
    if(known MATCHES "sm_${capability}[^0-9a-z]")
      list(APPEND architectures ${capability}-real)
    endif()
  endforeach()
  set(${out} ${architectures} PARENT_SCOPE)
endfunction()

# Machine code for the GPUs of this machine, and PTX that the drivers of all others from 7.5 on compile at the first start. A
# package has machine code for those that people own.
set(TACTUS_WITH_CUDA OFF)
if(TACTUS_CUDA)
  include(CheckLanguage)
  if(NOT CMAKE_CUDA_COMPILER AND NOT DEFINED ENV{CUDACXX} AND EXISTS /usr/local/cuda/bin/nvcc)
    set(CMAKE_CUDA_COMPILER /usr/local/cuda/bin/nvcc)
  endif()
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    # Set before enable_language: CMake's own guess is an architecture nobody here has.
    if(TACTUS_PACKAGE)
      tactus_supported_gpus(architectures 75 80 86 89 90 100 120)
    else()
      tactus_gpus_here(here)
      tactus_supported_gpus(architectures ${here})
    endif()
    list(APPEND architectures 75-virtual)
    set(CMAKE_CUDA_ARCHITECTURES ${architectures} CACHE STRING "CUDA architectures to build")
    set(TACTUS_CUDA_CODE "${CMAKE_CUDA_ARCHITECTURES}")
    set(CMAKE_CUDA_STANDARD 20)
    enable_language(CUDA)
    # CMake 3.25 does not know nvcc's C++20 flag.
    foreach(kind STANDARD EXTENSION)
      if(NOT CMAKE_CUDA20_${kind}_COMPILE_OPTION)
        set(CMAKE_CUDA20_${kind}_COMPILE_OPTION "-std=c++20")
      endif()
    endforeach()
    find_package(CUDAToolkit REQUIRED)
    set(TACTUS_WITH_CUDA ON)
  endif()
endif()

execute_process(COMMAND git -C ${CMAKE_SOURCE_DIR} describe --always --dirty --abbrev=10
                OUTPUT_VARIABLE TACTUS_COMMIT OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
if(NOT TACTUS_COMMIT)
  set(TACTUS_COMMIT "unknown")
else()
  # A new commit is a new name in every result file: the build then configures again.
  execute_process(COMMAND git -C ${CMAKE_SOURCE_DIR} rev-parse --path-format=absolute --git-path logs/HEAD
                  OUTPUT_VARIABLE head_log OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(EXISTS "${head_log}")
    set_property(DIRECTORY ${CMAKE_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${head_log}")
  endif()
endif()

find_package(TBB REQUIRED)

add_library(tactus_settings INTERFACE)
target_compile_features(tactus_settings INTERFACE cxx_std_20)
target_include_directories(tactus_settings INTERFACE $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/include>
                                                     $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}/src>
                                                     $<INSTALL_INTERFACE:include>)
target_compile_definitions(tactus_settings INTERFACE $<$<BOOL:${TACTUS_WITH_CUDA}>:TACTUS_WITH_CUDA=1>
                                                     $<$<BOOL:${TACTUS_CHECKED}>:TACTUS_CHECKED=1>)
# One answer on every device: no contraction the source did not ask for (ARCHITECTURE.md, "One answer"). g++ 12's SLP
# vectoriser fuses a*b-c, a*b+c pairs (vfmaddsub) in spite of -ffp-contract=off, so it is off; loops are still vectorised.
# g++ 13.3 with -fipa-modref miscompiles loops under `omp simd`: hulls have holes (visual_hull_test fails). g++ 12 does not.
set(modref_off $<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_GREATER_EQUAL:$<CXX_COMPILER_VERSION>,13>>:-fno-ipa-modref>)
target_compile_options(tactus_settings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:${modref_off} -ffp-contract=off -fno-trapping-math -fno-math-errno -fopenmp-simd -fno-tree-slp-vectorize -march=${TACTUS_ARCH}>
  $<$<COMPILE_LANGUAGE:CUDA>:-fmad=false --expt-relaxed-constexpr -Xcompiler=-fopenmp-simd,-ffp-contract=off>)

# Warnings are ours, not our users': only in this build. (-Wrestrict: false alarms on std::string in g++ 12, PR 105651. The same
# about overflow, in groups of sources and where precompiled headers are no longer known as the system's.)
add_library(tactus_warnings INTERFACE)
target_compile_options(tactus_warnings INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:$<$<BOOL:${TACTUS_WERROR}>:-Werror> -Wall -Wextra -Wpedantic -Wshadow -Wfloat-conversion -Wno-unknown-pragmas -Wno-restrict
    $<$<OR:$<BOOL:${TACTUS_PCH}>,$<BOOL:${TACTUS_UNITY}>>:-Wno-stringop-overflow$<SEMICOLON>-Wno-stringop-overread$<SEMICOLON>-Wno-array-bounds>>
  $<$<COMPILE_LANGUAGE:CUDA>:-Werror=cross-execution-space-call -Xcompiler=-Wall,-Wextra>)
# Modules and programs are compiled with the compiler's and the C library's checks, and without names of this folder: the same bits
# come from another one. (Of loops of kernels they cost nothing: `bench frame` and `bench table5` take as long with them.)
add_library(tactus_hardened INTERFACE)
if(NOT TACTUS_SANITIZE)
  target_compile_options(tactus_hardened INTERFACE
    "$<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-fstack-protector-strong;-fstack-clash-protection;-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=3;-ffile-prefix-map=${PROJECT_SOURCE_DIR}=.>")
endif()
# Code that no frame waits for: files, flags, JSON, and those who call other folders' loops. The optimiser has nothing to win there,
# and it was half of what a first build takes.
add_library(tactus_cold INTERFACE)
target_compile_options(tactus_cold INTERFACE $<$<AND:$<COMPILE_LANGUAGE:CXX>,$<CONFIG:Release>>:-O1>)
# Programs: all addresses of libraries are found before main(), and can't be changed afterwards.
add_link_options(-Wl,-z,relro,-z,now)

# Only what is used: a test of kernels must not drag in every image codec of the machine.
add_link_options(-Wl,--no-undefined -Wl,--as-needed)
if(TACTUS_ARCH STREQUAL "x86-64-v3")
  add_link_options(-Wl,-z,x86-64-v3)
endif()
# Programs find the libraries of the folder they were moved to, and DT_RPATH (not RUNPATH) lets those libraries find theirs.
set(CMAKE_INSTALL_RPATH "\$ORIGIN/../lib")
set(CMAKE_INSTALL_RPATH_USE_LINK_PATH ON)
set(CMAKE_BUILD_WITH_INSTALL_RPATH ON)  # the bundle copies what was built
add_link_options(-Wl,--disable-new-dtags)
# Of this build only: options of `tactus_settings` would reach whoever uses the installed package.
if(TACTUS_SANITIZE)
  add_compile_options("$<$<COMPILE_LANGUAGE:CXX>:-fsanitize=${TACTUS_SANITIZE};-fno-omit-frame-pointer>")
  add_link_options(-fsanitize=${TACTUS_SANITIZE})
endif()
