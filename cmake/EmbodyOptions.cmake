# Compiler settings shared by every target.
option(EMBODY_TESTS "Build tests and benchmarks" ON)
option(EMBODY_WERROR "Treat warnings as errors" OFF)
option(EMBODY_FUZZ "Build the libFuzzer harnesses (clang)" OFF)
set(EMBODY_SANITIZE "" CACHE STRING "Sanitizers for -fsanitize=, e.g. address,undefined or thread")

set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
# Release keeps symbols: a field report without a backtrace helps nobody.
set(CMAKE_CXX_FLAGS_RELEASE "-O2 -g1 -DNDEBUG")
set(CMAKE_C_FLAGS_RELEASE "-O2 -g1 -DNDEBUG")
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release CACHE STRING "" FORCE)
endif()

if(EMBODY_SANITIZE)
  # -O2 with full debug information makes a file of Eigen expressions take seven minutes under UBSan; this takes half a
  # minute.
  set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O1 -g1 -DNDEBUG")
  set(CMAKE_C_FLAGS_RELWITHDEBINFO "-O1 -g1 -DNDEBUG")
  add_compile_options(-fsanitize=${EMBODY_SANITIZE} -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${EMBODY_SANITIZE})
  add_compile_definitions(EMBODY_SANITIZED=1)
endif()
if(EMBODY_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)  # the code under test too: the fuzzer sees which branches an input takes
endif()

add_library(embody_warnings INTERFACE)
target_compile_options(embody_warnings INTERFACE
  -Wall -Wextra -Wno-missing-field-initializers -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${EMBODY_WERROR}>:-Werror>)
