# Built without CUDA too: the threads' index arithmetic runs on the host, and the rest reports SKIPPED.
ringlet_test(cuda ringlet::kernels ringlet::state)
