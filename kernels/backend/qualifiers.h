// What makes one source compile for the host's instruction sets and for CUDA.
//
// Every kernel lives in an inline namespace named after the instruction set it is compiled for (RINGLET_ISA),
// so that no function compiled with AVX-512 can stand in for its namesake in a program that runs on an older
// processor.
//
// RINGLET_KERNEL marks what must be inlined (packs live in registers), RINGLET_FUNCTION what the compiler may
// call, RINGLET_OUTLINED what a GPU had better call: inlined at each of its many uses it would cost more
// registers than a thread has. RINGLET_LAMBDA marks what a backend calls for each index, after the captures
// of a lambda: code of the device alone.
#pragma once

#ifndef RINGLET_ISA
#define RINGLET_ISA host
#endif

#if defined(__CUDACC__)
#define RINGLET_KERNEL __host__ __device__ __forceinline__
#define RINGLET_FUNCTION __host__ __device__ inline
#define RINGLET_OUTLINED __host__ __device__ __noinline__
#define RINGLET_LAMBDA __device__
#else
#define RINGLET_KERNEL inline __attribute__((always_inline))
#define RINGLET_FUNCTION inline
#define RINGLET_OUTLINED inline
#define RINGLET_LAMBDA
#endif

#if defined(__CUDA_ARCH__)
#define RINGLET_UNROLL _Pragma("unroll")
#elif defined(__CUDACC__)
#define RINGLET_UNROLL  // the host's half of a .cu file runs no kernels, and g++ knows no such pragma
#else
#define RINGLET_UNROLL _Pragma("GCC unroll 16")
#endif
