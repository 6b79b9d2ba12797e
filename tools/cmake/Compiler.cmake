# Flags that every target shares.
#
# Results must not depend on what a compiler chooses to fuse: contraction is off everywhere (host and device) and the
# kernels spell their fused multiply-adds out. errno is off so that sqrt becomes one instruction.
find_program(CCACHE ccache)
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
  set(CMAKE_CUDA_COMPILER_LAUNCHER ${CCACHE})
endif()

# -Wrestrict: GCC 12 warns about its own std::string.
add_library(ringlet_flags INTERFACE)
target_compile_options(ringlet_flags INTERFACE
  $<$<COMPILE_LANGUAGE:CXX>:-Wall -Wextra -Wno-psabi -Wno-restrict -ffp-contract=off -fno-math-errno>)
