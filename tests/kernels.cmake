# The problem of known solution that studies too solve.
ringlet_test(kernels ringlet::kernels ringlet::state ringlet::oracle ringlet::study)

add_executable(bench_kernels ${CMAKE_CURRENT_LIST_DIR}/bench/bench_kernels.cpp
                             ${CMAKE_CURRENT_LIST_DIR}/bench/bench_contacts.cpp
                             ${CMAKE_CURRENT_LIST_DIR}/bench/bench_hairmesh.cpp)
target_include_directories(bench_kernels PRIVATE ${CMAKE_CURRENT_LIST_DIR})
target_link_libraries(bench_kernels PRIVATE ringlet::kernels ringlet::state ringlet::oracle ringlet_flags
                                            benchmark::benchmark)
