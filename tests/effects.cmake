ringlet_test(effects ringlet::effects ringlet::kernels ringlet::oracle)
target_sources(test_effects PRIVATE ${CMAKE_CURRENT_LIST_DIR}/unit/kernels_support.cpp)
